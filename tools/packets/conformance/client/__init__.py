"""The client role: what a client sent is judged, live or from a recording."""
