"""The two ROS-Industrial ports: what a ROS driver may ask, and what it is told."""
