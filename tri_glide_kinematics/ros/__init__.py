"""ROS: what the nodes share."""
