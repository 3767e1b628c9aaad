"""Checks and reports of a robot in words."""
