"""Checks of clients of a Motoman controller; in other dialects none applies."""

from __future__ import annotations

from collections.abc import Callable

from openpendant.simplemsg import MOTOMAN, MsgType, ReplyCode, ValidField
from openpendant.simplemsg.motoman import (
    MotomanMotionCtrl,
    MotomanMotionReply,
)

from ..findings import Finding, not_applicable
from .check import ClientCheck, Habit, Judge, Observed, Problem, Tally, client_check, each
from .setup import Purpose
from .trace import Frame
from .trajectories import Answer, Step, Trajectory, is_stop

CHECK_READY = 200101
COMMANDS = (200101, 200102, 200111, 200112, 200113, 200114, 200121, 200122, 200130)
NEEDED = ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY

LEAST_PAUSE_NS = 2_000_000
"""Between a BUSY and the next attempt; the driver takes 5 ms."""

LONGEST_TIME = 14_400.0
"""The controller takes no point later than this [s]."""

GROUPS = 4
TOOLS = 64
REGISTERS = 1_000
LARGEST_REGISTER_VALUE = 65_535

NOT_MOTOMAN = "not the Motoman dialect"
NO_POINT = "the client sent no point"


def _motoman(judge: Judge) -> Judge:
    """Make a judge that applies to the Motoman dialect only."""

    def judge_motoman(seen: Observed) -> Finding:
        if seen.trace.setup.dialect is not MOTOMAN:
            return not_applicable(NOT_MOTOMAN)
        return judge(seen)

    return judge_motoman


def motoman_check(number: str, title: str, clause: str) -> Callable[[Judge], ClientCheck]:
    """Make a check of a function that is asked in the Motoman dialect only."""
    make = client_check(number, title, clause)
    return lambda judge: make(_motoman(judge))


@motoman_check(
    "YC01",
    "readiness is asked for before each trajectory",
    "motoman_driver joint_trajectory_streamer.cpp: 200101 first; MotionServer.c",
)
def asks_readiness(seen: Observed) -> Finding:
    """Look for 200101 between the end of one trajectory and the beginning of the next."""

    def rule(trajectory: Trajectory) -> Problem | None:
        asked = _last_command(seen, trajectory)
        return None if asked is not None else "no 200101 came before it"

    return each(seen.motions.trajectories, rule, "the client sent no trajectory")


@motoman_check(
    "YC02",
    "no trajectory follows where the controller is not ready",
    "motoman_driver: 200101 must be answered with result 0; MotionServer.c answers 5xxx",
)
def heeds_readiness(seen: Observed) -> Finding:
    """Look at what follows a 200101 that was answered with another result than 0."""
    tally = Tally()
    for frame in seen.trace.on(Purpose.MOTION):
        if not _is_command(frame, CHECK_READY):
            continue
        result = _result(seen, frame)
        if result in (0, None):
            continue
        nexts = [t for t in seen.motions.trajectories if t.begins > frame.time]
        asked = _last_command(seen, nexts[0]) if nexts else None
        text = f"result {result}, yet a trajectory begins {nexts[0].where}" if nexts else None
        tally.look(frame, text if asked is frame else None)
    return tally.finding("the controller was always ready")


def _last_command(seen: Observed, trajectory: Trajectory) -> Frame | None:
    """Return the last 200101 before a trajectory and after whatever moved before it."""
    earlier = [
        step.frame.time
        for other in seen.motions.trajectories
        if other.begins < trajectory.begins
        for step in other.steps
    ]
    since = max(earlier, default=-1)
    asked = [
        frame
        for frame in seen.trace.on(Purpose.MOTION)
        if since < frame.time <= trajectory.begins and _is_command(frame, CHECK_READY)
    ]
    return asked[-1] if asked else None


def _is_command(frame: Frame, command: int) -> bool:
    return isinstance(frame.message, MotomanMotionCtrl) and frame.message.command == command


def _result(seen: Observed, request: Frame) -> int | None:
    reply = seen.trace.replies.get(request.number)
    if reply is None or not isinstance(reply.message, MotomanMotionReply):
        return None
    return reply.message.result


@motoman_check(
    "YC03",
    "after BUSY the same point comes again",
    "motoman_driver joint_trajectory_streamer.cpp: result 1 means later",
)
def repeats_after_busy(seen: Observed) -> Finding:
    """Look at what follows each BUSY."""
    tally = Tally()
    for step, on in _after(seen, Answer.BUSY):
        skipped = on is not None and on.repeats is not step
        tally.look(step, f"sequence {on.sequence} follows BUSY" if on and skipped else None)
    return tally.finding("the controller was never busy")


@motoman_check(
    "YC04",
    "a point that met BUSY is not repeated within 2 ms",
    "observed: motoman_driver pauses 5 ms",
)
def pauses_after_busy(seen: Observed) -> Finding:
    """Measure the pause between a BUSY and the next attempt."""
    tally = Tally()
    for step, on in _after(seen, Answer.BUSY):
        if on is None or step.reply is None:
            continue
        pause = on.frame.time - step.reply.time
        tally.look(on, f"{pause / 1e6:.1f} ms after BUSY" if pause < LEAST_PAUSE_NS else None)
    return tally.finding("the controller was never busy")


@motoman_check(
    "YC05",
    "any other result than success and busy ends the trajectory",
    "motoman_driver joint_trajectory_streamer.cpp: aborts; MotionServer.c: 3xxx, 5xxx",
)
def result_ends(seen: Observed) -> Finding:
    """Look at what follows each refusal in the body of a reply."""
    tally = Tally()
    for step, on in _after(seen, Answer.REFUSED):
        tally.look(step, f"sequence {on.sequence} follows a refusal" if on else None)
    return tally.finding("no point was refused")


def _after(seen: Observed, answer: Answer) -> list[tuple[Step, Step | None]]:
    """Return each point with a certain answer, and what follows it in its trajectory."""
    return [
        (step, on)
        for trajectory in seen.motions.trajectories
        for step, on in zip(trajectory.steps, [*trajectory.steps[1:], None], strict=True)
        if step.answer is answer
    ]


@motoman_check(
    "YC06",
    "the robot is stopped with command 200111",
    "MotionServer.c: type 11 is unknown there and sequence -4 is refused (INVALID/3005)",
)
def stops_by_command(seen: Observed) -> Finding:
    """Look at the form of each stop."""

    def rule(frame: Frame) -> Problem | None:
        if frame.msg_type == MsgType.JOINT_TRAJ_PT:
            name = "motoman_driver: a type-11 STOP on exit, from its base class"
            return Habit(name, "STOP of type 11")
        return None if frame.msg_type == 2001 else f"STOP of type {frame.msg_type}"

    return each(seen.motions.stops, rule, "the client sent no STOP")


@motoman_check(
    "YC12",
    "a failure in the header of a reply is not overlooked",
    "REP-I0006: the reply code says whether the request was taken",
)
def heeds_header(seen: Observed) -> Finding:
    """Look at what follows a reply whose header says failure and whose body success."""
    tally = Tally()
    for step, on in _after(seen, Answer.TAKEN):
        if step.reply is None or step.reply.reply_code != ReplyCode.FAILURE:
            continue
        problem: Problem | None = None
        if on is not None:
            name = "motoman_driver: only the result in the body is looked at"
            problem = Habit(name, f"sequence {on.sequence} follows")
        tally.look(step, problem)
    return tally.finding("no reply had a failure in its header and success in its body")


@motoman_check(
    "YC15",
    "no point follows STOP before readiness was asked for again",
    "MotionServer.c: 200111 empties the queues; the interpolation needs a new sequence 0",
)
def stop_then_ready(seen: Observed) -> Finding:
    """Look at the trajectories that follow a stop."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        stop = trajectory.after_stop
        if stop is None or not is_stop(stop.message):
            continue
        asked = _last_command(seen, trajectory)
        ready = asked is not None and asked.time > stop.time
        tally.look(trajectory, None if ready else "no 200101 since STOP")
    return tally.finding("no trajectory followed a STOP")


CHECKS: tuple[ClientCheck, ...] = (
    asks_readiness,
    heeds_readiness,
    repeats_after_busy,
    pauses_after_busy,
    result_ends,
    stops_by_command,
    heeds_header,
    stop_then_ready,
)
