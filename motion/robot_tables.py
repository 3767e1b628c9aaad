"""Robots as tables on a terminal.

Owns the layout, and the change to degrees and millimetres that only screens make. The only module
of its folder that imports rich.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from .robot import ParallelRobot, Robot, SerialRobot
from .robot_schema import CouplingType, DhTable, Variable

_PIPED_WIDTH = 140


def print_list(robots: Iterable[Robot]) -> None:
    """Print one line per robot."""
    table = _table("name", "manufacturer", "model", "kind", "axes", "payload kg", "reach mm")
    for robot in robots:
        table.add_row(
            *_texts(
                robot.name,
                robot.manufacturer,
                robot.model,
                robot.kind,
                str(robot.dof),
                _known(robot.specs.payload_kg),
                _known(robot.specs.reach_m, 1000.0),
            )
        )
    _console().print(table)


def print_robot(robot: Robot) -> None:
    """Print a robot's specification, limits, DH table, home and coupling."""
    console = _console()
    console.print(Text(f"{robot.name}: {robot.manufacturer} {robot.model}"), style="bold")
    console.print(_facts(robot))
    if isinstance(robot, ParallelRobot):
        console.print(_legs(robot))
    else:
        console.print(_limits(robot))
        if robot.dh is not None:
            console.print(_dh(robot.dh))
    for note in robot.notes:
        console.print(Text(f"note: {note}"))


def _facts(robot: Robot) -> Table:
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
    ]
    if isinstance(robot, SerialRobot):
        x, y, z = (f"{1000.0 * value:g}" for value in robot.base_frame.xyz)
        roll, pitch, yaw = (f"{math.degrees(value):g}" for value in robot.base_frame.rpy)
        rows.append(
            (
                "base frame",
                f"{x}, {y}, {z} mm; roll {roll}°, pitch {pitch}°, yaw {yaw}°"
                f" in {robot.base_frame.parent}",
            )
        )
        rows.append(("coupling", _coupling(robot)))
    for label, value in rows:
        table.add_row(*_texts(label, value))
    return table


def _coupling(robot: SerialRobot) -> str:
    if robot.coupling.type is CouplingType.NONE:
        return "none"
    second, third = robot.driven[1].name, robot.driven[2].name
    sign = "-" if robot.coupling.state_factor > 0 else "+"
    return f"controller's {third} = the file's {third} {sign} {second}"


def _limits(robot: SerialRobot) -> Table:
    table = _table(
        "joint", "least", "greatest", "speed /s", "acceleration /s²", "home", "home, file"
    )
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
        table.add_row(*_texts(name, *(f"{value * scale:.2f}{unit}" for value in values)))
    return table


def _dh(dh: DhTable) -> Table:
    table = _table("joint", "theta", "d mm", "a mm", "alpha")
    table.title = "DH table, standard, the file's angles"
    for row in dh.rows:
        theta, d = f"{math.degrees(row.theta_offset):.4g}°", f"{1000.0 * row.d:.6g}"
        if row.variable is Variable.THETA:
            theta = f"q + {theta}"
        else:
            d = f"q + {d}"
        table.add_row(
            *_texts(row.joint, theta, d, f"{1000.0 * row.a:.6g}", f"{math.degrees(row.alpha):.4g}°")
        )
    return table


def _legs(robot: ParallelRobot) -> Table:
    table = _table("leg", "least mm", "greatest mm", "home mm", "speed mm/s")
    lengths = (
        robot.leg.min_length,
        robot.leg.max_length,
        robot.leg.home_length,
        robot.leg.velocity,
    )
    for name in robot.joint_names:
        table.add_row(*_texts(name, *(f"{1000.0 * value:g}" for value in lengths)))
    return table


def _table(*columns: str) -> Table:
    table = Table(title_justify="left")
    for column in columns:
        table.add_column(column)
    return table


def _texts(*values: str) -> list[Text]:
    # A Text takes no markup, so a name in a file cannot style or break the table.
    return [Text("".join(c if c.isprintable() else " " for c in value)) for value in values]


def _known(value: float | None, scale: float = 1.0) -> str:
    return "unknown" if value is None else f"{value * scale:g}"


def _console() -> Console:
    return Console(width=None if sys.stdout.isatty() else _PIPED_WIDTH, highlight=False)
