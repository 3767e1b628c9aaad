"""Packets from files of every kind, and what they say."""
