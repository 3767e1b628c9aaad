"""Roles, permissions, and the one table that says which role may do what.

Owns nothing but that table: who has a role is `admission`'s business, whether the robot may move
now is the cell's.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, StrEnum
from functools import total_ordering


@total_ordering
class Role(Enum):
    """What somebody is trusted with; each role may do all that the ones before it may."""

    VIEWER = "viewer"
    """Looks on."""
    OPERATOR = "operator"
    """Moves the robot and runs programs that others wrote."""
    PROGRAMMER = "programmer"
    """Changes programs, frames, tools and the scene."""
    ADMIN = "admin"
    """Teaches a class or looks after the cell: accounts, pairing codes, taking over."""

    def __lt__(self, other: object) -> bool:
        if not isinstance(other, Role):
            return NotImplemented
        return _RANK[self] < _RANK[other]


_RANK: Mapping[Role, int] = {role: rank for rank, role in enumerate(Role)}


class Permission(StrEnum):
    """What may be asked of the server, as far as roles tell it apart."""

    OBSERVE = "observe"
    """See state, programs, frames and the scene."""
    STOP = "stop"
    """Stop the robot."""
    MOVE = "move"
    """Take the motion authority; jog and move while holding it."""
    PLAN = "plan"
    """Have plans made, for oneself or for whoever holds the motion authority, and drop them."""
    RUN_PROGRAM = "run-program"
    """Start, step, pause and resume programs and recordings."""
    SET_OUTPUT = "set-output"
    """Switch outputs by hand."""
    RESET = "reset"
    """Reset a latched stop; that moves nothing."""
    SET_MODE = "set-mode"
    """Choose the operating mode of the emulated controller."""
    EDIT_PROGRAM = "edit-program"
    """Teach points, record motions, change programs."""
    CHANGE_FRAMES = "change-frames"
    """Define and change user frames."""
    CHANGE_TOOLS = "change-tools"
    """Define, calibrate and change tools."""
    CHANGE_SCENE = "change-scene"
    """Change obstacles and what may touch what."""
    FORCE_AUTHORITY = "force-authority"
    """Take the motion authority from its holder, while the robot stands."""
    PAIR_GUESTS = "pair-guests"
    """Issue and withdraw pairing codes."""
    MANAGE_USERS = "manage-users"
    """Add, change and remove accounts."""


LEAST_ROLE: Mapping[Permission, Role] = {
    Permission.OBSERVE: Role.VIEWER,
    Permission.STOP: Role.VIEWER,
    Permission.MOVE: Role.OPERATOR,
    Permission.PLAN: Role.OPERATOR,
    Permission.RUN_PROGRAM: Role.OPERATOR,
    Permission.SET_OUTPUT: Role.OPERATOR,
    Permission.RESET: Role.OPERATOR,
    Permission.SET_MODE: Role.OPERATOR,
    Permission.EDIT_PROGRAM: Role.PROGRAMMER,
    Permission.CHANGE_FRAMES: Role.PROGRAMMER,
    Permission.CHANGE_TOOLS: Role.PROGRAMMER,
    Permission.CHANGE_SCENE: Role.PROGRAMMER,
    Permission.FORCE_AUTHORITY: Role.ADMIN,
    Permission.PAIR_GUESTS: Role.ADMIN,
    Permission.MANAGE_USERS: Role.ADMIN,
}
"""The least role that each permission needs."""

PERMISSIONS_OF: Mapping[Role, frozenset[Permission]] = {
    role: frozenset(each for each, least in LEAST_ROLE.items() if role >= least) for role in Role
}
"""All that each role includes."""

NOT_IN_VERSION_2 = frozenset({Permission.PLAN})
"""What a connection of version 2 is not told of, as it knows no request that needs it."""

WITHOUT_LOGIN = frozenset({Permission.STOP})
"""What any connection that completed hello may do, logged in or not (promise 19)."""
