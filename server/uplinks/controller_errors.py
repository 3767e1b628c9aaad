"""What the error numbers mean that a controller shows in its status.

Owns the words. STATUS carries a number and no vendor's are alike, so the words are said to be those
of the emulated controller, whose numbers a controller made after `docs/minimum-controller.md` has
too. Decides nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

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
