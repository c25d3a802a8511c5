"""Control: what a machine's controller decides, without ROS and without a clock."""
