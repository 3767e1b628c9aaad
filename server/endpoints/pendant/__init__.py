"""The conversation with pendants."""
