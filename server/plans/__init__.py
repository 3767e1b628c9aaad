"""Plans of a cell: made, kept, looked at and executed as they were shown."""
