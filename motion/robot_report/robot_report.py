"""Robot report: the data of `robots show` beyond the robot file, such as frames and residuals.

Owns the machine-readable form of a robot's specification page. Layout is `tables`'.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..description.robot import Robot, SerialRobot
from ..description.schema import Dependence, DhTable, Vrm
from ..errors import BadArgument, UnsupportedKind
from ..kinematics.dh import dh_difference, dh_frames, vrm_angles, vrm_difference, vrm_of
from ..pose import Pose


@dataclass(frozen=True, slots=True)
class VrmReport:
    """Robot in RoboAnalyzer's rows: its angles at our home [rad], and the residuals."""

    robot: SerialRobot
    table: Vrm
    home_angles: tuple[float, ...]
    position_difference: float  # m
    rotation_difference: float  # rad

    @classmethod
    def of(cls, robot: SerialRobot) -> VrmReport:
        """Return the report of a robot; `BadArgument` if it is not of the Virtual Robot Module."""
        table, difference = vrm_of(robot), vrm_difference(robot)
        angles = vrm_angles(table, moving_at_home(robot))
        return cls(robot, table, angles, difference.position, difference.rotation)

    @property
    def in_words(self) -> str:
        """Difference of the two forward kinematics, in words."""
        stated = self.table.fk_difference
        return (
            f"{self.position_difference:.2g} m and {self.rotation_difference:.2g} rad apart at most"
            f" over random positions; the robot file says {stated.position_m:g} m and"
            f" {stated.rotation_rad:g} rad"
        )

    def as_data(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {
            "name": self.table.name,
            "rows": [row.model_dump(mode="json") for row in self.table.rows],
            "map": self.table.map.model_dump(mode="json"),
            "angles_at_home": list(self.home_angles),
            "position_difference": self.position_difference,
            "rotation_difference": self.rotation_difference,
        }


def moving_at_home(robot: SerialRobot) -> tuple[float, ...]:
    """Return the chain-side position of every moving joint at home, dependent ones included."""
    known = {joint.name: value for joint, value in zip(robot.driven, robot.home, strict=True)}

    def value(dependence: Dependence) -> float:
        terms = (term.gain * known[term.joint] for term in dependence.terms)
        return dependence.offset + sum(terms)

    return tuple(
        known[joint.name] if joint.dependent is None else value(joint.dependent)
        for joint in robot.moving
    )


def dh_frames_at_home(robot: SerialRobot) -> tuple[Pose, ...]:
    """Return the DH frames at home in the root link's frame; `BadArgument` without a table."""
    return dh_frames(_table(robot), moving_at_home(robot))


def dh_exactness(robot: Robot) -> str:
    """Return the difference of a robot's DH table from its joints, in words."""
    if not isinstance(robot, SerialRobot) or robot.dh is None:
        return ""
    try:
        residual = dh_difference(robot)
    except ModuleNotFoundError:
        return "not compared; that needs the extra 'server'"
    assert residual is not None
    return f"{residual.position:.1e} m and {residual.rotation:.1e} rad apart at most"


def vrm_differences(robot: Robot) -> tuple[str, ...]:
    """Return in words where RoboAnalyzer's payload and weight are not ours."""
    if not isinstance(robot, SerialRobot) or robot.vrm is None:
        return ()
    pairs = (
        ("payload", robot.specs.payload_kg, robot.vrm.payload_kg),
        ("weight", robot.specs.mass_kg, robot.vrm.weight_kg),
    )
    return tuple(
        f"{what} {theirs:g} kg, ours {'unknown' if ours is None else f'{ours:g} kg'}"
        for what, ours, theirs in pairs
        if theirs is not None and theirs != ours
    )


def robot_data(robot: Robot, *, frames: bool = False, vrm: bool = False) -> dict[str, Any]:
    """Return a robot's specification page as JSON can hold it: SI units, radians.

    Raises:
        UnsupportedKind: frames or VRM rows are asked for of a parallel robot.
        BadArgument: they are asked for of a robot without them.
    """
    # Its meshes are told by `shapes_report`.
    facts = robot.model_dump(mode="json", by_alias=True, exclude={"meshes"})
    data: dict[str, Any] = {"facts": facts}
    if isinstance(robot, SerialRobot):
        if robot.vrm is not None:
            data["facts"]["specs"]["vrm"] = {
                "payload_kg": robot.vrm.payload_kg,
                "weight_kg": robot.vrm.weight_kg,
                "differences": list(vrm_differences(robot)),
            }
        limits = robot.limits
        data["limits"] = {
            "names": limits.names,
            "display_names": robot.display_names,
            "lower": limits.lower,
            "upper": limits.upper,
            "velocity": limits.velocity,
            "acceleration": limits.acceleration,
        }
        data["home_position"] = robot.home_position
        if frames:
            data["dh_frames"] = [
                {"xyz": frame.position.tolist(), "quat": frame.quaternion.tolist()}
                for frame in dh_frames_at_home(robot)
            ]
        if vrm:
            data["vrm"] = VrmReport.of(robot).as_data()
    elif frames or vrm:
        raise UnsupportedKind(robot.name, robot.kind, "DH table")
    return data


def _table(robot: SerialRobot) -> DhTable:
    if robot.dh is None:
        raise BadArgument("robot", robot.name, "a robot whose file has a DH table")
    return robot.dh
