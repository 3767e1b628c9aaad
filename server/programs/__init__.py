"""Programs: points and statements as values, their text, their edits and their runs."""
