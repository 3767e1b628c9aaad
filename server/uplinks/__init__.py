"""Controller dialects of the server, one per file."""
