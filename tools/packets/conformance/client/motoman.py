"""Checks of clients of a Motoman controller; in other dialects none applies.

Of the conversation, and of what the messages say: fields, groups, commands, addresses.
"""

from __future__ import annotations

from collections.abc import Callable

from openpendant.simplemsg import MOTOMAN, MsgType, ReplyCode, ValidField
from openpendant.simplemsg.motoman import (
    MOTOMAN_GROUPS,
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanMotionReply,
    MotomanReadGroupIo,
    MotomanReadMregister,
    MotomanReadSingleIo,
    MotomanSelectTool,
    MotomanWriteGroupIo,
    MotomanWriteMregister,
    MotomanWriteSingleIo,
)

from ..check import CheckFinding, not_applicable
from .check import Habit, Judge, Observed, Problem, Tally, client_check, each
from .setup import Purpose
from .trace import TracedFrame
from .trajectories import PointAnswer, SentPoint, SentTrajectory, is_stop

CHECK_READY = 200101
COMMANDS = (200101, 200102, 200111, 200112, 200113, 200114, 200121, 200122, 200130)
NEEDED = ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY

LEAST_PAUSE_NS = 2_000_000
"""Between a BUSY and the next attempt; the driver takes 5 ms."""

LONGEST_TIME = 14_400.0
"""The controller takes no point later than this [s]."""

TOOLS = 64
REGISTERS = 1_000
LARGEST_REGISTER_VALUE = 65_535

NOT_MOTOMAN = "not the Motoman dialect"
NO_POINT = "the client sent no point"


def _motoman(judge: Judge) -> Judge:
    """Make a judge that applies to the Motoman dialect only."""

    def judge_motoman(seen: Observed) -> CheckFinding:
        if seen.trace.setup.dialect is not MOTOMAN:
            return not_applicable(NOT_MOTOMAN)
        return judge(seen)

    return judge_motoman


def motoman_check(number: str) -> Callable[[Judge], Judge]:
    """Register a check of a function that is asked in the Motoman dialect only."""
    make = client_check(number)
    return lambda judge: make(_motoman(judge))


@motoman_check("YC01")
def asks_readiness(seen: Observed) -> CheckFinding:
    """Look for 200101 between the end of one trajectory and the beginning of the next."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        asked = _last_command(seen, trajectory)
        return None if asked is not None else "no 200101 came before it"

    return each(seen.motions.trajectories, rule, "the client sent no trajectory")


@motoman_check("YC02")
def heeds_readiness(seen: Observed) -> CheckFinding:
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


def _last_command(seen: Observed, trajectory: SentTrajectory) -> TracedFrame | None:
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


def _is_command(frame: TracedFrame, command: int) -> bool:
    return isinstance(frame.message, MotomanMotionCtrl) and frame.message.command == command


def _result(seen: Observed, request: TracedFrame) -> int | None:
    reply = seen.trace.replies.get(request.number)
    if reply is None or not isinstance(reply.message, MotomanMotionReply):
        return None
    return reply.message.result


@motoman_check("YC03")
def repeats_after_busy(seen: Observed) -> CheckFinding:
    """Look at what follows each BUSY."""
    tally = Tally()
    for step, on in _after(seen, PointAnswer.BUSY):
        skipped = on is not None and on.repeats is not step
        tally.look(step, f"sequence {on.sequence} follows BUSY" if on and skipped else None)
    return tally.finding("the controller was never busy")


@motoman_check("YC04")
def pauses_after_busy(seen: Observed) -> CheckFinding:
    """Measure the pause between a BUSY and the next attempt."""
    tally = Tally()
    for step, on in _after(seen, PointAnswer.BUSY):
        if on is None or step.reply is None:
            continue
        pause = on.frame.time - step.reply.time
        tally.look(on, f"{pause / 1e6:.1f} ms after BUSY" if pause < LEAST_PAUSE_NS else None)
    return tally.finding("the controller was never busy")


@motoman_check("YC05")
def result_ends(seen: Observed) -> CheckFinding:
    """Look at what follows each refusal in the body of a reply."""
    tally = Tally()
    for step, on in _after(seen, PointAnswer.REFUSED):
        tally.look(step, f"sequence {on.sequence} follows a refusal" if on else None)
    return tally.finding("no point was refused")


def _after(seen: Observed, answer: PointAnswer) -> list[tuple[SentPoint, SentPoint | None]]:
    """Return each point with a certain answer, and what follows it in its trajectory."""
    return [
        (step, on)
        for trajectory in seen.motions.trajectories
        for step, on in zip(trajectory.steps, [*trajectory.steps[1:], None], strict=True)
        if step.answer is answer
    ]


@motoman_check("YC06")
def stops_by_command(seen: Observed) -> CheckFinding:
    """Look at the form of each stop."""

    def rule(frame: TracedFrame) -> Problem | None:
        if frame.msg_type == MsgType.JOINT_TRAJ_PT:
            name = "motoman_driver: a type-11 STOP on exit, from its base class"
            return Habit(name, "STOP of type 11")
        return None if frame.msg_type == 2001 else f"STOP of type {frame.msg_type}"

    return each(seen.motions.stops, rule, "the client sent no STOP")


@motoman_check("YC12")
def heeds_header(seen: Observed) -> CheckFinding:
    """Look at what follows a reply whose header says failure and whose body success."""
    tally = Tally()
    for step, on in _after(seen, PointAnswer.TAKEN):
        if step.reply is None or step.reply.reply_code != ReplyCode.FAILURE:
            continue
        problem: Problem | None = None
        if on is not None:
            name = "motoman_driver: only the result in the body is looked at"
            problem = Habit(name, f"sequence {on.sequence} follows")
        tally.look(step, problem)
    return tally.finding("no reply had a failure in its header and success in its body")


@motoman_check("YC15")
def stop_then_ready(seen: Observed) -> CheckFinding:
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


@motoman_check("YC07")
def fields_complete(seen: Observed) -> CheckFinding:
    """Look at the bits of each point."""

    def rule(step: SentPoint) -> Problem | None:
        lacking = [part.valid for part in step.parts if part.valid & NEEDED != NEEDED]
        return f"valid_fields {lacking[0] & 15}" if lacking else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check("YC08")
def point_type(seen: Observed) -> CheckFinding:
    """Look at the type of each point."""
    types = (MsgType.JOINT_TRAJ_PT_FULL, 2016)
    return each(
        seen.motions.steps,
        lambda step: None if step.frame.msg_type in types else f"type {step.frame.msg_type}",
        NO_POINT,
    )


@motoman_check("YC09")
def not_too_late(seen: Observed) -> CheckFinding:
    """Look at the time of each point."""

    def rule(step: SentPoint) -> Problem | None:
        late = [part.time for part in step.parts if part.time and part.time >= LONGEST_TIME]
        return f"time {late[0]:g} s" if late else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check("YC10")
def padding_is_zero(seen: Observed) -> CheckFinding:
    """Look at the records behind those that are meant."""

    def rule(frame: TracedFrame) -> Problem | None:
        message = frame.message
        assert isinstance(message, MotomanJointTrajPtFullEx)
        padding = message.groups[message.num_groups :]
        used = [any((*group.positions, *group.velocities, group.time)) for group in padding]
        return "unused records are not zero" if any(used) else None

    frames = [f for f in seen.trace.sent if isinstance(f.message, MotomanJointTrajPtFullEx)]
    return each(frames, rule, "the client sent no point of several groups")


@motoman_check("YC11")
def groups_exist(seen: Observed) -> CheckFinding:
    """Look at the groups of each point."""

    def rule(step: SentPoint) -> Problem | None:
        groups = [part.group for part in step.parts]
        strange = [group for group in groups if not 0 <= group < MOTOMAN_GROUPS]
        if strange:
            return f"group {strange[0]}"
        return f"groups {groups}" if len(set(groups)) < len(groups) else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check("YC13")
def commands_exist(seen: Observed) -> CheckFinding:
    """Look at each motion control message."""

    def rule(frame: TracedFrame) -> Problem | None:
        message = frame.message
        assert isinstance(message, MotomanMotionCtrl)
        if message.command not in COMMANDS:
            return f"command {message.command}"
        return "data that is not zero" if any(message.data) else None

    frames = [f for f in seen.trace.sent if isinstance(f.message, MotomanMotionCtrl)]
    return each(frames, rule, "the client sent no motion control")


@motoman_check("YC14")
def io_exists(seen: Observed) -> CheckFinding:
    """Look at the addresses and values of I/O, register and tool requests."""
    tally = Tally()
    for frame in seen.trace.on(Purpose.MOTION, Purpose.IO):
        problem, is_io = _io_problem(frame.message)
        if is_io:
            tally.look(frame, problem)
    return tally.finding("the client asked for no I/O, register or tool")


def _io_problem(message: object) -> tuple[Problem | None, bool]:
    """Return what is wrong with a request, and whether it is of this kind at all."""
    match message:
        case MotomanReadSingleIo(address=address):
            return _unless(address > 0, f"address {address}"), True
        case MotomanWriteSingleIo(address=address, value=value):
            return _unless(address > 0 and value in (0, 1), f"{value} to bit {address}"), True
        case MotomanReadGroupIo(address=address):
            return _unless(address > 0, f"group address {address}"), True
        case MotomanWriteGroupIo(address=address, value=value):
            fits = address > 0 and 0 <= value <= 255
            return _unless(fits, f"{value} to group {address}"), True
        case MotomanReadMregister(address=address):
            return _unless(0 <= address < REGISTERS, f"register {address}"), True
        case MotomanWriteMregister(address=address, value=value):
            fits = 0 <= address < REGISTERS and 0 <= value <= LARGEST_REGISTER_VALUE
            return _unless(fits, f"{value} to register {address}"), True
        case MotomanSelectTool(group=group, tool=tool):
            fits = 0 <= group < MOTOMAN_GROUPS and 0 <= tool < TOOLS
            return _unless(fits, f"tool {tool} of group {group}"), True
    return None, False


def _unless(fits: bool, text: str) -> Problem | None:
    return None if fits else text
