"""Arguments of RoboAnalyzer's calls, as scripts and MATLAB give them.

Owns what is taken for a number, a joint or a name, and the wording where it is none. A language
that knows no integers counts joints in floats: 1.0 is a joint, 1.5 is none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import SupportsFloat

from ..connection_errors import WrongArgument


def number(value: object, what: str) -> float:
    """Return a finite number.

    Args:
        value: of any type that has one number: of Python, of NumPy, from MATLAB.
        what: it stands for, for the error.

    Raises:
        WrongArgument: it is none.
    """
    found = math.nan
    if isinstance(value, SupportsFloat) and not isinstance(value, bool):
        try:
            found = float(value)
        except (TypeError, ValueError, OverflowError):
            found = math.nan
    if not math.isfinite(found):
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a finite number")
    return found


def whole(value: object, what: str) -> int:
    """Return a whole number; 1.0 is one; arguments and errors as above."""
    found = number(value, what)
    if not found.is_integer():
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a whole number, as 1 or 1.0")
    return int(found)


def numbers(values: object, what: str, count: int) -> list[float]:
    """Return one finite number for each joint.

    Args:
        values: a list, or whatever yields numbers.
        what: they are, in the plural, for the error.
        count: how many joints the robot has.

    Raises:
        WrongArgument: they are not so many numbers.
    """
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise WrongArgument(f"{what}: {_shown(values)}; accepted: a list of {count} numbers")
    given = list(values)
    if len(given) != count:
        raise WrongArgument(f"{len(given)} {what}; the robot has {count} joints")
    return [number(value, f"of {count} {what} number {i}") for i, value in enumerate(given, 1)]


def joint_index(value: object, count: int) -> int:
    """Return the index, from 0, of a joint that is counted from 1.

    Raises:
        WrongArgument: it is no whole number, or the robot has no such joint.
    """
    joint = whole(value, "the joint")
    if not 1 <= joint <= count:
        raise WrongArgument(f"no joint {joint}; the robot has joints 1 to {count}")
    return joint - 1


def text(value: object, what: str) -> str:
    """Return a text.

    Raises:
        WrongArgument: it is none.
    """
    if not isinstance(value, str):
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a text")
    return value


def fraction(value: object, what: str) -> float:
    """Return a number above 0, up to 1.

    Raises:
        WrongArgument: it is none.
    """
    found = number(value, what)
    if not 0.0 < found <= 1.0:
        raise WrongArgument(f"{what} is {found:g}; accepted: above 0, up to 1")
    return found


def _shown(value: object) -> str:
    return repr(value)[:80]
