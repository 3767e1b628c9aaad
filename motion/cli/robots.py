"""The command `openpendant robots`: list, show, draw, check and import robots, and try kinematics.

Owns arguments and output, nothing else; `import` is in `robots_import`, `home-check` in
`robots_home_check`. Results go to standard
output, of `fk` and `ik` as JSON: one line, or with `ik --all` one for each answer; an error is one
line on standard error. Joint values are rad or m; of a platform they are the lengths of its legs,
which are the same on both sides.

Exit codes: 0 done, 1 a checked robot or home is bad, 2 a bad argument, robot name or robot file,
3 refused: the pose cannot be reached, or the robot has no such thing, 74 a file cannot be written,
130 interrupted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..description.robot import ParallelRobot, SerialRobot, load_robot, robot_names
from ..errors import BadArgument, FrameUnknown, UnsupportedKind
from .arguments import (
    FAULTS,
    Angles,
    AsJson,
    InFrame,
    OnSide,
    PoseFrame,
    Robot,
    note_out_of_range,
    parse_joints,
    parse_pose,
    tell,
    to_controller,
)
from .robots_home_check import home_check
from .robots_import import import_robot

if TYPE_CHECKING:
    from ..kinematics.ik.ik import Solution


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
) -> None:
    """Show a robot's specification, limits, DH table, home, base frame and coupling."""
    from ..robot_report.robot_report import VrmReport, dh_exactness, dh_frames_at_home, robot_data

    facts = load_robot(robot)
    if as_json:
        emit_json(robot_data(facts, frames=frames, vrm=vrm), compact=True)
        return
    from .tables import print_frames, print_robot, print_vrm

    if vrm:
        report = VrmReport.of(_serial(facts))
        print_vrm(report.robot, report.table, report.home_angles, report.in_words)
        return
    arm = _serial(facts) if frames else None
    print_robot(facts, dh_exactness(facts))
    if arm is not None:
        print_frames(arm, dh_frames_at_home(arm))


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
    from ..visuals.drawing import View, draw, write_picture

    facts = load_robot(robot)
    position = None if joints is None else parse_joints(joints, "--joints")
    if position is not None and isinstance(facts, SerialRobot):
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


@app.command()
def fk(
    robot: Robot,
    joints: Annotated[str, typer.Option(help="JSON list, one value per driven joint [rad or m].")],
    frame: InFrame = PoseFrame.BASE,
    angles: OnSide = Angles.FILE,
) -> None:
    """Print the tool's pose for joint values: position [m] and quaternion x, y, z, w."""
    facts = load_robot(robot)
    position = parse_joints(joints, "--joints")
    if isinstance(facts, SerialRobot):
        position = to_controller(facts, position, angles)
    from ..paths.mechanism import mechanism

    arm = mechanism(facts)
    pose = arm.forward(position, frame)
    note_out_of_range(arm.limits, position)
    place = {"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()}
    emit_json(place | {"frame": frame.value}, compact=True)


@app.command()
def ik(
    robot: Robot,
    pose: Annotated[str, typer.Option(help='JSON {"xyz": [m], "quat": [x, y, z, w]}.')],
    seed: Annotated[
        str | None, typer.Option(help="JSON list to start from; the robot's home if not given.")
    ] = None,
    frame: Annotated[
        PoseFrame | None, typer.Option(help="Frame of the pose; its own `frame`, else base.")
    ] = None,
    angles: OnSide = Angles.FILE,
    every: Annotated[
        bool, typer.Option("--all", help="Every answer, a line each, the nearest to seed first.")
    ] = False,
    restarts: Annotated[int, typer.Option(min=0, max=10_000, help="Search budget.")] = 50,
    random_seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Same number, same answer.")
    ] = 0,
) -> None:
    """Print joint values that put the tool at a pose, inside the limits."""
    facts = load_robot(robot)
    xyz, quaternion, named = parse_pose(pose, "--pose")
    asked = _frame(frame, named)
    start = None if seed is None else parse_joints(seed, "--seed")
    from ..pose import Pose

    target = Pose.from_values(xyz, quaternion)
    if not isinstance(facts, SerialRobot):
        from ..paths.mechanism import mechanism

        platform = mechanism(facts)
        solution = platform.solve(target, start or platform.home_position, frame=asked)
        emit_json(_answer(solution, solution.joint_position.tolist(), asked, angles), compact=True)
        return
    from ..kinematics.ik.ik import solve, solve_all
    from ..kinematics.serial import Kinematics

    kinematics = Kinematics(facts)
    near = facts.home_position if start is None else to_controller(facts, start, angles)
    budget: dict[str, Any] = {"restarts": restarts, "random_seed": random_seed}
    if every:
        found = solve_all(kinematics, target, near, frame=asked, **budget)
    else:
        found = (solve(kinematics, target, near, frame=asked, **budget),)
    for solution in found:
        joints = tuple(solution.joint_position.tolist())
        shown = facts.to_model(joints) if angles is Angles.FILE else joints
        emit_json(_answer(solution, shown, asked, angles), compact=True)


def _answer(
    solution: Solution, joints: tuple[float, ...], frame: PoseFrame, angles: Angles
) -> dict[str, object]:
    """Return an answer as JSON can hold it; `configuration` is null where there are no flags."""
    flags = solution.configuration
    return {
        "joints": joints,
        "angles": angles.value,
        "frame": frame.value,
        "configuration": None
        if flags is None
        else {
            "shoulder": flags.shoulder.value,
            "elbow": flags.elbow.value,
            "wrist": flags.wrist.value,
            "turns": flags.turns,
        },
        "position_error": solution.position_error,
        "rotation_error": solution.rotation_error,
        "restarts": solution.restarts,
        "iterations": solution.iterations,
    }


def _frame(option: PoseFrame | None, named: str | None) -> PoseFrame:
    if named is None:
        return option or PoseFrame.BASE
    if named not in list(PoseFrame):
        raise FrameUnknown(named, tuple(PoseFrame))
    if option is not None and option != named:
        raise BadArgument("--frame", option.value, f"the pose's own frame, {named}")
    return PoseFrame(named)


def _serial(robot: ParallelRobot | SerialRobot) -> SerialRobot:
    if isinstance(robot, ParallelRobot):
        raise UnsupportedKind(robot.name, robot.kind, "DH table")
    return robot
