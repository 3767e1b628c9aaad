"""The command `openpendant robots`: list, show, draw, check and import robots, and try kinematics.

Owns arguments and output, nothing else; `import` is in `robots_import`, `home-check` in
`robots_home_check`, and `fk`, `jacobian` and `ik` in `kinematics_commands`. Results go to standard
output; an error is one line on standard error. Joint values are rad or m; of a platform they are
the lengths of its legs, which are the same on both sides.

Exit codes: 0 done, 1 a checked robot or home is bad, 2 a bad argument, robot name or robot file,
3 refused: the pose cannot be reached, or the robot has no such thing, 74 a file cannot be written,
130 interrupted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..description.robot import ParallelRobot, SerialRobot, load_robot, robot_names
from ..errors import BadArgument, UnsupportedKind
from .arguments import (
    FAULTS,
    Angles,
    AsJson,
    InDegrees,
    NamedAs,
    Names,
    OnSide,
    Robot,
    in_radians,
    names_of,
    note_out_of_range,
    parse_joints,
    tell,
    to_controller,
)
from .kinematics_commands import fk, ik, jacobian
from .robots_home_check import home_check
from .robots_import import import_robot

app = command(
    "List, show, draw, check and import robots; forward and inverse kinematics by hand.",
    "0 done, 1 a checked robot or home is bad, 2 bad argument or file, 3 refused",
)


def main(argv: Sequence[str]) -> int:
    """Run `openpendant robots` and return its exit code."""
    return run(app, "robots", argv, FAULTS, tell)


@app.command("list")
def list_robots(as_json: AsJson = False) -> None:
    """List the robots that come with the project."""
    robots = [load_robot(name) for name in robot_names()]
    if as_json:
        fields = {"name", "kind", "manufacturer", "model", "dof", "specs", "named_in"}
        emit_json([robot.model_dump(mode="json", include=fields) for robot in robots], compact=True)
        return
    from .tables import print_list

    print_list(robots)


@app.command()
def show(
    robot: Robot,
    as_json: AsJson = False,
    frames: Annotated[
        bool, typer.Option("--frames", help="Also the DH table's frames at home.")
    ] = False,
    vrm: Annotated[
        bool, typer.Option("--vrm", help="RoboAnalyzer's rows and angles of this robot.")
    ] = False,
    names: NamedAs = Names.DISPLAY,
) -> None:
    """Show a robot's specification, limits, DH table, home, base frame and coupling."""
    from ..robot_report.robot_report import VrmReport, dh_exactness, dh_frames_at_home, robot_data

    facts = load_robot(robot)
    if as_json:
        emit_json(robot_data(facts, frames=frames, vrm=vrm), compact=True)
        return
    from .tables import print_frames, print_robot, print_vrm

    called = names_of(facts, names)
    if vrm:
        report = VrmReport.of(_serial(facts))
        print_vrm(report.robot, report.table, report.home_angles, report.in_words, called)
        return
    arm = _serial(facts) if frames else None
    print_robot(facts, called, dh_exactness(facts))
    if arm is not None:
        print_frames(arm, dh_frames_at_home(arm), called)


@app.command()
def draw(
    robot: Robot,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="FILE.svg or FILE.png; NAME.svg if none.")
    ] = None,
    joints: Annotated[
        str | None, typer.Option(help="JSON list [rad or m]; the robot's home if not given.")
    ] = None,
    angles: OnSide = Angles.FILE,
    degrees: InDegrees = False,
    azimuth: Annotated[
        float, typer.Option(help="Where the camera stands, degrees from x.")
    ] = -58.0,
    elevation: Annotated[
        float, typer.Option(min=-89.0, max=89.0, help="How high it stands, degrees.")
    ] = 18.0,
    orthographic: Annotated[
        bool, typer.Option("--orthographic", help="All to scale; else perspective.")
    ] = False,
) -> None:
    """Draw a robot, so that a person can see which arm it is and how it stands."""
    from ..visuals.drawing import View, draw, write_picture

    facts = load_robot(robot)
    position = None if joints is None else parse_joints(joints, "--joints")
    if position is not None and isinstance(facts, SerialRobot):
        position = in_radians(facts.limits, position, degrees)
        position = tuple(to_controller(facts, position, angles))
        note_out_of_range(facts.limits, position)
    view = View(math.radians(azimuth), math.radians(elevation), perspective=not orthographic)
    target = output or Path(f"{facts.name}.svg")
    write_picture(draw(facts, position, view), target, facts.name)
    print(f"wrote {one_line(str(target), ' ')}")


@app.command()
def check(
    robots: Annotated[list[str] | None, typer.Argument(metavar="[NAME|FILE]...")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Check the project's robots.")] = False,
) -> None:
    """Check robot files and say in words what is wrong with them."""
    from ..robot_report.robot_check import check_robot

    names = [*(robots or ()), *(robot_names() if everything else ())]
    if not names:
        raise BadArgument("NAME|FILE", "missing", "one or more robots, or --all")
    reports = [check_robot(name) for name in names]
    for report in reports:
        print(one_line(f"{'ok ' if report.sound else 'BAD'} {report.name}", " "))
        for line in (*report.problems, *report.remarks):
            print(f"      {one_line(line, ' ')}")
    bad = sum(not report.sound for report in reports)
    print(f"{len(reports) - bad} of {len(reports)} robots are good")
    if bad:
        raise typer.Exit(ExitCode.FAILED)


app.command("home-check")(home_check)
app.command("import")(import_robot)


app.command("fk")(fk)
app.command("jacobian")(jacobian)
app.command("ik")(ik)


def _serial(robot: ParallelRobot | SerialRobot) -> SerialRobot:
    if isinstance(robot, ParallelRobot):
        raise UnsupportedKind(robot.name, robot.kind, "DH table")
    return robot
