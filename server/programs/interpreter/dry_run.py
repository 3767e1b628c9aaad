"""Dry run: a program walked through without moving, with its duration, tool path and failures.

Owns the walk: loops are unrolled up to a bound, an input or a flag has the value that leads where
the walks have been least, and every block of moves is planned once from each start in each scene.
An object that the tool takes is carried from there on, and one that it leaves stays there.

Owns the number of walks: both branches of every condition are walked, and an endless loop is passed
as often as needed to join its end with its beginning. It plans nothing itself: it asks a planner,
so it runs where the planner runs, off the event loop.

Owns the findings about the statements that do not move, and which of these would end a run whenever
it reached them: a signal that the controller does not have, a flag that no input was read into, a
loop that repeats in no time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Literal, TypeAlias

from openpendant.motion.scene.scene import Scene
from openpendant.simplemsg.pendant.management.program_values import JointVector, TeachPoint
from openpendant.simplemsg.pendant.management.statements import (
    Attach,
    Detach,
    End,
    IfFlag,
    IfInput,
    Loop,
    Move,
    ReadInput,
    SetOutput,
    Statement,
    Wait,
    WaitInput,
)

from ...refusal import Refusal
from ..language.linking import Linked
from ..language.program import Program
from .control_flow import ControlFlow, Position
from .dry_run_results import (
    ENDLESS_PASSES,
    BlockPlan,
    BlockRefused,
    DryRunResult,
    HandOver,
    MoveFinding,
    PlanBlock,
    PointFinding,
    Rearrange,
    StatementFinding,
    ToolSample,
)
from .motion_blocks import (
    MOST_INSTANT_STATEMENTS,
    BlockMove,
    Gatherer,
    MotionBlock,
    flag_not_read,
    going_round,
)

AbsentSignal: TypeAlias = Callable[[Literal["input", "output"], int], Refusal | None]
"""Returns why there is no such signal; None where there is one."""

Key: TypeAlias = tuple[str, int]
"""Name of a program and number of a statement, from 0."""


class Course:
    """Record of the statements that one walk has passed.

    Attributes:
        is_possible: no condition on a flag was taken against what an earlier one made of it.
    """

    def __init__(self) -> None:
        self.is_possible = True
        self._flags: dict[str, bool | None] = {}
        self._slow = 0
        self._instants = 0
        self._passes: dict[Key, int] = {}

    def is_read(self, flag: str) -> bool:
        """Return True if an input was read into a flag."""
        return flag in self._flags

    def value(self, flag: str) -> bool | None:
        """Return the value that earlier conditions gave a flag; None where any is possible."""
        return self._flags.get(flag)

    def read(self, flag: str) -> None:
        """Record that an input is read into a flag, so that any value is possible."""
        self._flags[flag] = None

    def decide(self, flag: str, value: bool) -> None:
        """Record that a condition is answered as if a flag had a value."""
        if not self.is_read(flag):
            return
        self.is_possible &= self._flags[flag] in (None, value)
        self._flags[flag] = value

    def begin_pass(self, loop: Key) -> None:
        """Record the start of a pass of a loop."""
        self._passes[loop] = self._slow

    def is_idle(self, loop: Key) -> bool:
        """Return True if nothing took time since the start of the pass of a loop."""
        return self._passes.get(loop) == self._slow

    def take_time(self) -> None:
        """Record that a statement took time, or asked for something."""
        self._slow += 1
        self._instants = 0

    def take_none(self) -> bool:
        """Record that a statement took no time; return True if so many end a run."""
        self._instants += 1
        return self._instants >= MOST_INSTANT_STATEMENTS


class StatementFindings:
    """Findings about statements that do not move.

    Attributes:
        unchecked: statements with signals, where nobody knows which the controller has.
    """

    def __init__(
        self, linked: Linked, endless: frozenset[Key], absent: AbsentSignal | None
    ) -> None:
        """Start without findings.

        Args:
            endless: the loops that a run never leaves.
            absent: knows the signals; None where nobody does.
        """
        self.verdicts: dict[Key, StatementFinding] = {}
        self.unchecked: set[Key] = set()
        self._linked = linked
        self._endless = endless
        self._absent = absent
        self._flags_read = {
            statement.flag
            for program in linked.programs.values()
            for statement in program.statements
            if isinstance(statement, ReadInput)
        }

    def come_to(self, position: Position, statement: Statement, course: Course) -> None:
        """Check a statement that a walk comes to."""
        key = position[-1].program, position[-1].index
        match statement:
            case WaitInput(signal) | ReadInput(signal) | IfInput(signal):
                self._look_at_signal(key, statement, "input", signal)
            case SetOutput(signal):
                self._look_at_signal(key, statement, "output", signal)
            case IfFlag(flag):
                # Of a walk that no run can take, only findings that hold on every walk are
                # reported.
                surely = course.is_possible or flag not in self._flags_read
                unread = surely and not course.is_read(flag)
                self._note(key, statement, flag_not_read(statement) if unread else None)
            case Loop():
                self._note(key, statement, None)
                course.begin_pass(key)
            case End():
                self._look_at_pass(key, course)
        if isinstance(statement, ReadInput):
            course.read(statement.flag)

    def pass_instant(self, position: Position, course: Course) -> None:
        """Count a statement that takes no time; too many in a row end a run."""
        if course.take_none() and course.is_possible:
            self._go_round(_loop_around(position), course)

    def _look_at_pass(self, end: Key, course: Course) -> None:
        name, index = end
        loop = name, self._linked.programs[name].blocks.at[index].opened
        if loop in self._endless and course.is_idle(loop) and course.is_possible:
            self._go_round(loop, course)
        course.begin_pass(loop)

    def _go_round(self, key: Key, course: Course) -> None:
        name, index = key
        statement = self._linked.programs[name].statements[index]
        self.verdicts[key] = StatementFinding(name, index, statement, going_round())
        # A run would end here: the statements around it are not at fault.
        course.take_time()

    def _look_at_signal(
        self, key: Key, statement: Statement, kind: Literal["input", "output"], signal: int
    ) -> None:
        if self._absent is None:
            self.unchecked.add(key)
        else:
            self._note(key, statement, self._absent(kind, signal))

    def _note(self, key: Key, statement: Statement, refusal: Refusal | None) -> None:
        """Keep the first refusal of a statement, whichever walk and pass found it."""
        before = self.verdicts.get(key)
        first = refusal if before is None else before.refusal or refusal
        self.verdicts[key] = StatementFinding(*key, statement, first)


def _loop_around(position: Position) -> Key:
    """Return the innermost loop around a position, callers included, or its own statement."""
    for level in reversed(position):
        loops = [loop for loop, _ in level.passes if loop >= 0]
        if loops:
            return level.program, loops[-1]
    return position[-1].program, position[-1].index


MOST_STATEMENTS_WALKED = 20_000
"""Greatest number of statements of one walk, loops unrolled."""

MOST_HAND_OVERS = 100
"""Greatest number of objects taken and left in one walk; each makes another scene to plan in."""

MOST_SAMPLES = 50_000
"""Greatest number of samples of the tool's path that are kept of one walk."""


class Walk:
    """One path through the program.

    Attributes:
        joints: (n,) where the robot stands [rad or m].
        time: since the start [s].
        path: the tool's way, up to `MOST_SAMPLES`.
        moved: True if the robot is at a point of the program.
        scene: what stands around now; None to check nothing.
        by_flags: True if a condition on a flag is answered as the one before on the same flag.
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
    """Walker through a program, each time where it has been least.

    Attributes:
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
        self.verdicts: dict[tuple[str, int], MoveFinding] = {}
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
            by_flags: True if conditions on one flag agree, as in a run they must; where they do
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
        """Return the branch of a condition on a flag, and record the flag's value."""
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
        """Attach or detach an object; where that fails, nothing changes."""
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
            gathered = self._gatherer.block(position, lambda _: False)
        else:
            gathered, walk.moved = self._gatherer.approach(position), True
        self._plan(gathered.block, walk)
        walk.time += gathered.block.moves[-1].move.dwell
        return gathered.behind

    def _plan(self, block: MotionBlock, walk: Walk) -> None:
        """Plan a block; after a refused move, plan from where it should have ended."""
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
        self.verdicts[key] = MoveFinding(*key, move.target.name, refusal, joined)


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
    """Return a verdict for every point, including those that no statement moves to."""
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
