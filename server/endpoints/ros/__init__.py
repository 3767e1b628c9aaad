"""The conversation with ROS-Industrial clients."""
