"""One walk through a program after the other, each time where there was none yet.

Owns the walk: loops are unrolled up to a bound, an input or a flag has the value that leads where
the walks have been least, and every block of moves is planned once from each start in each scene:
what the tool takes it carries from there on, and what it leaves stays there.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from openpendant.motion.scene import Scene

from ..refusal import Refusal
from .control_flow import ControlFlow, Position
from .dry_run_results import (
    BlockPlan,
    BlockRefused,
    HandOver,
    MoveVerdict,
    PlanBlock,
    Rearrange,
    ToolSample,
)
from .dry_statements import Course, StatementFindings
from .linking import Linked
from .motion_blocks import BlockMove, Gatherer, MotionBlock
from .points import JointVector
from .statements import Attach, Detach, IfFlag, IfInput, Move, Wait

MOST_STATEMENTS_WALKED = 20_000
"""Statements of one walk, loops unrolled."""

MOST_HAND_OVERS = 100
"""Objects taken and left in one walk; each makes another scene, in which all is planned anew."""

MOST_SAMPLES = 50_000
"""Samples of the tool's way that are kept of one walk."""


class Walk:
    """One way through the program.

    Attributes:
        joints: (n,) where the robot stands [rad or m].
        time: since the start [s].
        path: the tool's way, up to `MOST_SAMPLES`.
        ended: whether it came to the end of the program.
        moved: whether the robot is at a point of the program.
        scene: what stands around now; None to check nothing.
        hand_overs: how often an object changed hands.
        by_flags: whether a condition on a flag is answered as the one before on the same flag.
        course: the statements that it passed.
    """

    def __init__(self, start: JointVector, scene: Scene | None, *, by_flags: bool) -> None:
        self.joints = start
        self.by_flags = by_flags
        self.course = Course()
        self.scene = scene
        self.hand_overs = 0
        self.time = 0.0
        self.path: list[ToolSample] = []
        self.ended = False
        self.moved = False


class Walker:
    """Walks, each time where it has been least.

    Attributes:
        verdicts: what was found about moves, by program and number.
        hand_overs: likewise about what changes the scene.
        untaken: the branches that no walk took yet.
    """

    def __init__(
        self,
        linked: Linked,
        plan: PlanBlock,
        scene: Scene | None,
        rearrange: Rearrange,
        statements: StatementFindings,
    ) -> None:
        self._statements = statements
        self._flow = ControlFlow(linked)
        self._gatherer = Gatherer(self._flow)
        self._ask = plan
        self._scene = scene
        self._rearrange = rearrange
        self._plans: dict[
            tuple[JointVector, MotionBlock, Scene | None], BlockPlan | BlockRefused
        ] = {}
        self._taken: Counter[tuple[str, int, bool]] = Counter()
        self.verdicts: dict[tuple[str, int], MoveVerdict] = {}
        self.hand_overs: dict[tuple[str, int], HandOver] = {}
        self.untaken = {
            (name, index, holds)
            for name, program in linked.programs.items()
            for index, statement in enumerate(program.statements)
            if isinstance(statement, IfInput | IfFlag)
            for holds in (True, False)
        }

    def walk(self, start: JointVector, *, by_flags: bool = True) -> Walk:
        """Walk from the start of the program to its end, or to the bound.

        Args:
            start: (n,) where the robot stands [rad or m].
            by_flags: whether conditions on one flag agree, as in a run they must; where they do
                not, branches are walked that no other walk comes to.
        """
        walk = Walk(start, self._scene, by_flags=by_flags)
        position = self._flow.start()
        for _ in range(MOST_STATEMENTS_WALKED):
            if not position:
                walk.ended = True
                break
            if walk.hand_overs > MOST_HAND_OVERS:
                break
            position = self._pass(position, walk)
        return walk

    def _pass(self, position: Position, walk: Walk) -> Position:
        statement = self._flow.statement(position)
        self._statements.come_to(position, statement, walk.course)
        if self._flow.is_instant(statement):
            self._statements.pass_instant(position, walk.course)
        else:
            walk.course.take_time()
        match statement:
            case Move():
                return self._pass_moves(position, walk)
            case IfInput():
                return self._flow.branch(position, self._choice(position))
            case IfFlag():
                return self._flow.branch(position, self._flag_choice(position, statement, walk))
            case Wait(duration):
                walk.time += duration
            case Attach() | Detach():
                self._hand_over(position, statement, walk)
        behind = self._flow.after(position, {})
        if behind is None:
            raise AssertionError("conditions on flags are branched above")
        return behind

    def _flag_choice(self, position: Position, condition: IfFlag, walk: Walk) -> bool:
        """Return the branch of a condition on a flag, and remember what that makes of the flag."""
        known = walk.course.value(condition.flag) if walk.by_flags else None
        forced = None if known is None else known is condition.value
        choice = self._choice(position, forced)
        walk.course.decide(condition.flag, condition.value is choice)
        return choice

    def _choice(self, position: Position, forced: bool | None = None) -> bool:
        """Return the branch that was taken less often; the one that holds where both were even."""
        level = position[-1]
        holds = self._taken[level.program, level.index, True]
        fails = self._taken[level.program, level.index, False]
        choice = holds <= fails if forced is None else forced
        self._taken[level.program, level.index, choice] += 1
        self.untaken.discard((level.program, level.index, choice))
        return choice

    def _hand_over(self, position: Position, statement: Attach | Detach, walk: Walk) -> None:
        """Let an object change hands; where it cannot, all stays as it was."""
        if walk.scene is None:
            return
        key = position[-1].program, position[-1].index
        found = self._rearrange(walk.scene, statement, walk.joints)
        refusal = found if isinstance(found, Refusal) else None
        if not isinstance(found, Refusal):
            walk.scene = found
            walk.hand_overs += 1
        before = self.hand_overs.get(key)
        first = refusal if before is None else before.refusal or refusal
        self.hand_overs[key] = HandOver(*key, statement, first)

    def _pass_moves(self, position: Position, walk: Walk) -> Position:
        if walk.moved:
            gathered = self._gatherer.block(position, _nowhere)
        else:
            gathered, walk.moved = self._gatherer.approach(position), True
        self._plan(gathered.block, walk)
        walk.time += gathered.block.moves[-1].move.dwell
        return gathered.behind

    def _plan(self, block: MotionBlock, walk: Walk) -> None:
        """Plan a block; what follows a refused move is planned from where it should have gone."""
        moves = block.moves
        while moves:
            rest = replace(block, moves=moves)
            key = (walk.joints, rest, walk.scene)
            if key not in self._plans:
                self._plans[key] = self._ask(*key)
            found = self._plans[key]
            if isinstance(found, BlockPlan):
                self._note_path(found, walk)
                for move in moves:
                    self._note(move, None, joined=move is not moves[-1])
                return
            place = min(max(found.place, 0), len(moves) - 1)
            for move in moves[:place]:
                self._note(move, None, joined=True)
            self._note(moves[place], found.refusal, joined=False)
            walk.joints, moves = moves[place].target.joints, moves[place + 1 :]

    def _note_path(self, plan: BlockPlan, walk: Walk) -> None:
        room = MOST_SAMPLES - len(walk.path)
        walk.path += [(walk.time + time, x, y, z) for time, x, y, z in plan.path[:room]]
        walk.time += plan.duration
        walk.joints = plan.end

    def _note(self, move: BlockMove, refusal: Refusal | None, *, joined: bool) -> None:
        """Keep the first refusal of a move, whichever walk and pass found it."""
        key = (move.program, move.index)
        before = self.verdicts.get(key)
        if before is not None:
            refusal = before.refusal or refusal
            joined = before.zone_used or joined
        self.verdicts[key] = MoveVerdict(*key, move.target.name, refusal, joined)


def _nowhere(position: Position) -> bool:
    return False
