"""Checking a robot file in words, before anyone moves the robot.

Owns what a file is compared with beyond its own rules: the chain's forward kinematics against its
Denavit–Hartenberg table, and the room left at home. Returns findings as data; prints nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .dh import dh_forward
from .errors import RobotFileError
from .robot import ParallelRobot, Robot, SerialRobot, load_robot

DH_TOLERANCE = 1e-9  # m and rad
_DH_SAMPLES = 50


@dataclass(frozen=True, slots=True)
class CheckReport:
    """What a check found: `problems` make a robot unusable, `remarks` do not."""

    name: str
    problems: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def sound(self) -> bool:
        """Whether the robot can be used."""
        return not self.problems


def check_robot(name_or_path: str | Path) -> CheckReport:
    """Check a robot of the project, or any robot file.

    Raises:
        UnknownRobot: the name is no robot's and no file's.
    """
    try:
        robot = load_robot(name_or_path)
    except RobotFileError as error:
        found = (f"{field}: {problem}" if field else problem for field, problem in error.problems)
        return CheckReport(str(name_or_path), tuple(found))
    remarks = [*_name_remarks(robot, Path(name_or_path))]
    if isinstance(robot, ParallelRobot):
        remarks.append("parallel robot: geometry is consistent, no kinematics to compare")
        return CheckReport(robot.name, (), tuple(remarks))
    problems = _dh_problems(robot, remarks)
    remarks.append(_room_at_home(robot))
    return CheckReport(robot.name, problems, tuple(remarks))


def _name_remarks(robot: Robot, path: Path) -> list[str]:
    if path.stem == robot.name:
        return []
    return [f"name: is {robot.name!r}, the file is called {path.name!r}"]


def _dh_problems(robot: SerialRobot, remarks: list[str]) -> tuple[str, ...]:
    if robot.dh is None:
        remarks.append("dh: no table, so the chain has nothing to be compared with")
        return ()
    # Imported here, since listing and showing robots must not wait for pinocchio.
    from .kinematics import Kinematics, model_map

    kinematics = Kinematics(robot)
    gain, offset = model_map(robot)
    random = np.random.default_rng(0)
    worst_position = worst_rotation = 0.0
    for _ in range(_DH_SAMPLES):
        position = random.uniform(kinematics.lower, kinematics.upper)
        by_chain = kinematics.forward(position, "root")
        by_table = dh_forward(robot.dh, (gain @ position + offset).tolist())
        worst_position = max(worst_position, by_chain.position_distance(by_table))
        worst_rotation = max(worst_rotation, by_chain.rotation_distance(by_table))
    verdict = f"{worst_position:.1e} m and {worst_rotation:.1e} rad over {_DH_SAMPLES} positions"
    if max(worst_position, worst_rotation) > DH_TOLERANCE:
        return (f"dh: the table and the joints differ by {verdict}; accepted: {DH_TOLERANCE:.0e}",)
    remarks.append(f"dh: the table and the joints agree to {verdict}")
    return ()


def _room_at_home(robot: SerialRobot) -> str:
    limits = robot.limits
    fractions = [
        min(value - lower, upper - value) / (upper - lower)
        for value, lower, upper in zip(robot.home_position, limits.lower, limits.upper, strict=True)
    ]
    index = fractions.index(min(fractions))
    return (
        f"home: inside all limits; {limits.names[index]} is nearest to a bound,"
        f" {fractions[index]:.0%} of its range away"
    )
