"""What of a dry run's findings is told: as much as fits the answer to a pendant.

Owns the cut. It is made in the planning process, because the findings about a long program have
more parts than an event loop should read. Verdicts are left out whole, never a part of their text:
the numbers stand at its end.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

from ..programs.dry_run_results import (
    DryRun,
    HandOver,
    MoveVerdict,
    PointVerdict,
    StatementVerdict,
    ToolSample,
)
from .jobs import DryRunFound

MOST_VERDICTS = 100
"""Verdicts of each kind in an answer, those that refuse first."""

MOST_BYTES = 50_000
"""All verdicts and places in an answer together [bytes of JSON]; the rest is the tool's way."""

MOST_SAMPLES = 250
"""Samples of the tool's way in an answer."""

_KEYS_BYTES = 130  # of a verdict, with its numbers

_Verdict: TypeAlias = MoveVerdict | HandOver | StatementVerdict | PointVerdict
_Kind = TypeVar("_Kind", MoveVerdict, HandOver, StatementVerdict, PointVerdict)
_Part = TypeVar("_Part")


def shortened(found: DryRunFound) -> DryRunFound:
    """Return the findings cut to what is told; `refused` still counts all."""
    run, room = found.run, _Room(MOST_BYTES)
    # What is refused comes first, the kinds with short texts before those that could fill all, then
    # what was not looked at.
    statements = room.refused(run.statements)
    hand_overs = room.refused(run.hand_overs)
    moves = room.refused(run.moves)
    points = room.refused(found.points)
    not_walked = room.places(run.not_walked)
    unchecked = room.places(run.unchecked)
    told = replace(
        run,
        path=_thinned(run),
        moves=room.filled(moves, run.moves),
        hand_overs=room.filled(hand_overs, run.hand_overs),
        statements=room.filled(statements, run.statements),
        not_walked=not_walked,
        unchecked=unchecked,
    )
    refused = len(run.refusals) + sum(verdict.refusal is not None for verdict in found.points)
    return DryRunFound(told, room.filled(points, found.points), refused)


class _Room:
    """What is left of an answer."""

    def __init__(self, size: int) -> None:
        self._left = size

    def refused(self, verdicts: Iterable[_Kind]) -> list[_Kind]:
        """Take verdicts that refuse, as many as fit."""
        found = [verdict for verdict in verdicts if verdict.refusal is not None]
        return self._take(found[:MOST_VERDICTS], _size)

    def filled(self, taken: list[_Kind], verdicts: Iterable[_Kind]) -> tuple[_Kind, ...]:
        """Add verdicts that refuse nothing, as many as fit."""
        found = [verdict for verdict in verdicts if verdict.refusal is None]
        more: list[_Kind] = self._take(found[: MOST_VERDICTS - len(taken)], _size)
        return tuple(taken + more)

    def places(self, places: Sequence[tuple[str, int]]) -> tuple[tuple[str, int], ...]:
        """Take places of statements, as many as fit."""
        return tuple(self._take(places[:MOST_VERDICTS], lambda place: _bytes(place[0])))

    def _take(self, parts: Iterable[_Part], size: Callable[[_Part], int]) -> list[_Part]:
        taken: list[_Part] = []
        for part in parts:
            needed = _KEYS_BYTES + size(part)
            if needed > self._left:
                break
            self._left -= needed
            taken.append(part)
        return taken


def _size(verdict: _Verdict) -> int:
    """Return the bytes of a verdict's own words in an answer."""
    words = [] if verdict.refusal is None else [verdict.refusal.sentence]
    match verdict:
        case PointVerdict(point):
            words += [point]
        case MoveVerdict(program, _, point):
            words += [program, point]
        case HandOver(program, _, statement):
            words += [program, statement.scene_object]
        case StatementVerdict(program):
            words += [program]
    return sum(_bytes(word) for word in words)


def _bytes(word: str) -> int:
    return len(json.dumps(word, ensure_ascii=False).encode())


def _thinned(run: DryRun) -> tuple[ToolSample, ...]:
    """Return some samples of the tool's way, its end among them."""
    every = -(-len(run.path) // MOST_SAMPLES) or 1
    chosen = run.path[::every]
    if run.path and chosen[-1] != run.path[-1]:
        chosen = (*chosen, run.path[-1])
    return chosen
