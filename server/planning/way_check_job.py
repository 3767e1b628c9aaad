"""The job of looking along the rest of a motion that runs already; plain data."""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.motion.scene import Scene


@dataclass(frozen=True, slots=True)
class WayCheckJob:
    """Look whether a motion under way would touch anything in a scene that was changed.

    Attributes:
        job_id: number of the job.
        start: (n,) the first of the positions, controller side [rad or m].
        positions: (m, n) of them in the order of the motion, 8-byte little-endian reals.
        scene: what stands around now.
    """

    job_id: int
    start: tuple[float, ...]
    positions: bytes = field(repr=False)
    scene: Scene


@dataclass(frozen=True, slots=True)
class WayFree:
    """The answer where nothing touches."""
