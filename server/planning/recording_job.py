"""The job of playing a recording back, and what is told of its plan; plain data.

Apart from `jobs`, because it carries samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.motion.scene import Scene

from ..recording.document import Extract
from .pose_goal import PoseGoal

SLOWEST, FASTEST = 0.1, 4.0
"""Playback speeds relative to the recording."""

APPROACH_SPEED = 0.1
"""Greatest speed towards the first sample, of the joints' limits."""

MOST_REPEATS = 1_000

TOLERANCES = (0.002, 0.005, 0.01)
"""Tried in turn where none is asked for: reports of a busy controller come unevenly [rad or m]."""


@dataclass(frozen=True, slots=True)
class RecordingJob:
    """Play a recording back.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        name: of the recording, for refusals.
        samples: its rows in pieces of whole rows, 8-byte little-endian reals; in pieces, because
            they are too many to be handled at once. May begin before and end after what is played.
        extract: which values of a row are which.
        period: time between its reports [s].
        factor: speed relative to the recording.
        tolerance: how far the path may lie from a sample in any joint [rad or m]; None for the
            first of `TOLERANCES` that it can keep.
        begins: first time of the recording that is played [s].
        ends: last time [s]; None for its end.
        repeats: how many times it is played.
        bridge: longest gap that is played across, in a smooth line [s].
        tool_speed: largest speed of tool and elbow [m/s]; None for no cap.
        tool: tool centre point in the flange; None for the flange itself.
        scene: what the way must not touch, the robot itself included; None to check nothing.
    """

    job_id: int
    start: tuple[float, ...]
    name: str
    samples: tuple[bytes, ...] = field(repr=False)
    extract: Extract
    period: float
    factor: float = 1.0
    tolerance: float | None = None
    begins: float = 0.0
    ends: float | None = None
    repeats: int = 1
    bridge: float = 0.25
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class PlaybackAccount:
    """What was asked of a playback and what is possible.

    Attributes:
        samples: rows that are played.
        recorded: how long their recording took [s].
        asked: how long playing them once was to take [s].
        possible: how long it takes under the limits [s].
        approach: time of the soft way to the first sample [s]; 0 where the robot stands there.
        total: time of the whole motion, repeats and ways back included [s].
        deviation: greatest distance of a sample from the path, in any joint [rad or m].
        dropped: rows whose time did not advance.
        gaps: gaps that are played across.
        longest_gap: the longest of them [s].
    """

    samples: int
    recorded: float
    asked: float
    possible: float
    approach: float
    total: float
    deviation: float
    dropped: int
    gaps: int
    longest_gap: float

    @property
    def factor(self) -> float:
        """Speed relative to the recording that is possible."""
        return self.recorded / self.possible
