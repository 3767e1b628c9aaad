"""A motion between its request and its end: what it is for, how it was planned, what is played.

Owns no rule; `trajectory_execution` begins and ends it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ...control.modes import MotionKind
from ...events.cell_events import MotionRequest
from ...planning.jobs import PlaybackPlan
from ..jog.jog_rows import JogRows
from ..jog.jog_undo import UndoPlan, Waypoints
from .point_stream import PointStream
from .setpoint_sources import StoredRows


@dataclass(slots=True)
class ActiveMotion:
    """A motion between its request and its end.

    Attributes:
        request: who asked for it.
        kind: what for.
        job_id: number of its planning job.
        planned_cap: cap of the tool speed that it was planned with [m/s]; None for none.
        plan_time: how long it was planned [s].
        playback: of a recording, what was asked and what is possible.
        duration: of the certified trajectory [s]; 0 of a jog.
        back: how it is taken back; None where it is no jog, no increment and no undo of one.
        begin_by: latest time at which it may begin, not counting `plan_time` [ns]; None for any.
        has_arrived: the robot stood at its end.
        execution: sends its set-points; None while it is planned.
        stored: the certified trajectory that is played; None while planning and in a jog.
        jog: the jog that is driven; None for all else.
    """

    request: MotionRequest
    kind: MotionKind
    job_id: int
    planned_cap: float | None = None
    plan_time: float = 0.0
    playback: PlaybackPlan | None = None
    duration: float = 0.0
    back: UndoPlan | None = None
    begin_by: int | None = None
    has_arrived: bool = field(default=False, init=False)
    execution: PointStream | None = field(default=None, init=False)
    stored: StoredRows | None = field(default=None, init=False)
    jog: JogRows | None = field(default=None, init=False)

    def begin(self, execution: PointStream) -> None:
        """Take note that set-points are being sent."""
        rows = execution.rows
        self.execution = execution
        self.stored = rows if isinstance(rows, StoredRows) else None
        self.jog = rows if isinstance(rows, JogRows) else None

    @property
    def is_paused(self) -> bool:
        """Whether somebody paused it, and nobody has resumed it since."""
        return self.stored is not None and self.stored.pause_wanted

    @property
    def way_back(self) -> Waypoints:
        """The waypoints along which it is taken back; empty where that cannot be."""
        if self.back is None:
            return ()
        return self.back.left(self.waypoints_passed, has_arrived=self.has_arrived)

    @property
    def waypoints_passed(self) -> int:
        """How many waypoints after its start the robot has passed; 0 in a jog and while planned."""
        if self.stored is None or self.execution is None:
            return 0
        return self.stored.waypoints_passed(self.execution.reached)

    @property
    def waypoints_left(self) -> int:
        """How many waypoints the robot has yet to pass; 0 in a jog and while planned."""
        return 0 if self.stored is None else self.stored.waypoints - self.waypoints_passed
