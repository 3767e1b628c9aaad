"""Running programs on the robot."""
