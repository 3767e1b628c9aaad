"""Programs tried without moving, and run on the robot."""
