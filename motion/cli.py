"""The command `openpendant robots`: list, show, draw, check and import robots, and try kinematics.

Owns arguments, output and exit codes, nothing else. Results go to standard output, one JSON line
for `fk` and `ik`; an error is one line on standard error.

Exit codes: 0 done, 1 a checked robot is bad, 2 a bad argument, robot name or robot file,
3 refused: the pose cannot be reached, or the robot has no such kinematics, 130 interrupted.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from .errors import (
    BadArgument,
    FrameUnknown,
    MotionError,
    NotFinite,
    RobotFileError,
    UnknownRobot,
    UnsupportedKind,
    WrongJointCount,
)
from .json_input import parse_joints, parse_pose
from .robot import ParallelRobot, SerialRobot, load_robot, robot_names, serial_robot
from .robot_arguments import (
    Angles,
    AsJson,
    Frame,
    InFrame,
    OnSide,
    Robot,
    note_out_of_range,
    one_line,
    print_json,
    to_controller,
)
from .robot_import.cli import import_robot

EXIT_BAD_ROBOT = 1
EXIT_USAGE = 2
EXIT_REFUSED = 3
EXIT_INTERRUPTED = 130

_USAGE_ERRORS = (
    BadArgument,
    FrameUnknown,
    NotFinite,
    RobotFileError,
    UnknownRobot,
    WrongJointCount,
)
# Newer typers carry their own click, older ones import it; this names its error in both.
_TyperUsageError: type[Exception] = typer.BadParameter.mro()[2]


app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="List, show, draw, check and import robots; forward and inverse kinematics by hand.",
    epilog="Exit codes: 0 done, 1 a checked robot is bad, 2 bad argument or file, 3 refused.",
)


def main(argv: Sequence[str]) -> int:
    """Run `openpendant robots` and return its exit code.

    Args:
        argv: the arguments after `robots`.
    """
    try:
        result = app(args=list(argv), prog_name="openpendant robots", standalone_mode=False)
    except _TyperUsageError as error:
        describe = getattr(error, "format_message", error.__str__)
        return _fail(describe(), EXIT_USAGE)
    except typer.Abort:
        return _fail("interrupted", EXIT_INTERRUPTED)
    except MotionError as error:
        usage = isinstance(error, _USAGE_ERRORS)
        return _fail(str(error), EXIT_USAGE if usage else EXIT_REFUSED)
    return result if isinstance(result, int) else 0


@app.command("list")
def list_robots(as_json: AsJson = False) -> None:
    """List the robots that come with the project."""
    robots = [load_robot(name) for name in robot_names()]
    if as_json:
        fields = {"name", "kind", "manufacturer", "model", "dof", "specs", "named_in"}
        print_json([robot.model_dump(mode="json", include=fields) for robot in robots])
        return
    from .robot_tables import print_list

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
) -> None:
    """Show a robot's specification, limits, DH table, home, base frame and coupling."""
    from .robot_report import VrmReport, dh_exactness, dh_frames_at_home, robot_data

    facts = load_robot(robot)
    if as_json:
        print_json(robot_data(facts, frames=frames, vrm=vrm))
        return
    from .robot_tables import print_frames, print_robot, print_vrm

    if vrm:
        report = VrmReport.of(_serial(facts))
        print_vrm(report.robot, report.table, report.home_angles, report.in_words)
        return
    print_robot(facts, dh_exactness(facts))
    if frames:
        print_frames(_serial(facts), dh_frames_at_home(_serial(facts)))


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
    from .drawing import View, draw
    from .pictures import write_picture

    facts = load_robot(robot)
    position = None if joints is None else parse_joints(joints, "--joints")
    if position is not None and isinstance(facts, SerialRobot):
        position = tuple(to_controller(facts, position, angles))
        note_out_of_range(facts, position)
    view = View(math.radians(azimuth), math.radians(elevation), perspective=not orthographic)
    target = output or Path(f"{facts.name}.svg")
    write_picture(draw(facts, position, view), target, facts.name)
    print(f"wrote {one_line(str(target))}")


@app.command()
def check(
    robots: Annotated[list[str] | None, typer.Argument(metavar="[NAME|FILE]...")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Check the project's robots.")] = False,
) -> None:
    """Check robot files and say in words what is wrong with them."""
    from .robot_check import check_robot

    names = [*(robots or ()), *(robot_names() if everything else ())]
    if not names:
        raise BadArgument("NAME|FILE", "missing", "one or more robots, or --all")
    reports = [check_robot(name) for name in names]
    for report in reports:
        print(one_line(f"{'ok ' if report.sound else 'BAD'} {report.name}"))
        for line in (*report.problems, *report.remarks):
            print(f"      {one_line(line)}")
    bad = sum(not report.sound for report in reports)
    print(f"{len(reports) - bad} of {len(reports)} robots are good")
    if bad:
        raise typer.Exit(EXIT_BAD_ROBOT)


app.command("import")(import_robot)


@app.command()
def fk(
    robot: Robot,
    joints: Annotated[str, typer.Option(help="JSON list, one value per driven joint [rad or m].")],
    frame: InFrame = Frame.BASE,
    angles: OnSide = Angles.FILE,
) -> None:
    """Print the tool's pose for joint values: position [m] and quaternion x, y, z, w."""
    facts = serial_robot(robot)
    position = to_controller(facts, parse_joints(joints, "--joints"), angles)
    note_out_of_range(facts, position)
    from .kinematics import Kinematics

    pose = Kinematics(facts).forward(position, frame)
    print_json(
        {"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist(), "frame": frame.value}
    )


@app.command()
def ik(
    robot: Robot,
    pose: Annotated[str, typer.Option(help='JSON {"xyz": [m], "quat": [x, y, z, w]}.')],
    seed: Annotated[
        str | None, typer.Option(help="JSON list to start from; the robot's home if not given.")
    ] = None,
    frame: Annotated[
        Frame | None, typer.Option(help="Frame of the pose; its own `frame`, else base.")
    ] = None,
    angles: OnSide = Angles.FILE,
    restarts: Annotated[int, typer.Option(min=0, max=10_000, help="Search budget.")] = 50,
    random_seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Same number, same answer.")
    ] = 0,
) -> None:
    """Print joint values that put the tool at a pose, inside the limits."""
    facts = serial_robot(robot)
    xyz, quaternion, named = parse_pose(pose, "--pose")
    asked = _frame(frame, named)
    start = (
        facts.home_position
        if seed is None
        else to_controller(facts, parse_joints(seed, "--seed"), angles)
    )
    from .ik import solve
    from .kinematics import Kinematics
    from .pose import Pose

    target = Pose.from_values(xyz, quaternion)
    solution = solve(
        Kinematics(facts),
        target,
        start,
        frame=asked,
        restarts=restarts,
        random_seed=random_seed,
    )
    found = tuple(solution.joint_position.tolist())
    print_json(
        {
            "joints": facts.to_model(found) if angles is Angles.FILE else found,
            "angles": angles.value,
            "frame": asked.value,
            "position_error": solution.position_error,
            "rotation_error": solution.rotation_error,
            "restarts": solution.restarts,
            "iterations": solution.iterations,
        }
    )


def _serial(robot: ParallelRobot | SerialRobot) -> SerialRobot:
    if isinstance(robot, ParallelRobot):
        raise UnsupportedKind(robot.name, robot.kind, "a DH table")
    return robot


def _frame(option: Frame | None, named: str | None) -> Frame:
    if named is None:
        return option or Frame.BASE
    if named not in list(Frame):
        raise FrameUnknown(named, tuple(Frame))
    if option is not None and option != named:
        raise BadArgument("--frame", option.value, f"the pose's own frame, {named}")
    return Frame(named)


def _fail(message: str, code: int) -> int:
    print(f"error: {one_line(message)}", file=sys.stderr)
    return code
