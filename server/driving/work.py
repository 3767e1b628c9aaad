"""A motion between its request and its end: what it is for, how it was planned, what is played.

Owns no rule; `driving` begins and ends it.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..jog.jogging import JogRows
from ..news import Request
from ..operating_mode import MotionKind
from .execution import Execution
from .row_sources import StoredRows


@dataclass(slots=True)
class Work:
    """A motion between its request and its end."""

    request: Request
    kind: MotionKind
    job_id: int
    planned_cap: float | None = None
    plan_time: float = 0.0
    duration: float = 0.0
    execution: Execution | None = None

    @property
    def stored(self) -> StoredRows | None:
        """The certified trajectory that is played; None while planning and in a jog."""
        rows = None if self.execution is None else self.execution.rows
        return rows if isinstance(rows, StoredRows) else None

    @property
    def jog(self) -> JogRows | None:
        """The jog that is driven."""
        rows = None if self.execution is None else self.execution.rows
        return rows if isinstance(rows, JogRows) else None
