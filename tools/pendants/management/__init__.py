"""Typed calls of the pendant server's management operations, one definition for both clients."""
