"""Journals of servers and emulators, and their reenactment."""
