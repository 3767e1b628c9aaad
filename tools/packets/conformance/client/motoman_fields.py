"""Checks of what the messages to a Motoman controller say: fields, groups, commands, addresses."""

from __future__ import annotations

from openpendant.simplemsg import MsgType, ValidField
from openpendant.simplemsg.motoman import (
    MOTOMAN_GROUPS,
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanReadGroupIo,
    MotomanReadMregister,
    MotomanReadSingleIo,
    MotomanSelectTool,
    MotomanWriteGroupIo,
    MotomanWriteMregister,
    MotomanWriteSingleIo,
)

from ..findings import Finding
from .check import ClientCheck, Observed, Problem, Tally, each
from .motoman import motoman_check
from .setup import Purpose
from .trace import Frame
from .trajectories import Step

COMMANDS = (200101, 200102, 200111, 200112, 200113, 200114, 200121, 200122, 200130)
NEEDED = ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY

LONGEST_TIME = 14_400.0
"""The controller takes no point later than this [s]."""

TOOLS = 64
REGISTERS = 1_000
LARGEST_REGISTER_VALUE = 65_535

NO_POINT = "the client sent no point"


@motoman_check(
    "YC07",
    "points have time, position and velocity",
    "MotionServer.c: INVALID/3015 without",
)
def fields_complete(seen: Observed) -> Finding:
    """Look at the bits of each point."""

    def rule(step: Step) -> Problem | None:
        lacking = [part.valid for part in step.parts if part.valid & NEEDED != NEEDED]
        return f"valid_fields {lacking[0] & 15}" if lacking else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check(
    "YC08",
    "points are of type 14 or 2016",
    "MotionServer.c: type 11 is unknown (INVALID/3003)",
)
def point_type(seen: Observed) -> Finding:
    """Look at the type of each point."""
    types = (MsgType.JOINT_TRAJ_PT_FULL, 2016)
    return each(
        seen.motions.steps,
        lambda step: None if step.frame.msg_type in types else f"type {step.frame.msg_type}",
        NO_POINT,
    )


@motoman_check(
    "YC09",
    "no point lies four hours or more after the first",
    "MotionServer.c: INVALID/3016 from 14,400 s on",
)
def not_too_late(seen: Observed) -> Finding:
    """Look at the time of each point."""

    def rule(step: Step) -> Problem | None:
        late = [part.time for part in step.parts if part.time and part.time >= LONGEST_TIME]
        return f"time {late[0]:g} s" if late else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check(
    "YC10",
    "a point of several groups is padded with zeros, if at all",
    "MotionServer.c takes a record for each group, or four; motoman_driver sends no padding",
)
def padding_is_zero(seen: Observed) -> Finding:
    """Look at the records behind those that are meant."""

    def rule(frame: Frame) -> Problem | None:
        message = frame.message
        assert isinstance(message, MotomanJointTrajPtFullEx)
        padding = message.groups[message.num_groups :]
        used = [any((*group.positions, *group.velocities, group.time)) for group in padding]
        return "unused records are not zero" if any(used) else None

    frames = [f for f in seen.trace.sent if isinstance(f.message, MotomanJointTrajPtFullEx)]
    return each(frames, rule, "the client sent no point of several groups")


@motoman_check(
    "YC11",
    "each group is named once and exists",
    "MotionServer.c: INVALID/3004; a controller has groups 0 to 3",
)
def groups_exist(seen: Observed) -> Finding:
    """Look at the groups of each point."""

    def rule(step: Step) -> Problem | None:
        groups = [part.group for part in step.parts]
        strange = [group for group in groups if not 0 <= group < MOTOMAN_GROUPS]
        if strange:
            return f"group {strange[0]}"
        return f"groups {groups}" if len(set(groups)) < len(groups) else None

    return each(seen.motions.steps, rule, NO_POINT)


@motoman_check(
    "YC13",
    "motion control uses commands that exist, with empty data",
    "motoman_driver motion_ctrl.h; MotionServer.c leaves an unknown command without a new reply",
)
def commands_exist(seen: Observed) -> Finding:
    """Look at each motion control message."""

    def rule(frame: Frame) -> Problem | None:
        message = frame.message
        assert isinstance(message, MotomanMotionCtrl)
        if message.command not in COMMANDS:
            return f"command {message.command}"
        return "data that is not zero" if any(message.data) else None

    frames = [f for f in seen.trace.sent if isinstance(f.message, MotomanMotionCtrl)]
    return each(frames, rule, "the client sent no motion control")


@motoman_check(
    "YC14",
    "I/O, register and tool requests name what can exist",
    "motoman_driver IoServer.c: 1001 to 1003 otherwise; SELECT_TOOL: INVALID/3017",
)
def io_exists(seen: Observed) -> Finding:
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


CHECKS: tuple[ClientCheck, ...] = (
    fields_complete,
    point_type,
    not_too_late,
    padding_is_zero,
    groups_exist,
    commands_exist,
    io_exists,
)
