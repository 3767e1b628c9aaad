"""Joint slots: the ten joint values of a message, read for one robot.

Owns the rule that slots the robot does not have are zero, and the rule of 4-byte reals: a target
exactly on a limit may arrive rounded beyond it and is then taken as the limit, so that everything
after this module can compare exactly. A value too small for a normal 4-byte real is 0. Vectors are
controller side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from openpendant.motion.description.limits import JointLimits, without_rounding
from openpendant.motion.errors import MotionError
from openpendant.motion.pose import Array
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal, refusal_of

_SMALLEST = 2.0**-126
"""The smallest normal 4-byte real (IEEE 754)."""


class JointSlots:
    """The slots of one robot's messages."""

    def __init__(self, limits: JointLimits) -> None:
        """Make a reader for the robot with these limits."""
        self._limits = limits
        self._rounded = limits.as_float32()
        # For a table of positions: the same bounds as arrays.
        self._lower, self._upper = np.array(limits.lower), np.array(limits.upper)
        self._least = np.array(self._rounded.lower)
        self._greatest = np.array(self._rounded.upper)

    def position(self, slots: Sequence[float]) -> tuple[float, ...] | Refusal:
        """Return the (n,) joint position in ten slots [rad or m], or why there is none."""
        limits, dof = self._limits, self._limits.dof
        for index, value in enumerate(slots):
            if not math.isfinite(value):
                text = f"joint slot {index + 1} is not a finite number"
                return Refusal(VerdictCode.NOT_FINITE, text, index)
            if index >= dof and value != 0:
                text = f"slot {index + 1} is {value:g}; the robot has {dof} joints"
                return Refusal(VerdictCode.WRONG_JOINT_COUNT, text, index, value, float(dof))
        used = (0.0 if abs(value) < _SMALLEST else value for value in slots[:dof])
        position = without_rounding(tuple(used), limits, self._rounded)
        try:
            limits.check_position(position)
        except MotionError as error:
            return refusal_of(error)
        return position

    def positions(self, slots: Array) -> Array | Refusal:
        """Return the (m, n) joint positions in (m, 10) slots, or why the first that is none is not.

        For many what `position` is for one, at a hundredth of its cost.
        """
        dof, lower, upper = self._limits.dof, self._lower, self._upper
        used = slots[:, :dof]
        with np.errstate(invalid="ignore"):
            found = np.where(np.abs(used) < _SMALLEST, 0.0, used)
            found = np.where((found > upper) & (found <= self._greatest), upper, found)
            found = np.where((found < lower) & (found >= self._least), lower, found)
            is_sound = ((found >= lower) & (found <= upper)).all(axis=1)
        is_sound &= np.isfinite(slots).all(axis=1) & (slots[:, dof:] == 0.0).all(axis=1)
        if is_sound.all():
            return found
        refusal = self.position(slots[int(np.argmin(is_sound))].tolist())
        assert isinstance(refusal, Refusal), "one position is judged as many are"
        return refusal

    def count_fault(self, joint_count: int) -> Refusal | None:
        """Return why a message that means so many joints is not for this robot.

        Empty slots are zeros, so a list that is too short looks like a target; only its sender can
        tell, and says so in the count.
        """
        dof = self._limits.dof
        if joint_count == dof:
            return None
        text = f"{joint_count} joint values; the robot has {dof} driven joints"
        return Refusal(
            VerdictCode.WRONG_JOINT_COUNT, text, value=float(joint_count), limit=float(dof)
        )

    def velocity_fault(self, slots: Sequence[float]) -> Refusal | None:
        """Return why ten slots hold no joint velocity that the robot may have."""
        try:
            self._rounded.check_velocity(slots[: self._limits.dof])
        except MotionError as error:
            return refusal_of(error)
        return None

    def acceleration_fault(self, slots: Sequence[float]) -> Refusal | None:
        """Return why ten slots hold no joint acceleration; its size is the planner's business."""
        try:
            self._limits.check_finite(slots[: self._limits.dof], "the joint acceleration")
        except MotionError as error:
            return refusal_of(error)
        return None
