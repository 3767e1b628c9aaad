"""Settings: the configuration tables and the file they come from."""
