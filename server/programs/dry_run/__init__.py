"""Dry runs: programs checked without moving the robot."""
