"""Permission table: the permission that each request of a pendant needs.

A management operation declares its own. Owns nothing else: `simplemsg.pendant.roles` owns which
role has a permission, `access.admission` who has a role. A request in no table needs the highest
role: a new message that is forgotten here is then refused rather than open to everybody.
"""

from __future__ import annotations

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
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import Permission

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

CHANGES = frozenset(
    {
        Permission.SET_OUTPUT,
        Permission.EDIT_PROGRAM,
        Permission.CHANGE_FRAMES,
        Permission.CHANGE_TOOLS,
        Permission.CHANGE_SCENE,
    }
)
"""What changes programs, frames, tools, scene or outputs: such an operation is noted when asked."""

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
"""True for a permission whose requests are refused once a stop of their connection overtook them:
what can move, reset, grant authority, change the mode or an output would undo the stop."""

_ONLY_END = frozenset({MotionControlAction.PAUSE, MotionControlAction.PROGRAM_STOP})


def permission_of(message: Message) -> Permission | None:
    """Return the permission for a request; None where every connection with a hello may send it.

    Of a management request `needs_of` says it.
    """
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return None
        case Authority(action=AuthorityAction.FORCE):
            return Permission.FORCE_AUTHORITY
    if type(message) in FREE or type(message) not in _FROM_PENDANTS:
        return None  # the pendant endpoint refuses an unknown request of any role
    return OF_MESSAGE.get(type(message), Permission.MANAGE_USERS)


def needs_of(operation: str) -> Permission | None:
    """Return the permission for a management operation; that of the highest role if unknown."""
    declared = OPERATIONS.get(operation)
    return Permission.MANAGE_USERS if declared is None else declared.NEEDS


def is_overtaken(message: Message, operation: str = "") -> bool:
    """Return True if a request is refused because a STOP sent after it has acted already.

    A request that only ends something, such as a pause or a release of the authority, is executed
    in its turn; a request in no table is refused.

    Args:
        operation: the one that a management request names; empty for none.
    """
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return False
        case MotionControl(action=action) if action in _ONLY_END:
            return False
        case Management():
            declared = OPERATIONS.get(operation)
            if declared is None:
                return True
            if declared.OVERTAKEN is not None or declared.NEEDS is None:
                return bool(declared.OVERTAKEN)
            return OVERTAKEN[declared.NEEDS]
    if type(message) in FREE or type(message) not in _FROM_PENDANTS:
        return False
    needed = OF_MESSAGE.get(type(message))
    return needed is None or OVERTAKEN[needed]
