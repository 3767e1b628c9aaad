"""The planning scene of a cell, its signals and monitor."""
