"""The planning processes."""
