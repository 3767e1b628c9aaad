"""Which permission each request of a pendant needs: the one table of it.

Owns nothing else: which role has a permission is `access.roles`' business, who has a role
`access.admission`'s. What is in no table needs the highest role, so that an operation that somebody
adds and forgets here is refused rather than open.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

from openpendant.simplemsg import Message
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Enabling,
    Hello,
    Home,
    JogBeat,
    JogRelease,
    JogStart,
    JogStep,
    JogUndo,
    JointMove,
    JointPath,
    Login,
    Management,
    MotionControl,
    MotionControlAction,
    Pairing,
    PoseMove,
    PosePath,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
)

from .roles import Permission

FREE: frozenset[type[Message]] = frozenset({Hello, Login, SoftwareStop, JogRelease})
"""What anybody may ask: to come in, to stop, and to end a press of his own."""

TOPICS: frozenset[type[Message]] = frozenset({AuthorityBeat, JogBeat, Enabling})
"""What is taken without an answer: each only prolongs, or ends, what its own connection has."""

OF_MESSAGE: Mapping[type[Message], Permission] = {
    Subscribe: Permission.OBSERVE,
    Authority: Permission.MOVE,
    JointMove: Permission.MOVE,
    PoseMove: Permission.MOVE,
    JointPath: Permission.MOVE,
    PosePath: Permission.MOVE,
    Home: Permission.MOVE,
    JogStart: Permission.MOVE,
    JogStep: Permission.MOVE,
    JogUndo: Permission.MOVE,
    SetSpeed: Permission.MOVE,
    MotionControl: Permission.RUN_PROGRAM,
    ProgramRun: Permission.RUN_PROGRAM,
    ResetStop: Permission.RESET,
    SetMode: Permission.SET_MODE,
    SetAccount: Permission.MANAGE_USERS,
    Pairing: Permission.PAIR_GUESTS,
}
"""The permission that a request with a layout of its own needs."""

FREE_OPERATIONS = frozenset({"access.whoami", "access.logout"})
"""Management operations about nobody but who asks."""

OF_OPERATION: Mapping[str, Permission] = {
    **dict.fromkeys(
        (
            "snapshot",
            "cells",
            "why",
            "jog.retreat",
            "programs.list",
            "programs.load",
            "programs.history",
            "programs.check",
            "programs.dry_run_progress",
            "recordings.list",
            "recordings.describe",
            "frames.show",
            "frames.transform",
            "scene.show",
            "scene.nearest",
            "signals.read",
            "robots.list",
            "robots.describe",
            "trace.show",
        ),
        Permission.OBSERVE,
    ),
    **dict.fromkeys(
        ("programs.breakpoints", "programs.dry_run", "recordings.play", "trace.clear"),
        Permission.RUN_PROGRAM,
    ),
    **dict.fromkeys(
        (
            "programs.create",
            "programs.save",
            "programs.delete",
            "programs.rename",
            "programs.edit",
            "programs.record",
            "programs.touch_up",
            "programs.undo",
            "programs.redo",
            "recordings.start",
            "recordings.stop",
            "recordings.trim",
            "recordings.rename",
            "recordings.delete",
        ),
        Permission.EDIT_PROGRAM,
    ),
    **dict.fromkeys(
        (
            "frames.add",
            "frames.move",
            "frames.rename",
            "frames.remove",
            "frames.teach",
            "frames.import",
        ),
        Permission.CHANGE_FRAMES,
    ),
    **dict.fromkeys(
        (
            "tools.import",
            "tools.add",
            "tools.move",
            "tools.remove",
            "tools.select",
            "tools.calibrate",
        ),
        Permission.CHANGE_TOOLS,
    ),
    **dict.fromkeys(
        (
            "scene.add",
            "scene.remove",
            "scene.move",
            "scene.allow",
            "scene.forbid",
            "scene.attach",
            "scene.detach",
            "scene.import",
            "robots.load",
        ),
        Permission.CHANGE_SCENE,
    ),
    "signals.set": Permission.SET_OUTPUT,
    "access.sessions": Permission.PAIR_GUESTS,
    **dict.fromkeys(
        ("users.list", "users.remove", "users.set_role", "users.disable", "users.enable"),
        Permission.MANAGE_USERS,
    ),
}
"""The permission that a management operation needs, by the value of `op`."""


_CHANGES = frozenset(
    {
        Permission.SET_OUTPUT,
        Permission.EDIT_PROGRAM,
        Permission.CHANGE_FRAMES,
        Permission.CHANGE_TOOLS,
        Permission.CHANGE_SCENE,
    }
)

_FROM_PENDANTS = frozenset(
    kind
    for kind in PENDANT_MESSAGES
    if kind.PLACE.direction in (Direction.TO_SERVER, Direction.BOTH)
)

IN_ORDER = frozenset(
    {
        Permission.MOVE,
        Permission.RUN_PROGRAM,
        Permission.RESET,
        Permission.SET_MODE,
        Permission.FORCE_AUTHORITY,
    }
)
"""What can move the robot or lets it move: asked in order and once (`request_order`)."""

_OPERATIONS_IN_ORDER = frozenset({"recordings.play", "signals.set"})


OVERTAKEN: Mapping[Permission, bool] = {
    Permission.OBSERVE: False,
    Permission.STOP: False,
    Permission.PAIR_GUESTS: False,
    Permission.MANAGE_USERS: False,
    Permission.EDIT_PROGRAM: False,
    Permission.CHANGE_FRAMES: False,
    Permission.CHANGE_TOOLS: False,
    Permission.CHANGE_SCENE: False,
    Permission.MOVE: True,
    Permission.RUN_PROGRAM: True,
    Permission.RESET: True,
    Permission.SET_MODE: True,
    Permission.FORCE_AUTHORITY: True,
    Permission.SET_OUTPUT: True,
}
"""Whether a request of a permission is refused where a stop of its own connection has overtaken it:
what can move, reset, grant authority, change the mode or an output would undo the stop."""

_OVERTAKEN_OPERATIONS: Mapping[str, bool] = {
    "tools.select": True,
    "scene.attach": True,
    "scene.detach": True,
    "programs.breakpoints": False,
    "programs.dry_run": False,
    "trace.clear": False,
}
"""The operations for which that is decided otherwise than by their permission: what the robot holds
in its hand goes with its outputs, and what is only calculated or noted moves nothing."""

_ONLY_END = frozenset({MotionControlAction.PAUSE, MotionControlAction.PROGRAM_STOP})


def operation_of(body: bytes) -> str:
    """Return which operation a management body names; empty where it names none."""
    try:
        asked = json.loads(body)
    except (ValueError, RecursionError):
        return ""
    named = asked.get("op") if isinstance(asked, dict) else None
    return named if isinstance(named, str) else ""


def permission_of(message: Message) -> Permission | None:
    """Return what a request needs; None where anybody that completed hello may ask it."""
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return None
        case Authority(action=AuthorityAction.FORCE):
            return Permission.FORCE_AUTHORITY
        case Management(body=body):
            operation = operation_of(body)
            if operation in FREE_OPERATIONS:
                return None
            return OF_OPERATION.get(operation, Permission.MANAGE_USERS)
    if type(message) in FREE or type(message) not in _FROM_PENDANTS:
        return None  # the pendant face knows no such request, and refuses it whoever asks
    return OF_MESSAGE.get(type(message), Permission.MANAGE_USERS)


def change_of(message: Message) -> str:
    """Return which operation changes the cell; empty where a request changes nothing."""
    if isinstance(message, Management):
        operation = operation_of(message.body)
        return operation if OF_OPERATION.get(operation) in _CHANGES else ""
    return ""


def is_in_order(message: Message) -> bool:
    """Tell whether a request can move something, so that it is taken in order and once."""
    if isinstance(message, Management):
        return operation_of(message.body) in _OPERATIONS_IN_ORDER
    return permission_of(message) in IN_ORDER


def is_overtaken(message: Message) -> bool:
    """Tell whether a request is refused where a stop that came behind it has acted already.

    What only ends something, as a pause and a release of the authority do, is taken in its turn;
    what is in no table is refused.
    """
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return False
        case MotionControl(action=action) if action in _ONLY_END:
            return False
        case Management(body=body):
            operation = operation_of(body)
            decided = _OVERTAKEN_OPERATIONS.get(operation)
            if decided is not None or operation in FREE_OPERATIONS:
                return bool(decided)
            needed = OF_OPERATION.get(operation)
        case _:
            if type(message) in FREE or type(message) not in _FROM_PENDANTS:
                return False
            needed = OF_MESSAGE.get(type(message))
    return needed is None or OVERTAKEN[needed]
