"""Streaming a trajectory to the controller: set-points, feedback, guards."""
