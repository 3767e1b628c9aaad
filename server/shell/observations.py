"""Observations: what the shell asks of the operating system, with each answer that counts noted.

A rerun asks nobody: it finds in the journal what the world answered then. What nobody writes down
is not asked here but by whoever wants to know, because each message comes by there: `are_noted`.
"""

from __future__ import annotations

import asyncio

from openpendant.simplemsg.journal import Journal


class Observations:
    """What the operating system and the watchdog say."""

    def __init__(self, journal: Journal) -> None:
        """Note answers in a journal."""
        self._journal = journal

    @property
    def are_noted(self) -> bool:
        """Whether answers are written down, or come from a journal."""
        return self._journal.is_kept

    def is_gone(self, link: str | int, transport: asyncio.BaseTransport) -> bool:
        """Return True if the loop has closed a transport by itself, on an error of the kernel."""
        return self._journal.answer("gone", link, transport.is_closing())

    def is_clogged(self, session: int, is_behind: bool) -> bool:
        """Return whether a client is behind with what was written to it."""
        return self._journal.answer("clogged", session, is_behind)

    def is_flooded(self, session: int, is_behind: bool) -> bool:
        """Return whether a client is so far behind that it is cut off."""
        return self._journal.answer("flooded", session, is_behind)

    def is_paired(self, cell: str, is_typed: bool) -> bool:
        """Return whether the code that was typed is the one of a cell, which no journal holds."""
        return self._journal.answer("paired", cell, is_typed)

    def has_stopped(self, link: str, has_stopped: bool) -> bool:
        """Return whether the watchdog has sent a STOP to a robot."""
        return self._journal.answer("stopped", link, has_stopped)
