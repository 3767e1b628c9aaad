"""Linked program: a program together with all programs that it calls, directly or not.

Owns the rules of calls: every program called exists and is of the same robot, none calls itself in
a circle, and calls nest to a bounded depth. They are checked before the run, so a run meets none of
these errors half-way; and an edit during the run changes nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeAlias, TypeVar

from .printer import place_of, statement_lines
from .program import Program
from .program_errors import CallTooDeep, ProgramTooLarge, ProgramUnknown, WrongRobot
from .program_json import program_from_json

DEEPEST_CALL = 16
"""Greatest depth of calls, the first program counted."""

MOST_PROGRAMS = 100
"""Greatest number of programs of one run."""

MOST_PARTS = 10_000
"""Greatest number of points and statements of all programs of one run together."""

_Known = TypeVar("_Known")

ResolveCall: TypeAlias = Callable[[str], Program | None]
"""Returns the program of a name; None if there is none."""


@dataclass(frozen=True, slots=True)
class Linked:
    """Programs of a run.

    Attributes:
        programs: it and all that it calls, by name.
        sources: the JSON of each; empty where they were not read from one.
        revisions: the one of each that this is; empty where they do not come from the store, and in
            another process.
        lines: line of each statement of each in its canonical text, from 1.
    """

    main: str
    programs: Mapping[str, Program]
    sources: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    revisions: Mapping[str, int] = field(default_factory=dict, compare=False)
    lines: Mapping[str, tuple[int, ...]] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        lines = {name: statement_lines(program) for name, program in self.programs.items()}
        object.__setattr__(self, "lines", lines)  # a frozen dataclass allows no plain assignment

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as JSON, where that is known, to be read again in the other process."""
        if self.sources.keys() == self.programs.keys():
            return _relinked, (self.main, tuple(self.sources.items()))
        return Linked, (self.main, dict(self.programs))


@lru_cache(maxsize=2)
def _relinked(main: str, sources: tuple[tuple[str, str], ...]) -> Linked:
    """Return programs that were linked before: each slice of a dry run brings the same ones."""
    programs = {name: program_from_json(body, name) for name, body in sources}
    return Linked(main, programs, dict(sources))


def link(
    program: Program,
    resolve: ResolveCall,
    sources: Mapping[str, str] | None = None,
    revisions: Mapping[str, int] | None = None,
) -> Linked:
    """Return a program with all that it calls.

    Args:
        resolve: gives the others; asked once for each.

    Raises:
        ProgramUnknown: a program that is called is not there.
        WrongRobot: a program that is called is of another robot.
        CallTooDeep: calls go round in a circle, or too deep.
        ProgramTooLarge: these are more than `MOST_PROGRAMS`.
    """
    programs = {program.name: program}
    waiting = [program]
    while waiting:
        caller = waiting.pop()
        for index, name in caller.calls:
            if name in programs:
                continue
            called = resolve(name)
            if called is None:
                raise ProgramUnknown(name, caller.name, index, place_of(caller, index))
            if (called.robot, called.linear_axes) != (program.robot, program.linear_axes):
                raise WrongRobot(
                    f"program {name!r} was taught on {called.robot!r}; accepted in a call of"
                    f" {caller.name!r}: programs of {program.robot!r}"
                )
            if len(programs) == MOST_PROGRAMS:
                raise ProgramTooLarge("programs in one run", MOST_PROGRAMS + 1, MOST_PROGRAMS)
            programs[name] = called
            waiting.append(called)
    _check_depth(program.name, programs)
    return Linked(program.name, programs, _of(programs, sources), _of(programs, revisions))


def _of(names: Iterable[str], known: Mapping[str, _Known] | None) -> dict[str, _Known]:
    """Return the entries of these programs, and of no others."""
    return {} if known is None else {name: known[name] for name in names if name in known}


def _check_depth(main: str, programs: Mapping[str, Program]) -> None:
    """Follow every call; programs whose calls are known to end are not followed again."""
    levels: dict[str, int] = {}

    def below(name: str, chain: tuple[str, ...]) -> int:
        if name in chain:
            circle = (*chain[chain.index(name) :], name)
            raise CallTooDeep(circle, "that never ends; accepted: calls without a circle")
        if len(chain) == DEEPEST_CALL:
            raise _too_deep((*chain, name))
        if name not in levels:
            called = dict.fromkeys(other for _, other in programs[name].calls)
            deepest = max((below(other, (*chain, name)) for other in called), default=0)
            levels[name] = deepest + 1
        if len(chain) + levels[name] > DEEPEST_CALL:
            raise _too_deep((*chain, name))
        return levels[name]

    below(main, ())


def _too_deep(chain: tuple[str, ...]) -> CallTooDeep:
    problem = f"more than {DEEPEST_CALL} programs deep; accepted: up to {DEEPEST_CALL}"
    return CallTooDeep(chain, problem)
