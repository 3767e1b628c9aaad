"""Collision-free planning: planners, path and edge checks."""
