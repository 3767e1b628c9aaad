"""The motion between buffered points, and stopping."""
