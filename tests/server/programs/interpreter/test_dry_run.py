"""Dry runs: what a run would do and be refused for, walked through without a robot."""

import math
from typing import Any

import numpy as np
import pytest
from rigs.cells.expectations import expect, known
from rigs.cells.program_cell import BODY_LINE, HEAD, ProgramCell
from rigs.cells.program_rig import ProgramRig
from rigs.data.program_samples import linked, program

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.frames.grasp import Grasp
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.server.planning.jobs import DryRunFound, DryRunJob
from openpendant.server.planning.worker.dry_run_planning import DryRuns
from openpendant.server.programs.execution.program_run import BareEnvironment
from openpendant.server.programs.interpreter import dry_run_results as results
from openpendant.server.programs.interpreter.dry_run import dry_run, reachability
from openpendant.server.programs.interpreter.motion_blocks import MotionBlock
from openpendant.server.programs.interpreter.run_events import Offer, OfferedSignals
from openpendant.server.programs.language.linking import Linked
from openpendant.server.programs.language.parser import parse
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.program_values import JointVector
from openpendant.simplemsg.verdicts import VerdictCode as V

START = (0.0,) * 6
SIGNALS = OfferedSignals(inputs=16, outputs=8)
LOOP = "loop\n{}end"


def walked(
    statements: str,
    *beyond: str,
    others: dict[str, str] | None = None,
    signals: OfferedSignals | None = SIGNALS,
) -> results.DryRunResult:
    absent = None if signals is None else signals.absent
    return dry_run(linked(statements, others), START, Planner(*beyond), absent=absent)


def refusals(found: results.DryRunResult) -> list[tuple[str, int, V]]:
    return [(each.program, each.index, known(each.refusal).code) for each in found.refusals]


@pytest.mark.parametrize(
    ("statement", "text"),
    [
        ("wait input 999 on timeout 1 s", "input 999; accepted: 0 to 15"),
        ("wait input 16 on", "input 16; accepted: 0 to 15"),
        ("read input 16 into x", "input 16; accepted: 0 to 15"),
        ("if input 16 on\nend", "input 16; accepted: 0 to 15"),
        ("set output 8 off", "output 8; accepted: 0 to 7"),
    ],
)
def test_a_signal_that_the_controller_does_not_have_is_refused_at_its_statement(
    statement: str, text: str
) -> None:
    found = walked(f"move PTP a\n{statement}\nmove PTP b")
    assert refusals(found) == [("main", 1, V.NO_SIGNAL)]
    assert [each.refusal.text for each in found.refusals if each.refusal] == [text]
    assert found.unchecked == ()


def test_signals_that_are_there_are_good() -> None:
    found = walked("wait input 15 on\nset output 7 on\nread input 0 into x\nif flag x on\nend")
    assert [each.index for each in found.statements] == [0, 1, 2, 3]
    assert found.refusals == ()


def test_where_nobody_knows_the_signals_it_is_said_and_nothing_is_refused() -> None:
    found = walked("wait input 999 on\nmove PTP a\nset output 999 on", signals=None)
    assert (found.refusals, found.unchecked) == ((), (("main", 0), ("main", 2)))


@pytest.mark.parametrize(
    ("statements", "refused"),
    [
        ("if flag F on\nmove PTP a\nend", [0]),
        ("if flag F on\nend\nread input 1 into F\nif flag F on\nend", [0]),
        ("read input 1 into G\nif flag F on\nend\nif flag G on\nend", [1]),
        ("loop 5\nif flag F off\nend\nread input 1 into F\nend", [1]),
        ("if input 1 on\nread input 2 into F\nend\nif flag F on\nend", [3]),
        ("read input 1 into F\nif flag F on\nend", []),
        (
            "if input 1 on\nread input 2 into F\nelse\nread input 3 into F\nend\nif flag F on\nend",
            [],
        ),
    ],
)
def test_a_flag_perhaps_unread_is_refused_where_asked(statements: str, refused: list[int]) -> None:
    assert refusals(walked(statements)) == [("main", index, V.FLAG_NOT_READ) for index in refused]


@pytest.mark.parametrize("branch", ["if flag G off\nelse\n", "if flag G on\n"])
def test_flags_that_go_together_are_walked_together(branch: str) -> None:
    statements = (
        "read input 1 into G\nif flag G on\nread input 2 into F\nend\n"
        f"{branch}if flag F on\nmove PTP a\nend\nend"
    )
    found = walked(statements)
    assert found.refusals == ()
    assert found.complete


def test_branches_that_no_flag_leads_to_are_walked_all_the_same() -> None:
    found = walked("read input 1 into G\nif flag G on\nif flag G off\nmove PTP b\nend\nend")
    assert [each.point for each in found.moves] == ["b"]
    assert found.complete


@pytest.mark.parametrize(
    ("statements", "refused"),
    [
        (LOOP.format(""), [0]),
        (LOOP.format("# nothing\n"), [0]),
        (LOOP.format("loop 5\nend\n"), [0]),
        (LOOP.format(LOOP.format("") + "\n"), [1]),
        ("loop 1000000\nend", [0]),
        (LOOP.format("loop 10000\nend\n"), [1]),
        ("read input 1 into F\n" + LOOP.format("if flag F on\nmove PTP a\nend\n"), [1]),
        (LOOP.format("move PTP a\n"), []),
        (LOOP.format("move PTP a zone 5 deg\n"), []),
        (LOOP.format("wait 0.1 s\n"), []),
        (LOOP.format("set output 1 on\n"), []),
        (LOOP.format("if input 1 on\nmove PTP a\nend\n"), []),
        (LOOP.format("read input 1 into F\nif flag F on\nmove PTP a\nend\n"), []),
        ("loop 1000\nend", []),
        (
            "read input 1 into F\n"
            + LOOP.format("if flag F on\nmove PTP a\nend\nif flag F off\nmove PTP b\nend\n"),
            [],
        ),
    ],
)
def test_a_loop_that_goes_round_in_no_time_is_refused(statements: str, refused: list[int]) -> None:
    assert refusals(walked(statements)) == [("main", index, V.PROGRAM_STUCK) for index in refused]


@pytest.mark.parametrize(
    ("statements", "called", "refused"),
    [
        ("loop\ncall x\nend", "# nothing", ("main", 0, V.PROGRAM_STUCK)),
        ("loop 9999\ncall x\nend", "# nothing", ("main", 0, V.PROGRAM_STUCK)),
        ("call x", "move PTP a\nset output 99 on", ("x", 1, V.NO_SIGNAL)),
        ("call x", "if input 1 on\nelse\nmove PTP c\nend", ("x", 2, V.UNREACHABLE)),
    ],
)
def test_what_is_called_is_walked_too_and_refused_where_it_is_at_fault(
    statements: str, called: str, refused: tuple[str, int, V]
) -> None:
    assert refusals(walked(statements, "c", others={"x": called})) == [refused]


@pytest.mark.parametrize(
    "statements",
    [
        "if flag F on\nend",
        LOOP.format(""),
        LOOP.format("loop 5\nend\n"),
        "loop 1000000\nend",
        LOOP.format("wait 0.1 s\n") + "\nmove PTP a",
        "loop 1000\nend",
    ],
)
def test_a_dry_run_refuses_what_a_run_ends_at(statements: str) -> None:
    rig = ProgramRig(statements)
    came = [*rig.start(), *(each for _ in range(50) for each in rig.after(0.01))]
    ended = came[0] if came else "goes on"
    said = [f"failed {code.name}" for _, _, code in refusals(walked(statements))]
    assert said == ([ended] if ended.startswith("failed") else [])


def test_a_controller_without_signals_refuses_all() -> None:
    none = Refusal(V.SIGNALS_UNAVAILABLE, "none")
    found = dry_run(linked("wait input 1 on"), START, Planner(), absent=lambda kind, signal: none)
    assert refusals(found) == [("main", 0, V.SIGNALS_UNAVAILABLE)]


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
    ) -> results.BlockPlan | results.BlockRefused:
        names = [each.target.name for each in block.moves]
        self.asked.append((start, " ".join(names)))
        for place, name in enumerate(names):
            if name in self._beyond:
                return results.BlockRefused(place, BEYOND)
        path = tuple((float(n), 0.1 * n, 0.0, 0.5) for n in range(len(names) + 1))
        return results.BlockPlan(float(len(names)), block.moves[-1].target.joints, path)


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


@pytest.mark.parametrize(
    ("loop", "endless", "duration"), [("loop 1000", False, 2_001.0), ("loop", True, 5.0)]
)
def test_a_loop_is_counted_or_endless_and_planned_once_for_each_start(
    loop: str, endless: bool, duration: float
) -> None:
    """An endless one is walked twice."""
    planner = Planner()
    found = dry_run(linked(f"{loop}\nmove PTP a\nmove PTP b\nend\nmove PTP c"), START, planner)
    assert (found.endless, found.duration, found.complete) == (endless, duration, True)
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


def test_every_move_has_a_verdict_also_behind_one_that_is_refused() -> None:
    planner = Planner("b")
    statements = "move PTP a\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a"
    found = dry_run(linked(statements), START, planner)
    assert [v.point for v in found.moves] == ["a", "b", "c", "a"]
    assert [v.refusal for v in found.moves] == [None, BEYOND, None, None]
    b = program("").point("b").joints
    assert planner.asked[-1] == (b, "c a")


def test_a_move_before_the_one_at_fault_is_good() -> None:
    found = walked("move PTP a\nmove LIN b zone 5 mm\nmove LIN c", "c")
    assert [(v.point, v.refusal) for v in found.moves] == [("a", None), ("b", None), ("c", BEYOND)]


def test_a_move_that_fails_in_one_pass_only_fails() -> None:
    class Picky(Planner):
        def __call__(
            self, start: JointVector, block: MotionBlock, scene: Scene | None = None
        ) -> results.BlockPlan | results.BlockRefused:
            if start == program("").point("b").joints and block.moves[0].target.name == "a":
                return results.BlockRefused(0, BEYOND)
            return super().__call__(start, block)

    found = dry_run(linked("loop 2\nmove PTP a\nmove PTP b\nend"), START, Picky())
    assert [(getattr(v, "point", None), v.refusal) for v in found.refusals] == [("a", BEYOND)]


def test_a_zone_that_joins_nothing_is_said() -> None:
    statements = "move PTP a\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nset output 1 on"
    assert [verdict.zone_used for verdict in walked(statements).moves] == [False, True, False]


def test_a_dry_run_of_nothing_is_complete() -> None:
    assert walked("") == results.DryRunResult(0.0, False, True, (), (), ())


def test_every_point_has_a_verdict_used_or_not() -> None:
    found = reachability(program("move PTP a"), lambda point: BEYOND if point.name == "b" else None)
    expected = {"a": None, "b": BEYOND, "c": None}
    assert found == tuple(results.PointFinding(*each) for each in expected.items())


def asked_for(offer: Offer) -> dict[str, Any]:
    cell = ProgramCell(main="wait input 999 on\nset output 1 on\nif flag F on\nend\nloop\nend\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BareEnvironment, "offered_signals", offer)
        return cell.user.ask("programs.dry_run", name="main")


def test_statements_that_a_run_would_end_at_are_told_with_line_code_and_text() -> None:
    found = asked_for(OfferedSignals(inputs=16, outputs=16))
    told = found["statements"]
    assert [each["line"] - BODY_LINE for each in told] == [0, 2, 4, 1]
    assert [each["does"] for each in told] == ["wait-input", "if-flag", "loop", "set-output"]
    codes = [V.NO_SIGNAL, V.FLAG_NOT_READ, V.PROGRAM_STUCK, None]
    assert [each.get("code") for each in told] == codes
    assert (found["refused"], found["unchecked"]) == (3, [])
    assert found["statements"][0]["text"] == "input 999; accepted: 0 to 15"


def test_while_the_controller_has_not_said_its_signals_none_is_refused() -> None:
    found = asked_for(None)
    assert [each["line"] - BODY_LINE for each in found["unchecked"]] == [0, 1]
    assert [each["does"] for each in found["statements"]] == ["if-flag", "loop"]


def test_the_text_of_a_refusal_is_told_to_its_end() -> None:
    cell, name = ProgramCell(), "a-point-with-a-name-that-says-where-it-is"
    far = HEAD.format(name="main").replace("c joints 0.2", f"{name} joints 9")
    text = f"{far}move PTP a\nmove PTP {name}\n"
    cell.user.ask("programs.save", name="main", body=text, expected_revision=0)
    found = cell.user.ask("programs.dry_run", name="main")
    (worst, *_) = found["moves"]
    assert worst["code"] == V.OUT_OF_RANGE
    assert worst["text"].endswith(" rad")
    assert len(worst["text"]) > 120


UR5 = Kinematics(serial_robot("ur5"))
TURN = 1.0
HERE = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
TURNED = f"""openpendant-program/1
program "main" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints {TURN} -1.5 1.5 -1.5 -1.5 0 rad
"""


def beside_tool(turn: float) -> tuple[float, float, float]:
    """Return a place 0.25 m out of the tool, with the first axis turned [m]."""
    x, y, z = UR5.forward((turn, *HERE[1:])).position.tolist()
    away = math.hypot(x, y)
    return (x * (1 + 0.25 / away), y * (1 + 0.25 / away), z)


def ball(name: str, place: tuple[float, float, float]) -> SceneObject:
    return SceneObject(name, Sphere(0.05), place)


HOLDING = UR5.forward(HERE).inverse().compose(Pose.from_values(beside_tool(0.0), (0, 0, 0, 1)))
X, Y, Z = HOLDING.position.tolist()
GRIPPER = FrameTree().add_tool("gripper", Pose.identity(), Grasp((X, Y, Z))).select_tool("gripper")
"""With a grasp point where `beside_tool` is."""

SCENE = Scene((ball("part", beside_tool(0.0)), ball("post", beside_tool(TURN))))


def found_in(statements: str, scene: Scene = SCENE) -> DryRunFound:
    program = parse(TURNED + statements)
    whole = Linked("main", {"main": program})
    job = DryRunJob(1, "test 1", HERE, whole, GRIPPER, None, scene)
    runs = DryRuns()
    told = expect(DryRunFound, runs.slice(UR5, job, lambda: False))
    return told


def test_what_is_carried_may_not_touch_what_stands() -> None:
    assert found_in("move PTP a\nmove PTP b\n").run.refusals == ()
    run = found_in("move PTP a\nattach part\nmove PTP b\n").run
    (refused,) = run.refusals
    assert (refused.index, refused.refusal and refused.refusal.code) == (2, V.PATH_IN_COLLISION)
    assert [each.index for each in run.hand_overs] == [1]


def test_what_was_left_stays_where_it_was_left() -> None:
    lone = Scene((ball("part", beside_tool(0.0)),))
    program = "move PTP a\nattach part\nmove PTP b\ndetach part\nmove PTP a\nmove PTP b\n"
    run = found_in(program, lone).run
    assert run.refusals == ()
    assert [each.statement.statement for each in run.hand_overs] == ["attach", "detach"]


@pytest.mark.parametrize("statement", ["attach nothing", "detach part", "attach part\nattach part"])
def test_a_hand_over_that_cannot_be_is_refused_at_its_statement(statement: str) -> None:
    run = found_in(f"move PTP a\n{statement}\n").run
    (refused,) = run.refusals
    assert refused.index == statement.count("\n") + 1
    assert run.complete


def test_a_loop_of_hand_overs_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.server.programs.interpreter.dry_run.MOST_HAND_OVERS", 10)
    lone = Scene((ball("part", beside_tool(0.0)),))
    run = found_in(
        "loop 1000\nmove PTP a\nattach part\nmove PTP b\nmove PTP a\ndetach part\nend\n", lone
    ).run
    assert not run.complete
    assert np.isfinite(run.duration)
