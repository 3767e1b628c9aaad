"""Teach and playback: the programs of a cell, edited and run by its pendants."""
