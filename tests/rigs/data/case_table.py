"""Many cases in one test: every one of them is run, and each that fails is told by its id.

Collecting a test costs more than most cases do, and in each worker: thousands of cases that are
alike are cases of one test, not tests.
"""

import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

import pytest

CASE_VARIABLE = "OPENPENDANT_CASE"
"""Names the one case to run, in whichever tests have it."""

MOST_TOLD = 50

_Case = TypeVar("_Case")


def every(cases: Iterable[tuple[str, _Case]], check: Callable[[_Case], None]) -> None:
    """Run a check on each case, and fail with all that failed.

    Args:
        cases: each with an id that no other of them has.
        check: raises what is wrong with one of them.

    Raises:
        AssertionError: cases failed: how many, and up to 50 of them, a line each: its id, the first
            line of what was wrong, and where. Or there was no case, or two had the same id.
    """
    __tracebackhide__ = True
    cases = list(cases)
    assert cases, "there is no case to run"
    twice = [name for name, times in Counter(name for name, _ in cases).items() if times > 1]
    assert not twice, f"ids of more than one case: {', '.join(twice[:MOST_TOLD])}"
    if chosen := os.environ.get(CASE_VARIABLE):
        cases = [(name, case) for name, case in cases if name == chosen]
        if not cases:
            pytest.skip(f"no case is called {chosen}")
    failures = [f"{name}: {said}" for name, case in cases if (said := _failure(check, case))]
    if failures:
        told = failures[:MOST_TOLD]
        if len(failures) > MOST_TOLD:
            told.append(f"and {len(failures) - MOST_TOLD} more")
        head = f"{len(failures)} of {len(cases)} cases fail; {CASE_VARIABLE}=ID runs one alone"
        raise AssertionError("\n".join([head, *told]))


def _failure(check: Callable[[_Case], None], case: _Case) -> str:
    """Return what is wrong with a case, in one line; nothing where all is well."""
    try:
        check(case)
    except (Exception, pytest.fail.Exception) as error:
        kind = "" if isinstance(error, AssertionError) else f"{type(error).__name__}: "
        first = (str(error).splitlines() or ["assert"])[0]
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{kind}{first} ({Path(place.filename).name}:{place.lineno})"
    return ""


def same(found: str, expected: str) -> None:
    """Fail where two texts differ, with their first difference.

    Raises:
        AssertionError: they differ: from which character on, and what stands there in each.
    """
    if found != expected:
        pairs = enumerate(zip(found, expected, strict=False))
        at = next(
            (at for at, (ours, theirs) in pairs if ours != theirs), min(map(len, (found, expected)))
        )
        raise AssertionError(
            f"differs from character {at}: …{found[at : at + 24]!r} "
            f"where …{expected[at : at + 24]!r} is expected"
        )
