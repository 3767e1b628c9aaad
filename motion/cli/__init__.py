"""Command lines of this room: `robots` and `plan`."""
