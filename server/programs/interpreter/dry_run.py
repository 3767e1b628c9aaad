"""Dry run: a program walked through without moving, with its duration, tool path and failures.

Owns the number of walks: both branches of every condition are walked, and an endless loop is passed
as often as needed to join its end with its beginning. It plans nothing itself: it asks a planner,
so it runs where the planner runs, off the event loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from openpendant.motion.scene.scene import Scene

from ...refusal import Refusal
from ..language.linking import Linked
from ..language.points import JointVector, TeachPoint
from ..language.program import Program
from ..language.statements import Attach, Detach, Loop, Move
from .dry_run_results import ENDLESS_PASSES, DryRunResult, PlanBlock, PointFinding, Rearrange
from .dry_walk import AbsentSignal, Key, StatementFindings, Walker

MOST_WALKS = 64
"""Greatest number of walks; nested conditions need several until every branch is taken."""


def _as_it_is(scene: Scene, _: Attach | Detach, __: JointVector) -> Scene:
    return scene


def dry_run(
    linked: Linked,
    start: JointVector,
    plan: PlanBlock,
    scene: Scene | None = None,
    rearrange: Rearrange = _as_it_is,
    absent: AbsentSignal | None = None,
) -> DryRunResult:
    """Walk through a program.

    Args:
        start: (n,) where the robot stands at the start [rad or m].
        plan: the planner; asked once for each block, start and scene.
        scene: what stands around at the start; None to check nothing.
        rearrange: returns the result of a statement that changes the scene.
        absent: knows the signals; None where nobody does.
    """
    bounded, endless = _bounded(linked)
    found = StatementFindings(bounded, endless, absent)
    walker = Walker(bounded, plan, scene, rearrange, found)
    first = walker.walk(start)
    ended, by_flags = first.ended, True
    for _ in range(MOST_WALKS - 1):
        if not walker.untaken:
            break
        before = len(walker.untaken)
        ended = walker.walk(start, by_flags=by_flags).ended and ended
        # Walks that no run could take, because their flags contradict each other, come last.
        by_flags = by_flags and len(walker.untaken) < before
    moves = {
        (name, index)
        for name, program in linked.programs.items()
        for index, statement in enumerate(program.statements)
        if isinstance(statement, Move)
    }
    return DryRunResult(
        duration=first.time,
        endless=bool(endless),
        complete=ended and not walker.untaken,
        path=tuple(first.path),
        moves=tuple(walker.verdicts[key] for key in sorted(walker.verdicts)),
        not_walked=tuple(sorted(moves - walker.verdicts.keys())),
        hand_overs=tuple(walker.hand_overs[key] for key in sorted(walker.hand_overs)),
        statements=tuple(found.verdicts[key] for key in sorted(found.verdicts)),
        unchecked=tuple(sorted(found.unchecked)),
    )


def reachability(
    program: Program, check: Callable[[TeachPoint], Refusal | None]
) -> tuple[PointFinding, ...]:
    """Return a verdict for every point, including those that no statement moves to.

    Args:
        check: says why a point cannot be reached; None where it can.
    """
    return tuple(PointFinding(point.name, check(point)) for point in program.points)


def _bounded(linked: Linked) -> tuple[Linked, frozenset[Key]]:
    """Return the programs with few passes for every endless loop, and the places of these."""
    endless = frozenset(
        (name, index)
        for name, program in linked.programs.items()
        for index, statement in enumerate(program.statements)
        if isinstance(statement, Loop) and statement.passes is None
    )
    programs: dict[str, Program] = {}
    for name, program in linked.programs.items():
        statements = tuple(
            replace(statement, passes=ENDLESS_PASSES)
            if isinstance(statement, Loop) and (name, index) in endless
            else statement
            for index, statement in enumerate(program.statements)
        )
        programs[name] = replace(program, statements=statements)
    return Linked(linked.main, programs), endless
