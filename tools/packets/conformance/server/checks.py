"""The register of checks on servers, and the profiles in which each is run.

Owns how a module adds one. Knows no bytes, no sockets and no verdicts.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import TYPE_CHECKING, Any

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

Body = Callable[["Target"], Coroutine[Any, Any, CheckFinding]]


ServerCheck = Check[Body]

_REGISTER: Register[Body] = Register(TestedRole.SERVER)

_ORDER = (
    *(Section.FRAMING, Section.HEADER, Section.BYTE_ORDER, Section.REPLIES, Section.TOPICS),
    *(Section.STATUS, Section.MOTION, Section.STOP, Section.LIMITS, Section.LINK),
    *(Section.MOTOMAN, Section.PENDANT),
)

check = partial(_REGISTER.add, profiles=STANDARD)
"""Registers a check on servers; see `Register.add`."""


def server_checks() -> tuple[ServerCheck, ...]:
    """Return every check on servers: those that move nothing first, sections in their order."""
    from . import (  # noqa: F401 - they register themselves, and import this module
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

    return _REGISTER.in_order(_ORDER)
