"""Closed-form inverse kinematics, for the arms that have one.

Owns the list of families. Everything inside is chain-side: coupling, limits and revolutions are the
caller's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from . import three_parallel, wrist_partitioned
from .geometry import ArmGeometry, ClosedForm, arm_geometry
from .wrist_partitioned import LinearAxis

if TYPE_CHECKING:
    from ..serial import Kinematics

_known: WeakKeyDictionary[Kinematics, ClosedForm | None] = WeakKeyDictionary()


def closed_form(kinematics: Kinematics) -> ClosedForm | None:
    """Return the closed form of a robot, computed once; None if it belongs to no family."""
    if kinematics not in _known:
        robot = kinematics.robot
        depends = len(robot.moving) != robot.dof
        _known[kinematics] = None if depends else closed_form_of(arm_geometry(robot))
    return _known[kinematics]


def closed_form_of(geometry: ArmGeometry) -> ClosedForm | None:
    """Return the closed form of an arm without dependent joints; None if it has none."""
    if geometry.prismatic == (True, *(False,) * 6):
        arm = closed_form_of(geometry.without_first())
        return arm and LinearAxis(arm, geometry.axes[0])
    return wrist_partitioned.recognise(geometry) or three_parallel.recognise(geometry)
