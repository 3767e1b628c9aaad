"""How exactly a tool keeps its path, as ISO 9283 measures path accuracy.

The motion is run as the emulator runs it: every 10 ms a point with position, velocity and
acceleration, joined by the emulator's own segments. The tool's places, by forward kinematics, are
compared with the nearest places of the commanded curve.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from openpendant.controller_emulator.segment import Bounds, End, Segment, connect
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.limits import JointLimits
from openpendant.motion.tool_curves import Places, ToolCurve
from openpendant.motion.tool_paths import deviation
from openpendant.motion.trajectory import Trajectory

Array = NDArray[np.float64]

PER_SAMPLE = 10
CANDIDATES = 2001
ARM = 0.1  # m; what a turn of 1 rad counts in finding the nearest place


class PathAccuracy(NamedTuple):
    """The greatest deviation of the tool from its curve.

    Attributes:
        distance: [mm].
        angle: [°].
    """

    distance: float
    angle: float


def executed(trajectory: Trajectory, limits: JointLimits) -> Array:
    """Return the (m, n) joint positions of a run at ten times the density of the samples."""
    bounds = tuple(
        Bounds(lower - 1e-6, upper + 1e-6, velocity * 1.001, acceleration * 1.01, acceleration)
        for lower, upper, velocity, acceleration in zip(
            limits.lower, limits.upper, limits.velocity, limits.acceleration, strict=True
        )
    )
    ends = [
        [End(*state) for state in zip(*trajectory.row(row)[1:], strict=True)]
        for row in range(len(trajectory))
    ]
    period = float(trajectory.times[1])
    run: list[tuple[float, ...]] = []
    for before, after in pairwise(ends):
        segment = connect(period, before, after, bounds)
        assert isinstance(segment, Segment), segment
        run += [segment.sample(period * part / PER_SAMPLE)[0] for part in range(PER_SAMPLE)]
    return np.array([*run, trajectory.final])


def path_accuracy(kinematics: Kinematics, curve: ToolCurve, joints: Array) -> PathAccuracy:
    """Measure the tool at joint positions (m, n), in order of time, against its curve."""
    placed = [kinematics.place(position) for position in joints]
    places = Places(np.array([r for r, _ in placed]), np.array([p for _, p in placed]))
    s = np.linspace(0.0, curve.length, CANDIDATES)
    candidates = curve.place(s)
    nearest, at = [], 0
    for rotation, position in zip(*places, strict=True):
        # A closed curve comes near itself: the search goes on from the place before.
        window = slice(max(0, at - CANDIDATES // 10), at + CANDIDATES // 10)
        off = np.linalg.norm(candidates.position[window] - position, axis=1)
        off += ARM * np.linalg.norm(candidates.rotation[window] - rotation, axis=(1, 2))
        at = window.start + int(np.argmin(off))
        nearest.append(s[at])
    distance, angle = deviation(curve, places, np.array(nearest))
    return PathAccuracy(1e3 * float(distance.max()), math.degrees(float(angle.max())))
