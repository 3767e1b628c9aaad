"""What inverse kinematics works out once for each robot.

Owns that nothing of it is worked out twice: closed form and choice among its branches, ranges and
turns, the direction that a tool keeps, the bound of its reach.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

from .branch_choice import BranchChoice
from .closed_form import ClosedForm, closed_form
from .kinematics import Kinematics
from .reach_bound import ReachBound, reach_bound
from .reduced_task import KeptDirection, kept_direction
from .turns import JointRanges


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """A robot as inverse kinematics sees it.

    Attributes:
        form: its closed form, None without one.
        choice: what chooses among the form's branches, None without one.
        ranges: limits and turns of the joints.
        kept: the direction that the tool keeps, None for an arm that can turn it any way.
        reach: holds every place of the tool.
    """

    form: ClosedForm | None
    choice: BranchChoice | None
    ranges: JointRanges
    kept: KeptDirection | None
    reach: ReachBound


_arms: WeakKeyDictionary[Kinematics, Arm] = WeakKeyDictionary()


def arm_of(kinematics: Kinematics) -> Arm:
    """Return what is known of a robot; worked out at the first question."""
    arm = _arms.get(kinematics)
    if arm is None:
        form, ranges = closed_form(kinematics), JointRanges(kinematics)
        choice = None if form is None else BranchChoice(kinematics, form, ranges)
        arm = Arm(form, choice, ranges, kept_direction(kinematics), reach_bound(kinematics))
        _arms[kinematics] = arm
    return arm
