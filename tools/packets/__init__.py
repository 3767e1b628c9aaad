"""Packet-level tools: reading and writing simple-message packets by hand and by script."""
