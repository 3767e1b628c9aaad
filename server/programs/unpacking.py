"""A program read piece by piece, so that no step holds up an event loop.

Owns how much a step reads. The pieces were cut by `work`, which has checked the whole program.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from .document import POINTS, STATEMENTS, program_from_json
from .points import TeachPoint
from .program import Program
from .statements import Statement
from .work import PACK, BodyUnpacked


class Unpacking:
    """A program on its way from its pieces."""

    def __init__(self, unpacked: BodyUnpacked) -> None:
        """Begin with nothing read."""
        self._head = unpacked.head
        self._point_packs = deque(unpacked.points)
        self._statement_packs = deque(unpacked.statements)
        self._points: list[TeachPoint] = []
        self._statements: list[Statement] = []
        self._program: Program | None = None

    def step(self) -> Program | None:
        """Read fewer than two packs; return the program once it is whole."""
        if self._program is not None:
            return self._program
        read = 0
        while read < PACK and (self._point_packs or self._statement_packs):
            read += self._read_pack()
        # The end costs as much as a step, so it is one of its own where the program is long.
        if self._point_packs or self._statement_packs or read >= PACK:
            return None
        head = program_from_json(self._head)
        whole = replace(head, points=tuple(self._points), statements=tuple(self._statements))
        if len(self._points) + len(self._statements) < PACK:
            return whole
        # So does what is done with it then, for which its calls are looked up now.
        self._program = whole
        _ = whole.calls
        return None

    def _read_pack(self) -> int:
        if self._point_packs:
            points = POINTS.validate_json(self._point_packs.popleft())
            self._points += points
            return len(points)
        statements = STATEMENTS.validate_json(self._statement_packs.popleft())
        self._statements += statements
        return len(statements)
