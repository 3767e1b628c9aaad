"""Traffic broken on purpose, by a seeded script."""
