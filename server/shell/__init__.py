"""Sockets, timer and effects: the asyncio shell of the cores."""
