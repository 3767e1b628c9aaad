"""The commands `openpendant robots fk` and `ik`: kinematics by hand, of arms and platforms.

Owns their arguments and the JSON they print: one line, or with `ik --all` one for each answer.
Joint values are rad or m; of a platform they are the lengths of its legs, which are the same on
both sides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.tools.console import emit_json

from ..description.robot import SerialRobot, load_robot
from ..errors import BadArgument, FrameUnknown
from .arguments import (
    Angles,
    InFrame,
    OnSide,
    PoseFrame,
    Robot,
    note_out_of_range,
    parse_joints,
    parse_pose,
    to_controller,
)

if TYPE_CHECKING:
    from ..kinematics.ik.ik import Solution


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
