"""How far a robot may be from what it was commanded before it is stopped.

Owns the figures and which of them hold: those of the cell's file where it names them, else those of
a real controller, or closer ones where the controller says that it is emulated. Decides nothing.
"""

from __future__ import annotations

from typing import NamedTuple

from openpendant.motion.description.limits import JointLimits

from ...settings.cell_settings import ControllerLink

PER_RADIAN = 0.5
"""What counts as much on a sliding joint as 1 rad on a turning one [m]: 0.02 rad are 10 mm."""

RANGE_TOLERANCE = 0.02
"""How far beyond its range a joint may be reported [rad], 10 mm on a sliding one."""

EMULATED = {"path_tolerance": 0.01, "lag": 0.01, "noise": 0.0}
"""What holds on a controller that says it is emulated, unless the cell's file names the key."""


class TrackingTolerances(NamedTuple):
    """What is accepted of the reports of one motion.

    Attributes:
        path: (n,) distance of each joint from the path while it stands [rad or m].
        lag: how far each joint may be behind the set-points, each by itself [s].
        noise: of a reported position [rad or m].
        range: (n,) distance of each joint from its range [rad or m].
    """

    path: tuple[float, ...]
    lag: float
    noise: float
    range: tuple[float, ...]


def tracking_tolerances(
    link: ControllerLink, limits: JointLimits, *, says_emulated: bool
) -> TrackingTolerances:
    """Return what holds for a motion that begins now.

    Args:
        link: the cell's `[controller]` table; a key that its file names counts as it is.
        limits: the robot's joint limits; which joints slide.
        says_emulated: the controller says that it is emulated.
    """
    close = EMULATED if says_emulated else {}
    path, lag, noise = (
        close[key] if key in close and key not in link.model_fields_set else getattr(link, key)
        for key in EMULATED
    )
    units = tuple(PER_RADIAN if slides else 1.0 for slides in limits.prismatic)
    return TrackingTolerances(
        tuple(path * unit for unit in units),
        lag,
        noise,
        tuple(RANGE_TOLERANCE * unit for unit in units),
    )
