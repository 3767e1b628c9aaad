"""`openpendant plan` at a served cell: makes a plan there, shows its facts, writes and executes it.

Owns the command's options, a plan's facts in words, and the CSV of its samples. The server plans
from where the robot stands, among what stands in the cell. A plan ends with the connection that
made it, so what is executed is executed by this command.
"""

from __future__ import annotations

import argparse
import asyncio
import csv
import io
import math
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.simplemsg.pendant.management.plans import MadePlan
from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode
from ..client import NotUnderstood, PendantClient, Refused, WrongArgument
from ..motions import roll_pitch_yaw
from .moving import STATE_RATE, explained, move
from .plan_goals import PlanGoal, plan_goal
from .running import CommandOutput, add_speed, facts_of, parser, run, server_access

_ABOUT = (
    "Plan a motion at a served cell, from where its robot stands, among what stands around it."
    " Nothing moves without --execute, and the plan ends with the command. Joint values are the"
    ' controller\'s. A pose is JSON, {"xyz": [m], "quat": [x, y, z, w]}, or "rpy": [r, p, y];'
    ' "frame" names another frame than base. For instance: openpendant plan --cell left --to home'
    " --execute"
)


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    arguments = _reader().parse_args(sys.argv[1:] if argv is None else argv)
    output = CommandOutput("plan", is_json=arguments.json)
    try:
        goal = plan_goal(arguments)
    except WrongArgument as error:
        output.complain("wrong", str(error))
        return ExitCode.USAGE
    act = partial(_plan, goal, arguments)
    return run(output, partial(server_access, arguments), act, state_rate=STATE_RATE)


def _reader() -> argparse.ArgumentParser:
    reader = parser("plan", _ABOUT)
    goal = reader.add_mutually_exclusive_group(required=True)
    goal.add_argument("--goal", metavar="JSON", help="list of joint values [rad or m]")
    goal.add_argument("--pose", metavar="JSON", help="pose of the tool")
    goal.add_argument("--to", metavar="NAME", help="named position: home, or one of the cell's")
    goal.add_argument(
        "--path", metavar="FILE", help="JSON file: a list of joint lists, or of poses in one frame"
    )
    reader.add_argument(
        "--way",
        choices=("ptp", "lin", "free"),
        help="joint line (default), straight line of the tool, or around obstacles",
    )
    of_free = "with --way free: "
    reader.add_argument("--branch", type=int, help="of a pose: the nearest is 1 (see plans.make)")
    reader.add_argument("--planner", help=of_free + "its name (default: RRTConnect)")
    reader.add_argument("--seed", type=int, help=of_free + "same number, same plan (default: 0)")
    reader.add_argument("--time-limit", type=float, metavar="S", help=of_free + "longest search")
    reader.add_argument("--margin", type=float, metavar="M", help=of_free + "kept from bodies")
    reader.add_argument(
        "--degrees", action="store_true", help="given angles are degrees, also roll, pitch, yaw"
    )
    add_speed(reader, 0.5, "the joints' largest speed")
    reader.add_argument("--csv", type=Path, metavar="FILE", help="write every sample as CSV")
    reader.add_argument(
        "--execute", action="store_true", help="move the robot exactly so; Ctrl-C stops it"
    )
    return reader


async def _plan(
    goal: PlanGoal, arguments: argparse.Namespace, pendant: PendantClient, output: CommandOutput
) -> int:
    """Make the plan, show it, and do with it what was asked for; return the exit code."""
    joints = (await pendant.snapshot())["joints"]
    request = goal.request([each["unit"] == "m" for each in joints])
    try:
        made = await pendant.plans.make(request, speed=arguments.speed, label="openpendant plan")
        if arguments.csv is not None:
            rows = await _samples(pendant, made["plan"])
            arguments.csv.write_text(samples_as_csv(rows, joints), "utf-8")
    except Refused as refused:
        if refused.code == VerdictCode.NO_MOTION and arguments.execute and not arguments.csv:
            output.say("completed", "the robot is there already")
            return ExitCode.OK
        output.complain("refused", explained(refused), **facts_of(refused))
        return ExitCode.FAILED
    except OSError as error:
        output.complain("unwritten", f"{arguments.csv}: {error.strerror or error}")
        return ExitCode.OUTPUT_FAILED
    _show(made, joints, output, as_json=arguments.json)
    if not arguments.execute:
        return ExitCode.OK
    what = f"plan {made['plan']}"
    return await move(pendant, output, what, lambda: pendant.execute(made["plan"]))


def _show(
    made: MadePlan, joints: Sequence[JointFacts], output: CommandOutput, *, as_json: bool
) -> None:
    lines = list(plan_in_words(made, joints))
    if as_json:
        output.say("planned", lines[0], **made)
        return
    for line in lines:
        output.say("planned", line)


def plan_in_words(made: MadePlan, joints: Sequence[JointFacts]) -> Iterator[str]:
    """Yield the facts of a plan as lines; degrees and millimetres.

    Args:
        joints: (n,) those of the snapshot.
    """
    names = {each["name"]: str(each.get("display_name") or each["name"]) for each in joints}
    seed = f", seed {made['seed']}" if made["seed"] else ""
    yield (
        f"plan {made['plan']}: {made['duration']:.2f} s, {made['samples']} samples, by"
        f" {made['planner']}{seed} in {made['plan_time']:.2f} s"
    )
    ends = zip(joints, made["end"], strict=True)
    yield f"ends at {', '.join(_joint_value(*each) for each in ends)}"
    pose = made["end_pose"]
    x, y, z = (1e3 * each for each in pose["position"])
    a, b, c = map(math.degrees, roll_pitch_yaw(pose["orientation"]))
    yield f"tool then at X {x:z.1f} Y {y:z.1f} Z {z:z.1f} mm, A {a:z.1f} B {b:z.1f} C {c:z.1f}°"
    for worst in made["certificate"]["worst"]:
        name = names.get(worst["joint"], worst["joint"])
        quantity = worst["quantity"].replace("_", " ")
        yield f"{quantity} at most {worst['ratio']:.0%} of its limit ({name})"
    near = made["clearance"]
    if near is not None:
        yield (
            f"comes as near as {1e3 * near['distance']:.1f} mm: {near['first']} and"
            f" {near['second']}, after {near['at']:.2f} s"
        )
    why = made["why"]
    # This command takes the authority where it executes, so that is nothing to tell.
    if why is not None and why["code"] != VerdictCode.NOT_IN_CONTROL:
        yield f"would not be executed now: {why['text']}"


def _joint_value(joint: JointFacts, value: float) -> str:
    return f"{1e3 * value:z.1f} mm" if joint["unit"] == "m" else f"{math.degrees(value):z.2f}°"


_BETWEEN_QUESTIONS = 0.05
"""A server answers at most so often where samples are [s]."""


async def _samples(pendant: PendantClient, plan: int) -> list[list[float]]:
    """Return all samples of a plan, as they would be executed."""
    rows: list[list[float]] = []
    while True:
        try:
            answer = await pendant.plans.samples(plan, first=len(rows))
        except Refused as refused:
            if refused.code != VerdictCode.TOO_OFTEN:
                raise
            await asyncio.sleep(max(refused.value, _BETWEEN_QUESTIONS))
            continue
        rows += answer["rows"]
        if not answer["more"]:
            return rows
        if not answer["rows"] or len(rows) > answer["total"]:
            raise NotUnderstood(f"the server's samples of plan {plan} do not end")
        await asyncio.sleep(_BETWEEN_QUESTIONS)


def samples_as_csv(rows: Sequence[Sequence[float]], joints: Sequence[JointFacts]) -> str:
    """Return samples as CSV, as offline plans are written.

    Args:
        rows: time, joints, speeds, accelerations [s; rad or m, and per second].
        joints: (n,) those of the snapshot.
    """
    quantities = (("position", ""), ("velocity", "/s"), ("acceleration", "/s²"))
    header = [
        f"{each['name']} {quantity} [{each['unit']}{per}]"
        for quantity, per in quantities
        for each in joints
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time [s]", *header])
    writer.writerows([repr(float(value)) for value in row] for row in rows)
    return text.getvalue()


if __name__ == "__main__":
    sys.exit(main())
