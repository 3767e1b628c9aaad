"""Recordings: taken from the robot continuously, kept, and played back."""
