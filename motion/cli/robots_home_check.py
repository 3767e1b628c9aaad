"""The command `openpendant robots home-check`: can the tool be jogged any way from home?

Owns arguments and output; what is tried is `home_check`'s. Results go to standard output; exit code
1 says that a home fails.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.tools.console import ExitCode, emit_json, one_line

from ..description.robot import SerialRobot, load_robot, robot_names
from ..errors import BadArgument
from .arguments import AsJson

if TYPE_CHECKING:
    from ..robot_report.home_check import HomeReport


def home_check(
    robots: Annotated[list[str] | None, typer.Argument(metavar="[NAME|FILE]...")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Check the project's robots.")] = False,
    as_json: AsJson = False,
) -> None:
    """Try the 24 first increments of the tool from home: 10 mm and 5° in base and tool.

    Each goes through the line planner, the check of self-collision and the limit certificate.
    """
    from ..robot_report.home_check import check_home

    names = [*(robots or ()), *(robot_names() if everything else ())]
    if not names:
        raise BadArgument("NAME|FILE", "missing", "one or more robots, or --all")
    facts = [load_robot(name) for name in names]
    reports = [check_home(robot) for robot in facts]
    if as_json:
        emit_json([_data(report) for report in reports], compact=True)
    else:
        from .tables import print_homes

        homes = [robot.home if isinstance(robot, SerialRobot) else () for robot in facts]
        prismatic = [
            robot.limits.prismatic if isinstance(robot, SerialRobot) else () for robot in facts
        ]
        print_homes(reports, homes, prismatic)
        for report in reports:
            for text in problems(report):
                print(one_line(f"{report.robot}: {text}", " "))
        good = sum(report.is_good for report in reports)
        print(f"{good} of {len(reports)} homes are good")
    if not all(report.is_good for report in reports):
        raise typer.Exit(ExitCode.FAILED)


def problems(report: HomeReport) -> list[str]:
    """Return in words why a home is not good; nothing if it is."""
    if report.outside is not None:
        return [str(report.outside)]
    if report.contact is not None:
        return [f"{report.contact.first} and {report.contact.second} touch"]
    return [
        f"{each.increment.label} of {each.increment.frame}: {each.error}" for each in report.refused
    ]


def _data(report: HomeReport) -> dict[str, Any]:
    """Return a report as JSON can hold it; a singular condition is null."""
    frames = ("base", "tool")
    pose = report.pose
    return {
        "robot": report.robot,
        "good": report.is_good,
        "position": list(report.position),
        "condition": report.condition if math.isfinite(report.condition) else None,
        "xyz": None if pose is None else pose.position.tolist(),
        "quat": None if pose is None else pose.quaternion.tolist(),
        "accepted": {frame: report.accepted(frame) for frame in frames},
        "possible": {frame: report.possible(frame) for frame in frames},
        "problems": problems(report),
    }
