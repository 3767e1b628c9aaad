"""Dry runs in the planning process, in time slices, so that no motion waits long for one.

Owns the memory between slices: what was planned is kept in this process, and a slice walks through
it again at no cost. A process that does not have it plans anew, so no result depends on it.

Owns the cut of the findings to what fits the answer to a pendant. It is made in the planning
process, because the findings about a long program have more parts than an event loop should read.
Verdicts are left out whole, never a part of their text, because the numbers stand at its end.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias, TypeVar

import numpy as np

from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.grasping import gripped
from openpendant.motion.scene.scene import Scene, left
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant.management.program_values import TeachPoint
from openpendant.simplemsg.pendant.management.statements import Attach, Detach

from ...programs.interpreter.dry_run import AbsentSignal, dry_run, reachability
from ...programs.interpreter.dry_run_results import (
    BlockPlan,
    BlockRefused,
    DryRunResult,
    HandOver,
    MoveFinding,
    PointFinding,
    StatementFinding,
    ToolSample,
)
from ...programs.interpreter.motion_blocks import MotionBlock
from ...programs.interpreter.run_events import Offer
from ...refusal import Refusal, refusal_of
from ..jobs import DryRunFound, DryRunJob, DryRunSlice, JointVector
from .block_planning import BlockFault, Places, collision_on, placed_refusal, plan_block

MOST_VERDICTS = 100
"""Greatest number of verdicts of each kind in an answer, refusals first."""

MOST_BYTES = 50_000
"""Greatest size of verdicts and places in an answer, without the tool's path [bytes of JSON]."""

MOST_SAMPLES = 250
"""Greatest number of samples of the tool's path in an answer."""

_KEYS_BYTES = 130  # of a verdict, with its numbers

_Verdict: TypeAlias = MoveFinding | HandOver | StatementFinding | PointFinding
_Kind = TypeVar("_Kind", MoveFinding, HandOver, StatementFinding, PointFinding)
_Part = TypeVar("_Part")


def shortened(found: DryRunFound) -> DryRunFound:
    """Return the findings cut to the size of an answer; `refused` still counts all."""
    run, room = found.run, _Room(MOST_BYTES)
    # Refusals come first, the kinds with short texts before those that could fill the answer, then
    # what was not checked.
    statements = room.refused(run.statements)
    hand_overs = room.refused(run.hand_overs)
    moves = room.refused(run.moves)
    points = room.refused(found.points)
    not_walked = room.places(run.not_walked)
    unchecked = room.places(run.unchecked)
    cut = replace(
        run,
        path=_thinned(run),
        moves=room.filled(moves, run.moves),
        hand_overs=room.filled(hand_overs, run.hand_overs),
        statements=room.filled(statements, run.statements),
        not_walked=not_walked,
        unchecked=unchecked,
    )
    refused = len(run.refusals) + sum(verdict.refusal is not None for verdict in found.points)
    return DryRunFound(cut, room.filled(points, found.points), refused)


class _Room:
    """Space left in an answer."""

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
        case PointFinding(point):
            words += [point]
        case MoveFinding(program, _, point):
            words += [program, point]
        case HandOver(program, _, statement):
            words += [program, statement.scene_object]
        case StatementFinding(program):
            words += [program]
    return sum(_bytes(word) for word in words)


def _bytes(word: str) -> int:
    return len(json.dumps(word, ensure_ascii=False).encode())


def _thinned(run: DryRunResult) -> tuple[ToolSample, ...]:
    """Return some samples of the tool's path, its end included."""
    every = -(-len(run.path) // MOST_SAMPLES) or 1
    chosen = run.path[::every]
    if run.path and chosen[-1] != run.path[-1]:
        chosen = (*chosen, run.path[-1])
    return chosen


MOST_DRY_RUNS = 4
"""Greatest number of dry runs whose plans are kept; the oldest is dropped."""

_SAMPLE_PERIOD = 0.1

_Known: TypeAlias = dict[tuple[JointVector, MotionBlock, Scene | None], BlockPlan | BlockRefused]


class _SliceOver(Exception):
    """The time of a slice is up."""


class DryRuns:
    """The dry runs of one planning process."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, _Known] = OrderedDict()

    def slice(
        self,
        kinematics: Kinematics,
        job: DryRunJob,
        expired: Callable[[], bool],
        walked: list[Trajectory] | None = None,
    ) -> DryRunFound | DryRunSlice:
        """Walk on; at least one block is planned in each slice.

        Args:
            expired: returns True once the time of the slice is up.
            walked: is given the motions in their order, where the job wants them; None to drop
                them.
        """
        known = self._known.setdefault(job.run_id, {})
        self._known.move_to_end(job.run_id)
        while len(self._known) > MOST_DRY_RUNS:
            self._known.popitem(last=False)
        lines = job.linked.lines
        before = len(known)

        def plan(
            start: JointVector, block: MotionBlock, scene: Scene | None
        ) -> BlockPlan | BlockRefused:
            key = (start, block, scene)
            if key not in known:
                if len(known) > before and expired():
                    raise _SliceOver
                known[key] = _planned(kinematics, job, start, block, scene, lines)
            planned = known[key]
            motion = planned.motion if isinstance(planned, BlockPlan) else None
            if motion is not None and walked is not None:
                walked.append(motion)
            return planned

        def rearrange(scene: Scene, statement: Attach | Detach, at: JointVector) -> Scene | Refusal:
            return _rearranged(kinematics, job, scene, statement, at)

        try:
            found = dry_run(job.linked, job.start, plan, job.scene, rearrange, _absent(job.signals))
        except _SliceOver:
            return DryRunSlice(len(known))
        del self._known[job.run_id]
        places = Places(kinematics, job.frames)
        main = job.linked.programs[job.linked.main]
        return DryRunFound(found, reachability(main, lambda point: _unreachable(places, point)))


def _absent(signals: Offer) -> AbsentSignal | None:
    """Return the check for missing signals; None where the signals are unknown."""
    if isinstance(signals, Refusal):
        none: Refusal = signals
        return lambda kind, signal: none
    return None if signals is None else signals.absent


def _unreachable(places: Places, point: TeachPoint) -> Refusal | None:
    try:
        places.check(point)
    except MotionError as error:
        return refusal_of(error)
    return None


def _planned(
    kinematics: Kinematics,
    job: DryRunJob,
    start: JointVector,
    block: MotionBlock,
    scene: Scene | None,
    lines: Mapping[str, tuple[int, ...]],
) -> BlockPlan | BlockRefused:
    try:
        trajectory, _ = plan_block(kinematics, start, block, job.frames, 1.0, job.tool_speed)
    except BlockFault as fault:
        if fault.is_standing:
            return BlockPlan(0.0, start)
        move = block.moves[fault.place]
        refusal = placed_refusal(fault, move, lines[move.program][move.index])
        return BlockRefused(fault.place, refusal)
    touching = None if scene is None else _touching(kinematics, block, trajectory, scene)
    if touching is not None:
        return touching
    path = _tool_path(kinematics, trajectory)
    motion = replace(trajectory, fine=None) if job.samples else None
    return BlockPlan(trajectory.duration, trajectory.final, tuple(path), motion)


def _rearranged(
    kinematics: Kinematics,
    job: DryRunJob,
    scene: Scene,
    statement: Attach | Detach,
    at: JointVector,
) -> Scene | Refusal:
    """Return the scene after an object changed hands at a joint position, or why it cannot."""
    flange, name = kinematics.robot.tool_link, statement.scene_object

    def link_pose(link: str) -> Pose:
        return kinematics.forward(at, link=link)

    try:
        if isinstance(statement, Attach):
            return gripped(kinematics, job.frames, scene, name, at).scene
        return left(scene, name, flange, link_pose)
    except MotionError as error:
        return refusal_of(error)


def _touching(
    kinematics: Kinematics, block: MotionBlock, trajectory: Trajectory, scene: Scene
) -> BlockRefused | None:
    """Return the first move of a block on whose way something touches; None where nothing does."""
    ends = np.searchsorted(trajectory.times, trajectory.waypoint_times).tolist()
    if len(ends) != len(block.moves) + 1:
        # A spline is one move through several points.
        ends = [0, len(trajectory) - 1]
    for place, (begin, end) in enumerate(pairwise(ends)):
        way = trajectory.position[begin : max(end, begin + 1) + 1]
        try:
            refusal = collision_on(kinematics, way, scene)
        except MotionError as error:
            refusal = refusal_of(error)
        if refusal is not None:
            return BlockRefused(place, refusal)
    return None


def _tool_path(kinematics: Kinematics, trajectory: Trajectory) -> Sequence[ToolSample]:
    """Return where the tool link is, about every tenth of a second and at the end."""
    period = trajectory.duration / max(len(trajectory) - 1, 1)
    every = max(round(_SAMPLE_PERIOD / period), 1) if period else 1
    chosen = sorted({*range(0, len(trajectory), every), len(trajectory) - 1})
    samples: list[ToolSample] = []
    for index in chosen:
        x, y, z = kinematics.forward(trajectory.position[index]).position.tolist()
        samples.append((float(trajectory.times[index]), x, y, z))
    return samples
