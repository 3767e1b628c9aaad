"""The register of checks on servers, and the profiles in which each is run.

Owns how a module adds one. Knows no bytes, no sockets and no verdicts.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, Unpack

from ..check import Check, CheckFinding, Profile, Register, Section, TestedRole

if TYPE_CHECKING:
    from .target import Target


ANY = frozenset({Profile.MINIMUM, Profile.GENERIC, Profile.MOTOMAN})
"""Every controller, Motoman's too."""

STANDARD = frozenset({Profile.MINIMUM, Profile.GENERIC})
"""Every controller that takes standard points."""

FULL = frozenset({Profile.GENERIC})
"""Controllers that claim all of ROS-Industrial."""

DIALECT = frozenset({Profile.MOTOMAN})
"""Controllers that speak the Motoman dialect."""

Body = Callable[["Target"], Coroutine[Any, Any, CheckFinding | None]]
"""Looks at a target and returns what was found; None where the rule holds and nothing is to say."""

ServerCheck = Check[Body]

_REGISTER: Register[Body] = Register(TestedRole.SERVER)

_ORDER = (
    *(Section.FRAMING, Section.HEADER, Section.BYTE_ORDER, Section.REPLIES, Section.TOPICS),
    *(Section.STATUS, Section.MOTION, Section.STOP, Section.LIMITS, Section.LINK),
    *(Section.MOTOMAN, Section.PENDANT),
)

_Given = TypeVar("_Given")


class How(TypedDict, total=False):
    """Options of a check; see `Check`."""

    moves: bool
    profiles: frozenset[Profile]
    is_plain: bool
    deadline: float


def check(number: str, **how: Unpack[How]) -> Callable[[Body], Body]:
    """Register a check on servers; see `Register.add`."""
    how.setdefault("profiles", STANDARD)
    return _REGISTER.add(number, **how)


def check_on(
    given: Callable[[Target], Awaitable[_Given]], number: str, **how: Unpack[How]
) -> Callable[[Callable[[_Given], Coroutine[Any, Any, CheckFinding | None]]], Body]:
    """Register a check of something that is had of the target first."""

    def register(judge: Callable[[_Given], Coroutine[Any, Any, CheckFinding | None]]) -> Body:
        async def body(target: Target) -> CheckFinding | None:
            return await judge(await given(target))

        return check(number, **how)(body)

    return register


def server_checks() -> tuple[ServerCheck, ...]:
    """Return every check on servers: those that move nothing first, sections in their order."""
    from . import (  # noqa: F401 - they register themselves, and import this module
        framing,
        limits,
        link,
        motion,
        motoman,
        pendant,
        pendant_motion,
        replies,
        state,
        stop,
    )

    return _REGISTER.in_order(_ORDER)
