"""The two conversations: with pendants and with ROS-Industrial clients."""
