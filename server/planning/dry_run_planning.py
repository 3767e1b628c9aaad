"""Dry runs in the planning process, in slices, so that no motion waits long for one.

Owns the memory between slices: what was planned is kept in this process, and a slice walks through
it again for nothing. A process that does not have it begins anew, so nothing depends on it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene import Scene
from openpendant.motion.trajectory import Trajectory

from ..programs.dry_run import dry_run, reachability
from ..programs.dry_run_results import BlockPlan, BlockRefused, ToolSample
from ..programs.dry_statements import AbsentSignal
from ..programs.motion_blocks import MotionBlock
from ..programs.points import TeachPoint
from ..programs.statements import Attach, Detach
from ..refusal import Refusal, refusal_of
from ..world.carrying import left, taken
from ..world.offered_signals import Offer
from .block_planning import BlockFault, Places, placed_refusal, plan_block
from .jobs import DryRunFound, DryRunJob, DryRunSlice, JointVector
from .way_check import collision_on

MOST_DRY_RUNS = 4
"""Dry runs whose plans are kept at once; the oldest is forgotten."""

_SAMPLE_PERIOD = 0.1

_Known: TypeAlias = dict[tuple[JointVector, MotionBlock, Scene | None], BlockPlan | BlockRefused]


class _SliceOver(Exception):
    """The time of a slice is up."""


class DryRuns:
    """The dry runs of one planning process."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, _Known] = OrderedDict()

    def slice(
        self, kinematics: Kinematics, job: DryRunJob, expired: Callable[[], bool]
    ) -> DryRunFound | DryRunSlice:
        """Walk on; at least one block is planned in each slice.

        Args:
            kinematics: the robot.
            job: the dry run.
            expired: tells whether the time of the slice is up.
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
            return known[key]

        def rearrange(scene: Scene, statement: Attach | Detach, at: JointVector) -> Scene | Refusal:
            return _rearranged(kinematics, scene, statement, at)

        try:
            found = dry_run(job.linked, job.start, plan, job.scene, rearrange, _absent(job.signals))
        except _SliceOver:
            return DryRunSlice(len(known))
        del self._known[job.run_id]
        places = Places(kinematics, job.frames)
        main = job.linked.programs[job.linked.main]
        return DryRunFound(found, reachability(main, lambda point: _unreachable(places, point)))


def _absent(signals: Offer) -> AbsentSignal | None:
    """Return what tells why there is no such signal; None where nobody knows."""
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
    return BlockPlan(trajectory.duration, trajectory.final, tuple(path))


def _rearranged(
    kinematics: Kinematics, scene: Scene, statement: Attach | Detach, at: JointVector
) -> Scene | Refusal:
    """Return the scene after an object changed hands at a joint position, or why it cannot."""
    flange, name = kinematics.robot.tool_link, statement.scene_object

    def link_pose(link: str) -> Pose:
        return kinematics.forward(at, link=link)

    try:
        if isinstance(statement, Attach):
            return taken(scene, name, flange, link_pose(flange))
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
