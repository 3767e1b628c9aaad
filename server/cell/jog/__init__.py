"""Presses and the set-points of jogs."""
