"""An uplink: how set-points are written for a controller of one dialect, and its answers judged.

A dialect is a file of this folder and a line of the table in `uplinks`. Nothing else of the server
names one: whoever speaks to a controller gets its dialect from that table.

Owns the words for the error numbers that a controller shows in its status. No vendor's are alike,
so the words are said to be those of the emulated controller, whose numbers a controller made after
`docs/minimum-controller.md` has too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg import Message

from ..refusal import Refusal
from ..settings.cell_settings import ControllerLink
from .declaration import Declaration


class Uplink(Protocol):
    """Writes set-points and reads answers of one controller.

    Attributes:
        stop_deadline: until when a STOP is to be answered [ns]; None where none is.
    """

    stop_deadline: int | None

    @property
    def awaiting(self) -> bool:
        """Whether a point was sent and not answered yet."""

    @property
    def is_full(self) -> bool:
        """Whether the next point has to wait for an answer."""

    def point(self, number: int, row: Row, step: float, now: int) -> Message:
        """Return the message for a set-point, and expect its answer.

        Args:
            number: its number in the trajectory, from 0.
            row: its time from the start of the trajectory and its values.
            step: time since the set-point before it [s]; 0 for the first.
        """

    def stop(self, now: int, *, is_sent: bool) -> Message:
        """Return the message that stops the robot and empties the controller's buffer.

        Args:
            is_sent: the motion link is up, so that an answer is to be expected there.
        """

    def answer(self, reply: Message, pending: int) -> Refusal | None:
        """Judge an answer on the motion link.

        Args:
            pending: answers that the link still owes after this one.

        Returns:
            None where it is a success, else why the motion must end.
        """

    def overdue(self, now: int) -> Refusal | None:
        """Return why a motion must end where the answer to a point is outstanding for too long."""

    def stop_overdue(self, now: int) -> bool:
        """Return True, once, if a STOP was not answered: then the link is dead, or the peer is."""

    def lost(self) -> None:
        """Forget what was under way, because the motion link is gone."""


@dataclass(frozen=True, slots=True)
class ControllerDialect:
    """The dialect of controllers of one kind.

    Attributes:
        uplink: makes an uplink with nothing under way, from the link's settings and the largest
            joint speeds, (n,) [rad/s or m/s].
        declared: tells what a controller with these settings can do.
    """

    uplink: Callable[[ControllerLink, Sequence[float]], Uplink]
    stop: Message
    stopped: Message
    declared: Callable[[ControllerLink], Declaration]


WORDS: Mapping[int, str] = {
    101: "a value of a point is not finite",
    102: "a point is outside a joint's range",
    103: "a point is faster than a joint may be",
    104: "a point is sharper than a joint may accelerate",
    105: "the time of a point does not advance",
    106: "a point came out of order",
    107: "the motion does not start where the robot stands",
    108: "a point is not usable: of another group, or without time or position",
    109: "a buffer under-run: points came too late",
    110: "its buffer overflowed",
    111: "its motion connection was lost",
}
"""By the numbers of `docs/emulator.md`."""


UNDER_RUNS = (-1, 109)
"""What a controller may show that ran out of points: an error without a number, or this one."""


def error_text(number: int) -> str:
    """Return an error number, and what it means to an emulated controller where it has one."""
    words = WORDS.get(number)
    return f"error {number}" if words is None else f"error {number} (emulated controller: {words})"
