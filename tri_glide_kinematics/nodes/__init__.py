"""ROS 2 nodes: they turn messages into calls and results into messages."""
