"""Work in steps, so that an event loop can do other work in between.

The work is a generator: before each step it yields about how long that will take, and at the end it
returns its result. The effort is counted, not timed, so that whoever spreads the steps over turns
by it spreads them in the same way each time.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeAlias, TypeVar

_Result = TypeVar("_Result")

Stepwise: TypeAlias = Generator[float, None, _Result]
"""Yields before each step how long it will take on an ordinary machine [µs]."""


def at_once(steps: Stepwise[_Result]) -> _Result:
    """Take all steps, and return what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: _Result = end.value
            return result
