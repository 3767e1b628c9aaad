"""Checks of clients of a Motoman controller: of the conversation, and of what the messages say."""

from __future__ import annotations

from collections.abc import Iterable

from openpendant.simplemsg import MsgType, ReplyCode, ValidField
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

from .check import NO_TRAJECTORY, Habit, Observation, Observed, Problem, client_check, rule_check
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

NO_POINT = "the client sent no point"


@rule_check("YC01", Observed.trajectories, NO_TRAJECTORY)
def _asks_readiness(trajectory: SentTrajectory, seen: Observed) -> Problem | None:
    asked = _last_command(seen, trajectory)
    return None if asked is not None else "no 200101 came before it"


@client_check("YC02", "the controller was always ready")
def _heeds_readiness(seen: Observed) -> Iterable[Observation]:
    for frame in seen.trace.on(Purpose.MOTION):
        if not _is_command(frame, CHECK_READY):
            continue
        result = _result(seen, frame)
        if result in (0, None):
            continue
        nexts = [t for t in seen.trajectories() if t.begins > frame.time]
        asked = _last_command(seen, nexts[0]) if nexts else None
        text = f"result {result}, yet a trajectory begins {nexts[0].where}" if nexts else None
        yield frame, text if asked is frame else None


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


@client_check("YC03", "the controller was never busy")
def _repeats_after_busy(seen: Observed) -> Iterable[Observation]:
    for step, on in _after(seen, PointAnswer.BUSY):
        skipped = on is not None and on.repeats is not step
        yield step, f"sequence {on.sequence} follows BUSY" if on and skipped else None


@client_check("YC04", "the controller was never busy")
def _pauses_after_busy(seen: Observed) -> Iterable[Observation]:
    for step, on in _after(seen, PointAnswer.BUSY):
        if on is not None and step.reply is not None:
            pause = on.frame.time - step.reply.time
            yield on, f"{pause / 1e6:.1f} ms after BUSY" if pause < LEAST_PAUSE_NS else None


@client_check("YC05", "no point was refused")
def _result_ends(seen: Observed) -> Iterable[Observation]:
    for step, on in _after(seen, PointAnswer.REFUSED):
        yield step, f"sequence {on.sequence} follows a refusal" if on else None


def _after(seen: Observed, answer: PointAnswer) -> list[tuple[SentPoint, SentPoint | None]]:
    """Return each point with a certain answer, and what follows it in its trajectory."""
    followed = (pair for trajectory in seen.trajectories() for pair in trajectory.followed)
    return [(step, on) for step, on in followed if step.answer is answer]


@rule_check("YC06", lambda seen: seen.motions.stops, "the client sent no STOP")
def _stops_by_command(frame: TracedFrame, _: Observed) -> Problem | None:
    if frame.msg_type == MsgType.JOINT_TRAJ_PT:
        name = "motoman_driver: a type-11 STOP on exit, from its base class"
        return Habit(name, "STOP of type 11")
    return None if frame.msg_type == 2001 else f"STOP of type {frame.msg_type}"


@client_check("YC12", "no reply had a failure in its header and success in its body")
def _heeds_header(seen: Observed) -> Iterable[Observation]:
    for step, on in _after(seen, PointAnswer.TAKEN):
        if step.reply is not None and step.reply.reply_code == ReplyCode.FAILURE:
            name = "motoman_driver: only the result in the body is looked at"
            yield step, Habit(name, f"sequence {on.sequence} follows") if on else None


@client_check("YC15", "no trajectory followed a STOP")
def _stop_then_ready(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        stop = trajectory.after_stop
        if stop is not None and is_stop(stop.message):
            asked = _last_command(seen, trajectory)
            ready = asked is not None and asked.time > stop.time
            yield trajectory, None if ready else "no 200101 since STOP"


@rule_check("YC07", Observed.points, NO_POINT)
def _fields_complete(step: SentPoint, _: Observed) -> Problem | None:
    lacking = [part.valid for part in step.parts if part.valid & NEEDED != NEEDED]
    return f"valid_fields {lacking[0] & 15}" if lacking else None


@rule_check("YC08", Observed.points, NO_POINT)
def _point_type(step: SentPoint, _: Observed) -> Problem | None:
    is_known = step.frame.msg_type in (MsgType.JOINT_TRAJ_PT_FULL, 2016)
    return None if is_known else f"type {step.frame.msg_type}"


@rule_check("YC09", Observed.points, NO_POINT)
def _not_too_late(step: SentPoint, _: Observed) -> Problem | None:
    late = [part.time for part in step.parts if part.time and part.time >= LONGEST_TIME]
    return f"time {late[0]:g} s" if late else None


@client_check("YC10", "the client sent no point of several groups")
def _padding_is_zero(seen: Observed) -> Iterable[Observation]:
    for frame in seen.trace.sent:
        message = frame.message
        if isinstance(message, MotomanJointTrajPtFullEx):
            padding = message.groups[message.num_groups :]
            used = [any((*group.positions, *group.velocities, group.time)) for group in padding]
            yield frame, "unused records are not zero" if any(used) else None


@rule_check("YC11", Observed.points, NO_POINT)
def _groups_exist(step: SentPoint, _: Observed) -> Problem | None:
    groups = [part.group for part in step.parts]
    strange = [group for group in groups if not 0 <= group < MOTOMAN_GROUPS]
    if strange:
        return f"group {strange[0]}"
    return f"groups {groups}" if len(set(groups)) < len(groups) else None


@client_check("YC13", "the client sent no motion control")
def _commands_exist(seen: Observed) -> Iterable[Observation]:
    for frame in seen.trace.sent:
        message = frame.message
        if isinstance(message, MotomanMotionCtrl):
            text = "data that is not zero" if any(message.data) else None
            yield frame, text if message.command in COMMANDS else f"command {message.command}"


@client_check("YC14", "the client asked for no I/O, register or tool")
def _io_exists(seen: Observed) -> Iterable[Observation]:
    for frame in seen.trace.on(Purpose.MOTION, Purpose.IO):
        judged = _io_fits(frame.message)
        if judged is not None:
            fits, text = judged
            yield frame, None if fits else text


def _io_fits(message: object) -> tuple[bool, str] | None:
    """Return whether address and value of a request exist, and both in words; None for others."""
    match message:
        case MotomanReadSingleIo(address=address):
            return address > 0, f"address {address}"
        case MotomanWriteSingleIo(address=address, value=value):
            return address > 0 and value in (0, 1), f"{value} to bit {address}"
        case MotomanReadGroupIo(address=address):
            return address > 0, f"group address {address}"
        case MotomanWriteGroupIo(address=address, value=value):
            return address > 0 and 0 <= value <= 255, f"{value} to group {address}"
        case MotomanReadMregister(address=address):
            return 0 <= address < REGISTERS, f"register {address}"
        case MotomanWriteMregister(address=address, value=value):
            fits = 0 <= address < REGISTERS and 0 <= value <= LARGEST_REGISTER_VALUE
            return fits, f"{value} to register {address}"
        case MotomanSelectTool(group=group, tool=tool):
            fits = 0 <= group < MOTOMAN_GROUPS and 0 <= tool < TOOLS
            return fits, f"tool {tool} of group {group}"
    return None
