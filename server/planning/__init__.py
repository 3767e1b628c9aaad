"""Planning: jobs, the processes that do them, and the store of certified trajectories."""
