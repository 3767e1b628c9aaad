"""Kinematics on a terminal: poses as blocks to copy, Jacobians and answers as tables.

Owns the rounding of what a person reads: 1e-6 degrees and 1e-4 mm, so that 89.99999999999999 is 90.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text

from openpendant.tools.console import cells, terminal
from openpendant.tools.console import table as console_table

from ..description.limits import JointLimits
from .table_layout import print_table

_DEGREES, _MILLIMETRES, _UNITLESS = 6, 4, 9
"""Decimals."""

_TWIST = ("vx", "vy", "vz", "ωx", "ωy", "ωz")


def degrees(angle: float) -> str:
    """Return an angle [rad] in degrees."""
    return _plain(math.degrees(angle), _DEGREES)


def millimetres(length: float) -> str:
    """Return a length [m] in mm."""
    return _plain(1e3 * length, _MILLIMETRES)


def _plain(value: float, decimals: int) -> str:
    """Return a number rounded, without zeros at its end and without a sign in front of a zero."""
    text = f"{value:z.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def print_pose(
    title: str, told: Mapping[str, Any], form: str, configuration: Mapping[str, Any] | None
) -> None:
    """Print a pose in one form (`matrix`, `rpy`, `quat`) or in all; lines that can be copied.

    Args:
        told: as `kinematics_report.pose_report` returns it.
    """
    lines = [title, *_position(told)]
    if form in ("matrix", "all"):
        lines += ["matrix, lengths in m", *_matrix(told["matrix"])]
    if form in ("rpy", "all"):
        roll, pitch, yaw = map(degrees, told["rpy"])
        unique = "" if told["rpy_unique"] else "  (pitch ±90°: roll is 0 by convention)"
        lines.append(f"roll {roll}  pitch {pitch}  yaw {yaw} deg{unique}")
    if form in ("quat", "all"):
        lines.append("quaternion x y z w  " + _list(told["orientation"]))
    if form == "all":
        lines.append("rotation vector, rad  " + _list(told["axis_angle"]))
    if form == "all" and configuration is not None:
        lines.append(f"configuration {_posture(configuration)}, turns {_turns(configuration)}")
    # Not through a console, which would break the lines of a matrix where a window is narrow.
    print("\n".join(lines))


def _position(told: Mapping[str, Any]) -> list[str]:
    x, y, z = map(millimetres, told["position"])
    return [f"x {x}  y {y}  z {z} mm"]


def _matrix(rows: Sequence[Sequence[float]]) -> list[str]:
    shown = [[f"{value:z.{_UNITLESS}f}" for value in row] for row in rows]
    width = max(len(text) for row in shown for text in row)
    body = ["[" + ", ".join(text.rjust(width) for text in row) + "]" for row in shown]
    last = len(body) - 1
    return [
        f"{'[' if number == 0 else ' '}{row}{']' if number == last else ','}"
        for number, row in enumerate(body)
    ]


def _list(values: Sequence[float]) -> str:
    return "[" + ", ".join(_plain(value, _UNITLESS) for value in values) + "]"


def _posture(configuration: Mapping[str, Any]) -> str:
    return " ".join(configuration[name] for name in ("shoulder", "elbow", "wrist"))


def _turns(configuration: Mapping[str, Any]) -> str:
    return " ".join(map(str, configuration["turns"] or ())) or "any"


def print_jacobian(title: str, told: Mapping[str, Any], called: Sequence[str]) -> None:
    """Print a Jacobian with a column for each joint, and how near it is to losing rank.

    Args:
        told: as `kinematics_report.jacobian_report` returns it.
    """
    table = console_table("", *called)
    table.title = title
    for name, row in zip(_TWIST, told["jacobian"], strict=True):
        table.add_row(*cells(name, *(_plain(value, _DEGREES) for value in row)))
    console = terminal()
    print_table(table, console)
    nearest = told["nearest_singularity"]
    match nearest["unit"]:
        case "rad":
            away = f"{degrees(nearest['distance'])}° away"
        case "m":
            away = f"{millimetres(nearest['distance'])} mm away"
        case _:
            away = f"least singular value {nearest['distance']:.4g}"
    joints = ", ".join(called[joint] for joint in nearest["joints"])
    condition = "infinite" if told["condition"] is None else f"{told['condition']:.4g}"
    for line in (
        "rows: linear velocity of the tool centre point, then angular; columns: a joint each",
        f"condition {condition}, manipulability {told['manipulability']:.4g}"
        f" (lengths divided by {millimetres(told['size'])} mm)",
        f"nearest singularity: {nearest['kind']}, {away}; joints {joints}",
    ):
        console.print(Text(line))


def print_answers(
    title: str,
    told: Sequence[Mapping[str, Any]],
    shown: Sequence[Sequence[float]],
    called: Sequence[str],
    limits: JointLimits,
) -> None:
    """Print the answers of inverse kinematics, a row each, with the configuration.

    Args:
        told: as `kinematics_report.inverse_report` returns them.
        shown: the joints of each, on the side that was asked for [rad or m].
    """
    units = ["mm" if slides else "°" for slides in limits.prismatic]
    heads = [f"{name} {unit}" for name, unit in zip(called, units, strict=True)]
    table = console_table("branch", *heads, "configuration", "nearest limit", "touches")
    table.title = title
    for answer, joints in zip(told, shown, strict=True):
        values = [
            millimetres(value) if slides else degrees(value)
            for value, slides in zip(joints, limits.prismatic, strict=True)
        ]
        flags = answer["configuration"]
        posture = (
            ""
            if flags is None
            else " ".join(flags[name] for name in ("shoulder", "elbow", "wrist"))
        )
        nearest, contact = answer["nearest_limit"], answer["touches"]
        joint, margin = nearest["joint"], nearest["margin"]
        free = millimetres(margin) if limits.prismatic[joint] else degrees(margin)
        table.add_row(
            *cells(
                str(answer["branch"]),
                *values,
                posture,
                f"{called[joint]}, {free} {units[joint]}",
                "" if contact is None else " and ".join(contact),
            )
        )
    print_table(table)


def print_legs(title: str, lengths: Sequence[float], called: Sequence[str]) -> None:
    """Print the one answer of a platform, the length of each leg [m]."""
    table = console_table("leg", "mm")
    table.title = title
    for name, length in zip(called, lengths, strict=True):
        table.add_row(*cells(name, millimetres(length)))
    print_table(table)
