"""Declaration of a controller dialect: what a controller of its kind can do, as data.

Pendants are told it by `controller.describe`, and requests that the controller cannot carry out are
refused by it. Owns the words of each choice and which of them go together; the values are the
dialect's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class Feeding(StrEnum):
    """How a planned motion goes to the controller."""

    STREAM = "stream"
    """Set-points as they are planned, at most a lead ahead of the robot."""
    KNOTS = "knots"
    """Few points, between which the controller interpolates."""
    DOWNLOAD = "download"
    """All points of a part in one batch."""


class JogSupport(StrEnum):
    """Which jogs the controller takes."""

    CONTINUOUS = "continuous"
    """Hold-to-run and increments."""
    INCREMENTS = "increments"
    NONE = "none"


class PauseSupport(StrEnum):
    """Whether a motion can be paused."""

    PATH = "path"
    """On its path, to be resumed from there."""
    NONE = "none"


class FreezeProtection(StrEnum):
    """What stops the robot where the server's process stands still."""

    SECOND_CONNECTION = "second connection"
    LINK_SHUTDOWN = "link shutdown"
    OWN_TIMEOUT = "controller's own timeout"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Declaration:
    """What a controller can do.

    Attributes:
        dialect: its name in the table of dialects.
        override: when the speed override acts: `live`, `before start` or `none`.
        points: type of the messages that points travel in.
        in_flight: points that may wait for their answers at once.
        most_points: of one part of a motion; None for no bound.
        lead: how far points of a planned motion are sent ahead of the robot [s].
        interpolation: of the controller between points, in words.
        path_tolerance: of that interpolation at the tool [m]; 0 where it goes through every point.
        angle_tolerance: likewise [rad].
        speed_enforced_by: `server` or `controller`.
        second_stop: whether STOP has a connection of its own.
        link_loss_stops: whether the robot stops by itself where its motion connection is lost.
        residual_delay: from a STOP that arrived to the begin of the robot's ramp [s].
        blind_delay: likewise from the last that could be delivered [s].
        following: `due` where a report is held against what was due, `place` against the place on
            the path.
        state_period: of its reports [s].
        fresh_age: a new motion begins from a report that is no older [s].
        abort_age: a motion ends where the newest report is older [s].
        identify: what tells that it is the robot's own controller.
        start_tolerance: how far a motion may begin from where the robot stands [rad or m]; None for
            no bound.
        signals: `openpendant` where it has some for the server, else `none`.
        reply_deadlines: by what is to be answered, or to happen, within so long [s].
        freeze_protection: what stops the robot where the server's process stands still.
    """

    dialect: str
    feeding: Feeding
    jog: JogSupport
    pause: PauseSupport
    override: str
    points: int
    in_flight: int
    most_points: int | None
    lead: float
    interpolation: str
    path_tolerance: float
    angle_tolerance: float
    speed_enforced_by: str
    second_stop: bool
    link_loss_stops: bool
    residual_delay: float
    blind_delay: float
    following: str
    state_period: float
    fresh_age: float
    abort_age: float
    identify: tuple[str, ...]
    start_tolerance: float | None
    signals: str
    reply_deadlines: Mapping[str, float]
    freeze_protection: FreezeProtection

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: two of the choices contradict each other, or a deadline is none.
        """
        if self.jog is JogSupport.CONTINUOUS and self.feeding is Feeding.DOWNLOAD:
            raise ValueError("a jog that lasts as long as its key cannot be downloaded")
        is_protected = self.freeze_protection is FreezeProtection.SECOND_CONNECTION
        if is_protected is not self.second_stop:
            raise ValueError("a freeze is stopped over a second connection where there is one")
        if min(self.reply_deadlines.values(), default=1.0) <= 0:
            raise ValueError("a reply deadline is above 0")
