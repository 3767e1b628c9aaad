"""Named joint positions of a cell: kept, told, and found by name."""
