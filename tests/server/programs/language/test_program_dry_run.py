from __future__ import annotations

import pytest
from rigs.data.program_samples import linked, program

from openpendant.motion.scene.scene import Scene
from openpendant.server.programs.interpreter.dry_run import dry_run, reachability
from openpendant.server.programs.interpreter.dry_run_results import (
    BlockPlan,
    BlockRefused,
    DryRunResult,
    PointFinding,
)
from openpendant.server.programs.interpreter.motion_blocks import MotionBlock
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.points import JointVector, TeachPoint
from openpendant.simplemsg.verdicts import VerdictCode as V

START = (0.0,) * 6
BEYOND = Refusal(V.UNREACHABLE, "0.2 m too far", value=0.2)


class Planner:
    """Takes a second a move; refuses moves to some points.

    Attributes:
        asked: where each plan began and which points it went to.
    """

    def __init__(self, *beyond: str) -> None:
        self.asked: list[tuple[JointVector, str]] = []
        self._beyond = beyond

    def __call__(
        self, start: JointVector, block: MotionBlock, scene: Scene | None = None
    ) -> BlockPlan | BlockRefused:
        names = [each.target.name for each in block.moves]
        self.asked.append((start, " ".join(names)))
        for place, name in enumerate(names):
            if name in self._beyond:
                return BlockRefused(place, BEYOND)
        path = tuple((float(n), 0.1 * n, 0.0, 0.5) for n in range(len(names) + 1))
        return BlockPlan(float(len(names)), block.moves[-1].target.joints, path)


def walked(statements: str, *beyond: str, others: dict[str, str] | None = None) -> DryRunResult:
    return dry_run(linked(statements, others), START, Planner(*beyond))


def test_duration_counts_motions_waits_and_dwells() -> None:
    found = walked("move PTP a\nwait 2 s\nmove LIN b dwell 0.5 s\nwait input 1 on")
    assert (found.duration, found.endless, found.complete) == (4.5, False, True)


def test_each_block_is_planned_from_where_the_one_before_ended() -> None:
    planner, found = Planner(), program("")
    dry_run(linked("move PTP a\nmove LIN b zone 5 mm\nmove LIN c\nmove PTP a"), START, planner)
    a, c = found.point("a").joints, found.point("c").joints
    assert planner.asked == [(START, "a"), (a, "b c"), (c, "a")]


def test_the_path_goes_on_in_time() -> None:
    path = walked("move PTP a\nwait 1 s\nmove LIN b").path
    assert [sample[0] for sample in path] == [0.0, 1.0, 2.0, 3.0]
    assert path[1] == (1.0, 0.1, 0.0, 0.5)


def test_counted_loops_are_counted_and_planned_once_for_each_start() -> None:
    planner = Planner()
    found = dry_run(linked("loop 1000\nmove PTP a\nmove PTP b\nend"), START, planner)
    assert found.duration == 2_000.0
    assert len(planner.asked) == 3


def test_an_endless_loop_is_walked_twice_and_said_to_be_endless() -> None:
    planner = Planner()
    found = dry_run(linked("loop\nmove PTP a\nmove PTP b\nend\nmove PTP c"), START, planner)
    assert (found.endless, found.duration, found.complete) == (True, 5.0, True)
    assert [names for _, names in planner.asked] == ["a", "b", "a", "c"]


def test_a_walk_ends_at_its_bound_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "openpendant.server.programs.interpreter.dry_run.MOST_STATEMENTS_WALKED", 500
    )
    found = walked("loop 1000000\nmove PTP a\nmove PTP b\nend\nmove PTP c")
    assert not found.complete
    assert found.not_walked == (("main", 4),)


@pytest.mark.parametrize(
    "statements",
    [
        "move PTP a\nif input 1 on\nmove PTP b\nelse\nmove PTP c\nend",
        "move PTP a\nread input 1 into x\nif flag x on\nmove PTP b\nelse\nmove PTP c\nend",
        "if input 1 on\nmove PTP a\nelse\nif input 2 on\nmove PTP b\nelse\nmove PTP c\nend\nend",
        "loop 2\nif input 1 off\nif input 2 on\nmove PTP a\nelse\nmove PTP c\nend\nend\nend",
    ],
)
def test_every_branch_is_checked(statements: str) -> None:
    found = walked(statements, "c")
    assert found.complete
    assert found.not_walked == ()
    assert [getattr(verdict, "point", None) for verdict in found.refusals] == ["c"]


def test_the_branches_of_a_called_program_are_checked() -> None:
    found = walked("call x", "c", others={"x": "if input 1 on\nelse\nmove PTP c\nend"})
    assert [(v.program, v.index, v.refusal) for v in found.refusals] == [("x", 2, BEYOND)]


def test_every_move_has_a_verdict_also_behind_one_that_is_refused() -> None:
    planner = Planner("b")
    statements = "move PTP a\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a"
    found = dry_run(linked(statements), START, planner)
    assert [(v.point, v.refusal) for v in found.moves] == [
        *(("a", None), ("b", BEYOND), ("c", None), ("a", None))
    ]
    b = program("").point("b").joints
    assert planner.asked[-1] == (b, "c a")


def test_a_move_before_the_one_at_fault_is_good() -> None:
    found = walked("move PTP a\nmove LIN b zone 5 mm\nmove LIN c", "c")
    assert [(v.point, v.refusal) for v in found.moves] == [("a", None), ("b", None), ("c", BEYOND)]


def test_a_move_that_fails_in_one_pass_only_fails() -> None:
    class Picky(Planner):
        def __call__(
            self, start: JointVector, block: MotionBlock, scene: Scene | None = None
        ) -> BlockPlan | BlockRefused:
            if start == program("").point("b").joints and block.moves[0].target.name == "a":
                return BlockRefused(0, BEYOND)
            return super().__call__(start, block)

    found = dry_run(linked("loop 2\nmove PTP a\nmove PTP b\nend"), START, Picky())
    assert [(getattr(v, "point", None), v.refusal) for v in found.refusals] == [("a", BEYOND)]


def test_a_zone_that_joins_nothing_is_said() -> None:
    statements = "move PTP a\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nset output 1 on"
    assert [verdict.zone_used for verdict in walked(statements).moves] == [False, True, False]


def test_a_dry_run_of_nothing_is_complete() -> None:
    assert walked("") == DryRunResult(0.0, False, True, (), (), ())


def test_every_point_has_a_verdict_used_or_not() -> None:
    def check(point: TeachPoint) -> Refusal | None:
        return BEYOND if point.name == "b" else None

    assert reachability(program("move PTP a"), check) == (
        *(PointFinding("a", None), PointFinding("b", BEYOND), PointFinding("c", None)),
    )
