"""Program editing: edits, their history, and the tasks that do them in steps."""
