"""Continuous recordings: taken from the robot, kept, and played back."""
