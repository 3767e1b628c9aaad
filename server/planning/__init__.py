"""The work of planning: jobs, the processes that do them, and the record of what they answered."""
