"""Robots as tables on a terminal.

Owns what stands in each table, and the change to degrees and millimetres that only screens make;
`table_layout` owns how a table gives way to a narrow window.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from openpendant.tools.console import cells, terminal
from openpendant.tools.console import table as console_table

from ..description.robot import ParallelRobot, Robot, SerialRobot
from ..description.schema import CouplingType, DhTable, Variable, Vrm
from ..pose import Array, Pose
from ..robot_report.robot_report import vrm_differences
from .table_layout import print_table

if TYPE_CHECKING:
    from ..robot_report.home_check import HomeReport

_ALONG = 1e-9


def print_list(robots: Iterable[Robot]) -> None:
    """Print one line per robot."""
    table = console_table("name", "manufacturer", "model", "kind", "axes", "payload kg", "reach mm")
    for robot in robots:
        table.add_row(
            *cells(
                robot.name,
                robot.manufacturer,
                robot.model,
                robot.kind,
                str(robot.dof),
                _known(robot.specs.payload_kg),
                _known(robot.specs.reach_m, 1000.0),
            )
        )
    print_table(table)


def print_robot(robot: Robot, called: Mapping[str, str], dh_exactness: str = "") -> None:
    """Print a robot's specification, limits, home, coupling and DH table, with its exactness.

    Args:
        called: what each driven joint is called, by its name in the robot file.
    """
    console = terminal()
    console.print(Text(f"{robot.name}: {robot.manufacturer} {robot.model}"), style="bold")
    console.print(_facts(robot, called))
    if isinstance(robot, ParallelRobot):
        print_table(_legs(robot), console)
    else:
        print_table(_limits(robot, called), console)
        if robot.dh is not None:
            print_table(_dh(robot.dh, called), console)
            if dh_exactness:
                console.print(Text(f"DH table and joints: {dh_exactness}"))
    for note in robot.notes:
        console.print(Text(f"note: {note}"))


def print_frames(robot: SerialRobot, frames: Sequence[Pose], called: Mapping[str, str]) -> None:
    """Print where the DH table's frames are at home, in the root link's frame."""
    table = console_table("frame", "on joint", "x mm", "y mm", "z mm", "x axis", "y axis", "z axis")
    table.title = f"DH frames at home, in {robot.root_link}"
    joints = [*(called.get(joint.name, joint.name) for joint in robot.moving), "tool side"]
    for index, (frame, joint) in enumerate(zip(frames, joints, strict=True)):
        origin = (_rounded(1000.0 * value) for value in frame.position)
        axes = (_direction(frame.rotation[:, axis]) for axis in range(3))
        table.add_row(*cells(str(index), joint, *origin, *axes))
    print_table(table)


def print_homes(
    reports: Sequence[HomeReport],
    homes: Sequence[Sequence[float]],
    prismatic: Sequence[Sequence[bool]],
) -> None:
    """Print one line per home: the increments accepted of those possible, and how it stands.

    Args:
        homes: (n,) home of each robot as in its file [rad or m]; empty for a platform.
        prismatic: True for each of these values that is in m.
    """
    table = console_table("robot", "home", "base", "tool", "condition", "tool at mm", "home is")
    for report, home, in_metres in zip(reports, homes, prismatic, strict=True):
        values = (
            f"{1000.0 * value:z.4g} mm" if metres else f"{math.degrees(value):z.4g}"
            for value, metres in zip(home, in_metres, strict=True)
        )
        place = () if report.pose is None else report.pose.position
        table.add_row(
            *cells(
                report.robot,
                " ".join(values) or "platform",
                *(f"{report.accepted(each)}/{report.possible(each)}" for each in ("base", "tool")),
                "∞" if math.isinf(report.condition) else f"{report.condition:.1f}",
                " ".join(f"{1000.0 * value:z.0f}" for value in place),
                "good" if report.is_good else "BAD",
            )
        )
    print_table(table)


def print_vrm(
    robot: SerialRobot,
    vrm: Vrm,
    angles: Sequence[float],
    difference: str,
    called: Mapping[str, str],
) -> None:
    """Print RoboAnalyzer's rows and its angles at our home.

    Args:
        angles: the table's angles at our home [rad].
        difference: difference of its forward kinematics from ours, in words.
        called: what each driven joint is called, by its name in the robot file.
    """
    table = console_table(
        "joint", "b mm", "theta", "a mm", "alpha", "least", "greatest", "theta at home"
    )
    table.title = f"{vrm.name} in RoboAnalyzer's Virtual Robot Module, its letters and angles"
    for joint, row, sign, offset, angle in zip(
        robot.moving, vrm.rows, vrm.map.sign, vrm.map.offset, angles, strict=True
    ):
        theta = f"{'-' if sign < 0 else ''}q + {math.degrees(offset):z.4g}°"
        degrees = (f"{math.degrees(value):z.2f}°" for value in (row.lower, row.upper, angle))
        table.add_row(
            *cells(
                called.get(joint.name, joint.name),
                f"{1000.0 * row.b:z.6g}",
                theta,
                f"{1000.0 * row.a:z.6g}",
                f"{math.degrees(row.alpha):z.4g}°",
                *degrees,
            )
        )
    console = terminal()
    print_table(table, console)
    console.print(Text(f"its tool pose and ours: {difference}"))


def _direction(axis: Array) -> str:
    """Return a (3,) unit vector in words: a letter if it lies along an axis of the root link."""
    for index, letter in enumerate("xyz"):
        if abs(abs(float(axis[index])) - 1.0) < _ALONG:
            return f"{'-' if axis[index] < 0.0 else '+'}{letter}"
    return " ".join(_rounded(value) for value in axis)


def _rounded(value: float) -> str:
    return f"{float(value):z.3f}"


def _facts(robot: Robot, called: Mapping[str, str]) -> Table:
    """Return kind, specification, conventions and base frame; mm and degrees."""
    table = Table(show_header=False, box=None)
    specs = robot.specs
    rows = [
        ("kind", f"{robot.kind}, {robot.dof} driven axes"),
        ("payload", f"{_known(specs.payload_kg)} kg"),
        ("reach", f"{_known(specs.reach_m, 1000.0)} mm"),
        ("repeatability", f"{_known(specs.repeatability_m, 1000.0)} mm"),
        ("mass", f"{_known(specs.mass_kg)} kg"),
        ("tool", robot.tool_convention or robot.tool_link),
        ("zero pose", robot.zero_pose or "not described"),
        *(("RoboAnalyzer", difference) for difference in vrm_differences(robot)),
    ]
    if isinstance(robot, SerialRobot):
        x, y, z = (f"{1000.0 * value:zg}" for value in robot.base_frame.xyz)
        roll, pitch, yaw = (f"{math.degrees(value):zg}" for value in robot.base_frame.rpy)
        rows.append(
            (
                "base frame",
                f"{x}, {y}, {z} mm; roll {roll}°, pitch {pitch}°, yaw {yaw}°"
                f" in {robot.base_frame.parent}",
            )
        )
        rows.append(("coupling", _coupling(robot, called)))
    for label, value in rows:
        table.add_row(*cells(label, value))
    return table


def _coupling(robot: SerialRobot, called: Mapping[str, str]) -> str:
    if robot.coupling.type is CouplingType.NONE:
        return "none"
    second, third = (called[joint.name] for joint in robot.driven[1:3])
    sign = "-" if robot.coupling.state_factor > 0 else "+"
    rule = f"controller's {third} = the file's {third} {sign} {second}"
    return f"{rule}; rates and accelerations likewise"


def _limits(robot: SerialRobot, called: Mapping[str, str]) -> Table:
    """Return range, speed, acceleration and home of each driven joint; degrees or mm, and s."""
    columns = ("least", "greatest", "speed /s", "acceleration /s²", "home", "home, file")
    table = console_table("joint", *columns)
    table.title = "Limits, controller's angles"
    limits = robot.limits
    for index, name in enumerate(limits.names):
        scale, unit = (1000.0, " mm") if limits.prismatic[index] else (180.0 / math.pi, "°")
        values = (
            limits.lower[index],
            limits.upper[index],
            limits.velocity[index],
            limits.acceleration[index],
            robot.home_position[index],
            robot.home[index],
        )
        shown = (f"{value * scale:z.2f}{unit}" for value in values)
        table.add_row(*cells(called[name], *shown))
    return table


def _dh(dh: DhTable, called: Mapping[str, str]) -> Table:
    """Return the standard Denavit-Hartenberg rows: Rz(theta) Tz(d) Tx(a) Rx(alpha), as in `dh`."""
    table = console_table("joint", "theta", "d mm", "a mm", "alpha")
    table.title = "DH table, standard, the file's angles"
    for row in dh.rows:
        theta, d = f"{math.degrees(row.theta_offset):z.4g}°", f"{1000.0 * row.d:z.6g}"
        if row.variable is Variable.THETA:
            theta = f"q + {theta}"
        else:
            d = f"q + {d}"
        table.add_row(
            *cells(
                called.get(row.joint, row.joint),
                theta,
                d,
                f"{1000.0 * row.a:z.6g}",
                f"{math.degrees(row.alpha):z.4g}°",
            )
        )
    return table


def _legs(robot: ParallelRobot) -> Table:
    """Return the legs of a platform, which are all alike [mm]."""
    table = console_table("leg", "least mm", "greatest mm", "home mm", "speed mm/s")
    lengths = (
        robot.leg.min_length,
        robot.leg.max_length,
        robot.leg.home_length,
        robot.leg.velocity,
    )
    for name in robot.joint_names:
        table.add_row(*cells(name, *(f"{1000.0 * value:zg}" for value in lengths)))
    return table


def _known(value: float | None, scale: float = 1.0) -> str:
    return "unknown" if value is None else f"{value * scale:g}"
