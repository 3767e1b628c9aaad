"""The commands `robots fk`, `jacobian` and `ik`: kinematics by hand.

On a terminal they print blocks and tables that a person can read and copy, with degrees, mm and
rounded numbers; with `--json`, and where standard output is no terminal, one JSON line, of `ik
--all` one for each answer, SI units and every bit. `robot_report.kinematics_report` owns the
fields, which are those of the pendant protocol; `xyz`, `quat` and `frame` stand in front of them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.tools.console import emit_json

from ..description.robot import ParallelRobot, SerialRobot, load_robot
from ..errors import BadArgument, FrameUnknown, UnsupportedKind
from .arguments import (
    Angles,
    AsJson,
    InDegrees,
    InFrame,
    NamedAs,
    Names,
    OnSide,
    PoseFrame,
    Robot,
    in_radians,
    names_of,
    note_out_of_range,
    parse_joints,
    parse_pose,
    to_controller,
)

if TYPE_CHECKING:
    from ..kinematics.ik.ik import Solution
    from ..kinematics.ik.ik_choices import Choices
    from ..kinematics.serial import Kinematics
    from ..pose import Pose

_MOST_ANSWERS = 10_000


class PoseForm(StrEnum):
    """Form in which a pose is printed for a person."""

    MATRIX = "matrix"
    RPY = "rpy"
    QUAT = "quat"
    ALL = "all"


def fk(
    robot: Robot,
    joints: Annotated[str, typer.Option(help="JSON list, one value per driven joint [rad or m].")],
    form: Annotated[
        PoseForm, typer.Option("--as", help="What is printed on a terminal.")
    ] = PoseForm.ALL,
    frame: InFrame = PoseFrame.BASE,
    angles: OnSide = Angles.FILE,
    degrees: InDegrees = False,
    as_json: AsJson = False,
) -> None:
    """Print the tool's pose for joint values: matrix, roll-pitch-yaw, quaternion."""
    from ..robot_report.kinematics_report import (
        configuration_report,
        outside_report,
        pose_report,
    )

    facts = load_robot(robot)
    position = _given(facts, joints, "--joints", angles, degrees)
    from ..paths.mechanism import SerialMechanism, mechanism

    arm = mechanism(facts)
    pose = arm.forward(position, frame)
    note_out_of_range(arm.limits, position)
    flags = None
    if isinstance(arm, SerialMechanism):
        from ..kinematics.ik.configuration import configuration_of

        flags = configuration_of(arm.kinematics, position)
    told = pose_report(pose)
    if _is_for_people(as_json):
        from .kinematics_tables import print_pose

        title = f"{facts.name}: {facts.tool_link} in {frame.value}"
        print_pose(title, told, form.value, configuration_report(flags))
        return
    about = {
        "configuration": configuration_report(flags),
        "limits": outside_report(arm.limits, position),
    }
    emit_json({**_place(pose), "frame": frame.value, **told, **about}, compact=True)


def jacobian(
    robot: Robot,
    joints: Annotated[str, typer.Option(help="JSON list, one value per driven joint [rad or m].")],
    frame: InFrame = PoseFrame.BASE,
    angles: OnSide = Angles.FILE,
    degrees: InDegrees = False,
    names: NamedAs = Names.DISPLAY,
    as_json: AsJson = False,
) -> None:
    """Print the tool's Jacobian, its condition, manipulability and the nearest singularity.

    Rows are vx, vy, vz, wx, wy, wz; the RoboAnalyzer's paper has the angular ones first.
    """
    facts = load_robot(robot)
    if not isinstance(facts, SerialRobot):
        raise UnsupportedKind(facts.name, facts.kind, "Jacobian of joint angles")
    position = _given(facts, joints, "--joints", angles, degrees)
    from ..kinematics.serial import Kinematics
    from ..robot_report.kinematics_report import jacobian_report

    told = jacobian_report(Kinematics(facts), position, frame.value)
    note_out_of_range(facts.limits, position)
    if _is_for_people(as_json):
        from .kinematics_tables import print_jacobian

        title = f"{facts.name}: Jacobian of {facts.tool_link}, axes of {frame.value}"
        print_jacobian(title, told, tuple(names_of(facts, names).values()))
        return
    emit_json({**told, "frame": frame.value}, compact=True)


def ik(
    robot: Robot,
    pose: Annotated[
        str,
        typer.Option(help='JSON {"xyz": [m], "quat": [x, y, z, w]}, or "rpy": [r, p, y].'),
    ],
    seed: Annotated[
        str | None, typer.Option(help="JSON list to start from; the robot's home if not given.")
    ] = None,
    frame: Annotated[
        PoseFrame | None, typer.Option(help="Frame of the pose; its own `frame`, else base.")
    ] = None,
    angles: OnSide = Angles.FILE,
    degrees: InDegrees = False,
    every: Annotated[
        bool, typer.Option("--all", help="Each configuration once, the nearest to seed first.")
    ] = False,
    turns: Annotated[
        bool, typer.Option("--turns", help="Also every full turn inside the limits.")
    ] = False,
    restarts: Annotated[int, typer.Option(min=0, max=10_000, help="Search budget.")] = 50,
    random_seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Same number, same answer.")
    ] = 0,
    names: NamedAs = Names.DISPLAY,
    as_json: AsJson = False,
) -> None:
    """Print joint values that put the tool at a pose, inside the limits."""
    facts = load_robot(robot)
    xyz, quaternion, named = parse_pose(pose, "--pose", degrees=degrees)
    asked = _frame(frame, named)
    start = None if seed is None else parse_joints(seed, "--seed")
    from ..pose import Pose

    target = Pose.from_values(xyz, quaternion)
    if not isinstance(facts, SerialRobot):
        from ..paths.mechanism import mechanism

        platform = mechanism(facts)
        solution = platform.solve(target, start or platform.home_position, frame=asked)
        lengths = solution.joint_position.tolist()
        if _is_for_people(as_json):
            from .kinematics_tables import print_legs

            print_legs(f"{facts.name}: lengths of its legs", lengths, facts.joint_names)
            return
        emit_json(_solution(solution, lengths, asked, angles), compact=True)
        return
    from ..kinematics.ik import ik_choices
    from ..kinematics.ik.ik import Configurations, solve, solve_configurations
    from ..kinematics.serial import Kinematics

    kinematics = Kinematics(facts)
    near = facts.home_position
    if start is not None:
        near = to_controller(facts, in_radians(facts.limits, start, degrees), angles)
    budget: dict[str, Any] = {"restarts": restarts, "random_seed": random_seed}
    if every or turns:
        found = solve_configurations(
            kinematics,
            target,
            near,
            frame=asked,
            most=_MOST_ANSWERS,
            in_every_turn=turns,
            **budget,
        )
    else:
        nearest = solve(kinematics, target, near, frame=asked, **budget)
        found = Configurations((nearest,), (1,), 1)
    listed = tuple(
        ik_choices.choice(number, solution, near)
        for number, solution in zip(found.numbers, found.listed, strict=True)
    )
    answers = ik_choices.Choices(listed, found.total, False)
    _print_answers(kinematics, answers, asked, angles, names, as_json)


def _print_answers(
    kinematics: Kinematics,
    found: Choices,
    frame: PoseFrame,
    angles: Angles,
    names: Names,
    as_json: bool,
) -> None:
    """Print answers as a table, or a JSON line each."""
    from ..robot_report.kinematics_report import inverse_report
    from ..scene.collision import CollisionModel

    facts = kinematics.robot
    model = CollisionModel(kinematics)

    def touches(position: Sequence[float]) -> tuple[str, str] | None:
        nearest = model.distance(position)
        return (nearest.first, nearest.second) if nearest and nearest.touching else None

    told = inverse_report(kinematics, found, touches)["solutions"]
    shown = [_shown(facts, answer["joints"], angles) for answer in told]
    if _is_for_people(as_json):
        from .kinematics_tables import print_answers

        called = tuple(names_of(facts, names).values())
        print_answers(f"{facts.name}: {angles.value}'s angles", told, shown, called, facts.limits)
        return
    for choice, answer, joints in zip(found.listed, told, shown, strict=True):
        emit_json({**answer, **_solution(choice.solution, joints, frame, angles)}, compact=True)


def _shown(facts: SerialRobot, joints: list[float], angles: Angles) -> tuple[float, ...]:
    """Return a controller-side joint position on the side that was asked for."""
    return facts.to_model(joints) if angles is Angles.FILE else tuple(joints)


def _solution(
    solution: Solution, joints: Sequence[float], frame: PoseFrame, angles: Angles
) -> dict[str, object]:
    """Return an answer as JSON can hold it; `configuration` is null where there are no flags."""
    from ..robot_report.kinematics_report import configuration_report

    return {
        "joints": list(joints),
        "angles": angles.value,
        "frame": frame.value,
        "configuration": configuration_report(solution.configuration),
        "position_error": solution.position_error,
        "rotation_error": solution.rotation_error,
        "restarts": solution.restarts,
        "iterations": solution.iterations,
    }


def _place(pose: Pose) -> dict[str, list[float]]:
    return {"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()}


def _given(
    facts: ParallelRobot | SerialRobot, text: str, option: str, angles: Angles, degrees: bool
) -> tuple[float, ...]:
    """Return joint values that were typed, controller side [rad or m]."""
    position = parse_joints(text, option)
    if not isinstance(facts, SerialRobot):
        return position
    return to_controller(facts, in_radians(facts.limits, position, degrees), angles)


def _frame(option: PoseFrame | None, named: str | None) -> PoseFrame:
    if named is None:
        return option or PoseFrame.BASE
    if named not in list(PoseFrame):
        raise FrameUnknown(named, tuple(PoseFrame))
    if option is not None and option != named:
        raise BadArgument("--frame", option.value, f"the pose's own frame, {named}")
    return PoseFrame(named)


def _is_for_people(as_json: bool) -> bool:
    return not as_json and sys.stdout.isatty()
