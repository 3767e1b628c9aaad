"""The register of checks on servers: number, clause, and the profiles in which each is run.

Owns what a check is and how a module adds one. Knows no bytes, no sockets and no verdicts.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from ..findings import CheckInfo, Finding, Section

if TYPE_CHECKING:
    from .target import Target


class Profile(Enum):
    """What a server is judged as; a check outside the profile is not run and not listed."""

    MINIMUM = "minimum"
    """What a home-made controller must do to be driven: docs/minimum-controller.md."""
    GENERIC = "generic"
    """All of ROS-Industrial simple message."""
    MOTOMAN = "motoman"
    """The Motoman dialect, MotoROS for ROS 1."""
    PENDANT = "pendant"
    """The pendant port of our own server and nothing else."""


ANY = frozenset({Profile.MINIMUM, Profile.GENERIC, Profile.MOTOMAN})
"""Every controller, Motoman's too."""

STANDARD = frozenset({Profile.MINIMUM, Profile.GENERIC})
"""Every controller that takes standard points."""

FULL = frozenset({Profile.GENERIC})
"""Controllers that claim all of ROS-Industrial."""

DIALECT = frozenset({Profile.MOTOMAN})
"""Controllers that speak the Motoman dialect."""

Body = Callable[["Target"], Coroutine[Any, Any, Finding]]


@dataclass(frozen=True, slots=True)
class ServerCheck:
    """One check on a server.

    Attributes:
        info: its identity.
        profiles: where it is run.
        body: looks and judges.
        is_plain: it sends nothing, or nothing but whole points of standard form, STOP among them;
            only such a check is run on a target that does not tell frames apart by their header.
        deadline: it must be done by then [s]; what it leaves behind is put in order afterwards.
    """

    info: CheckInfo
    profiles: frozenset[Profile]
    body: Body
    deadline: float
    is_plain: bool = False


_REGISTER: dict[str, ServerCheck] = {}


def check(
    number: str,
    title: str,
    clause: str,
    section: Section,
    *,
    moves: bool = False,
    profiles: frozenset[Profile] = STANDARD,
    is_plain: bool = False,
    deadline: float = 30.0,
) -> Callable[[Body], Body]:
    """Register a check.

    Args:
        number: section letter, `S`, two digits; never reused.
        title: what must hold, as a sentence.
        clause: what gives it reason.
        section: what it is about.
        moves: it can only be judged by moving the robot.
        profiles: where it is run.
        is_plain: it sends nothing but whole points of standard form; see `ServerCheck`.
        deadline: it must be done by then [s].

    Raises:
        ValueError: the number is taken or does not belong to the section.
    """
    if number in _REGISTER or number[:2] != f"{section.value}S" or not number[2:].isdigit():
        raise ValueError(f"{number} is taken, or no number of the section {section.name}")

    def register(body: Body) -> Body:
        info = CheckInfo(number, title, clause, section, moves)
        _REGISTER[number] = ServerCheck(info, profiles, body, deadline, is_plain)
        return body

    return register


def server_checks() -> tuple[ServerCheck, ...]:
    """Return every check on servers: those that move nothing first, sections in their order."""
    from . import (  # they register themselves, and import this module
        byte_order,
        framing,
        headers,
        limits,
        link,
        motion,
        motoman,
        pendant,
        pendant_motion,
        replies,
        state,
        status,
        stop,
    )

    modules = (
        framing,
        headers,
        byte_order,
        replies,
        state,
        status,
        motion,
        stop,
        limits,
        link,
        motoman,
        pendant,
        pendant_motion,
    )
    home = {module.__name__: place for place, module in enumerate(modules)}
    return tuple(
        sorted(
            _REGISTER.values(),
            key=lambda entry: (home[entry.body.__module__], entry.info.number),
        )
    )
