"""Inverse kinematics: the problem, its branches, the search, singularities."""
