"""Clients of the public pendant protocol; nothing here knows the server."""
