"""How plans are made, kept within bounds, shown and dropped; and each refusal."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rigs.cells.planning_pendants import PlansCell, UnplannedCell, notices
from rigs.cells.server_rig import MS

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.ik.ik import solve_all
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.events.management_requests import MOST_ANSWER
from openpendant.server.planning.jobs import (
    PlanAnswer,
    PlanJob,
    PoseGoal,
    PoseJob,
    SearchProgress,
    SearchStage,
)
from openpendant.server.planning.worker.plan_making import make_plan
from openpendant.server.plans import plan_space
from openpendant.server.plans.plan_space import PlanSpace
from openpendant.server.plans.sample_text import sample_text
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import (
    Capability,
    HelloReply,
    Management,
    Motion,
    PlanChanged,
    PlanStage,
    PlanState,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

NOWHERE = {"position": [9.0, 0.0, 0.0], "orientation": [0.0, 0.0, 0.0, 1.0]}
UR5 = Kinematics(serial_robot("ur5"))


@pytest.fixture
def cell() -> Iterator[PlansCell]:
    made = PlansCell()
    yield made
    assert made.controller.referee.total == 0


@pytest.fixture
def unplanned() -> UnplannedCell:
    return UnplannedCell(has_surroundings=False)


def ptp(joints: list[float]) -> dict[str, Any]:
    return {"kind": "ptp", "joints": joints}


def pose_at(joints: list[float] | tuple[float, ...]) -> dict[str, Any]:
    found = UR5.forward(joints)
    return {"position": found.position.tolist(), "orientation": found.quaternion.tolist()}


def test_it_is_offered(cell: PlansCell) -> None:
    newcomer = cell.stranger()
    (welcome,) = [each for each in newcomer.hello() if isinstance(each, HelloReply)]
    assert Capability.PLANS in Capability(welcome.capabilities)


def test_a_reply_tells_all_of_it(cell: PlansCell) -> None:
    cell.add_box("box", [0.0, 0.9, 0.3], 0.2)
    made = cell.make(goal=ptp(cell.turned(0.4)), speed=0.25, label="to the left")
    assert (made["state"], made["expires_in"], made["seed"]) == ("ready", 60.0, 0)
    assert made["samples"] == round(made["duration"] / 0.01) + 1
    assert made["start"] == pytest.approx(cell.home)
    assert made["end"] == cell.turned(0.4)
    place = UR5.forward(cell.turned(0.4))
    assert made["end_pose"]["position"] == pytest.approx(place.position.tolist())
    based: dict[str, Any] = {"scene": 1, "tools": 0, "frames": 0, "tool": None, "attached": []}
    assert made["based_on"] == based
    assert made["certificate"]["valid"] is True
    ratios = {each["quantity"]: each["ratio"] for each in made["certificate"]["worst"]}
    assert 0.2 < ratios["velocity"] <= 0.2501
    assert {made["clearance"]["first"], made["clearance"]["second"]} >= {"box"}
    assert (made["executable"], made["why"]) == (True, None)


def test_it_says_what_an_execution_would_be_refused_for(cell: PlansCell) -> None:
    made = cell.make(cell.other())
    assert made["executable"] is False
    assert (made["why"]["condition"], made["why"]["code"]) == ("authority", V.HELD_BY_OTHER)


def test_a_plan_is_made_without_the_authority_and_moves_nothing(cell: PlansCell) -> None:
    cell.plan(cell.other())
    cell.wait(500)
    assert cell.handed == []
    assert cell.position == cell.home


@pytest.mark.parametrize("branch", [1, 3])
def test_a_branch_is_one_of_all_the_nearest_first(cell: PlansCell, branch: int) -> None:
    pose = pose_at(cell.turned(0.3))
    every = solve_all(UR5, Pose.from_values(pose["position"], pose["orientation"]), cell.home)
    made = cell.make(goal={"kind": "ptp", "pose": pose, "branch": branch})
    if "end" in made:
        wanted = every[branch - 1].joint_position.tolist()
        assert made["end"] == pytest.approx(wanted, abs=1e-6)
    else:
        assert made["code"] == V.PATH_IN_COLLISION


def test_a_pose_in_the_frame_of_the_tool_is_where_it_is_at_the_start(cell: PlansCell) -> None:
    ahead = {"position": [0.0, 0.0, -0.05], "orientation": [0.0, 0.0, 0.0, 1.0]}
    made = cell.make(goal={"kind": "lin", "pose": ahead, "frame": "tool"})
    here = UR5.forward(cell.home)
    wanted = here.compose(Pose.from_values(ahead["position"], ahead["orientation"]))
    assert made["end_pose"]["position"] == pytest.approx(wanted.position.tolist(), abs=1e-5)


def test_the_selected_tool_leads(cell: PlansCell) -> None:
    cell.operator.ask("tools.add", name="pen", tcp={"position": [0, 0, 0.2]}, expected_revision=0)
    cell.operator.ask("tools.select", name="pen", expected_revision=1)
    made = cell.make(goal=ptp(cell.turned(0.2)))
    tip = UR5.forward(cell.turned(0.2)).compose(Pose.from_values([0, 0, 0.2], [0, 0, 0, 1]))
    assert made["end_pose"]["position"] == pytest.approx(tip.position.tolist())
    assert made["based_on"]["tool"] == "pen"


def test_a_plan_around_obstacles_is_found_where_the_straight_way_is_barred(
    cell: PlansCell,
) -> None:
    goal = cell.turned(1.2)
    middle = UR5.forward(cell.turned(0.6)).position.tolist()
    cell.add_box("pillar", middle, 0.12)
    assert cell.make(goal=ptp(goal))["code"] == V.PATH_IN_COLLISION
    free = {"kind": "free", "joints": goal, "planner": "BuiltInRRTConnect", "seed": 3}
    made = cell.make(goal=free)
    assert (made["planner"], made["seed"]) == ("BuiltInRRTConnect", 3)
    assert made["end"] == pytest.approx(goal)
    assert made["clearance"]["distance"] > 0.0
    again = cell.make(goal=free)
    first, second = cell.samples(made["plan"]), cell.samples(again["plan"])
    assert first == second
    by_pose = cell.make(goal={**free, "joints": None, "pose": pose_at(goal)})
    assert by_pose["end_pose"]["position"] == pytest.approx(made["end_pose"]["position"], abs=1e-4)


@pytest.mark.parametrize("kind", ["ptp", "path"])
def test_a_joint_that_was_told_in_four_bytes_to_be_on_its_limit_is_planned_to_the_limit(
    cell: PlansCell, kind: str
) -> None:
    limit = cell.limits.upper[5]
    told = float(np.float32(limit))
    assert told > limit
    goal = [*cell.home[:5], told]
    plan = cell.plan(goal=ptp(goal) if kind == "ptp" else {"kind": "path", "waypoints": [goal]})
    assert cell.samples(plan)[-1][6] == limit
    beyond = float(np.nextafter(np.float32(limit), np.float32(10.0)))
    goal = [*cell.home[:5], beyond]
    refused = cell.make(goal=ptp(goal) if kind == "ptp" else {"kind": "path", "waypoints": [goal]})
    assert (refused["code"], refused["joint"], refused["limit"]) == (V.OUT_OF_RANGE, 5, limit)


REFUSED: dict[str, tuple[dict[str, Any], V, str]] = {
    "kind": ({"goal": {"kind": "fly"}}, V.BAD_ARGUMENT, "'ptp', 'lin', 'path', 'free', 'position'"),
    "planner": (
        {"goal": {"kind": "free", "joints": [0.0] * 6, "planner": "Magic"}},
        V.BAD_ARGUMENT,
        "RRTConnect",
    ),
    "seed": (
        {"goal": {"kind": "free", "joints": [0.0] * 6, "seed": -1}},
        V.BAD_ARGUMENT,
        "goal.free.seed",
    ),
    "margin": (
        {"goal": {"kind": "free", "joints": [0.0] * 6, "margin": 0.06}},
        V.BAD_ARGUMENT,
        "goal.free.margin",
    ),
    "time limit": (
        {"goal": {"kind": "free", "joints": [0.0] * 6, "time_limit": 6}},
        V.BAD_ARGUMENT,
        "goal.free.time_limit",
    ),
    "neither": ({"goal": {"kind": "ptp"}}, V.BAD_ARGUMENT, "without joints and pose"),
    "both": (
        {"goal": {"kind": "ptp", "joints": [0.0] * 6, "pose": NOWHERE}},
        V.BAD_ARGUMENT,
        "a goal of kind ptp is 'with joints and pose'; accepted: joints or pose, one of the two",
    ),
    "branch of joints": (
        {"goal": {"kind": "ptp", "joints": [0.0] * 6, "branch": 1}},
        V.BAD_ARGUMENT,
        "with a pose only",
    ),
    "too few joints": ({"goal": ptp([0.0] * 5)}, V.WRONG_JOINT_COUNT, ""),
    "out of range": ({"goal": ptp([9.0] + [0.0] * 5)}, V.OUT_OF_RANGE, ""),
    "unreachable": ({"goal": {"kind": "lin", "pose": NOWHERE}}, V.UNREACHABLE, ""),
    "far": (
        {"goal": {"kind": "lin", "pose": {"position": [1e4, 0, 0]}}},
        V.BAD_ARGUMENT,
        "coordinates up to 1000 m",
    ),
    "quaternion": (
        {"goal": {"kind": "lin", "pose": {"position": [0, 0, 0], "orientation": [0, 0, 0, 1.01]}}},
        V.BAD_ARGUMENT,
        "length 1.01'; accepted: length 1 within 0.001",
    ),
    "frame": (
        {"goal": {"kind": "lin", "pose": NOWHERE, "frame": "moon"}},
        V.UNKNOWN_FRAME,
        "moon",
    ),
    "position": ({"goal": {"kind": "position", "name": "../etc"}}, V.UNKNOWN_POSITION, "home"),
    "speed": ({"speed": 0.0}, V.BAD_ARGUMENT, "above 0, up to 1"),
    "tool speed": ({"tool_speed": -1.0}, V.BAD_ARGUMENT, "above 0"),
    "denormal speed": ({"speed": 5e-324}, V.BAD_ARGUMENT, "speed 4.94066e-324; accepted: 1e-06"),
    "tiny speed": ({"speed": 1e-310}, V.BAD_ARGUMENT, "1e-06 or more"),
    "tiny tool speed": ({"tool_speed": 1e-310}, V.BAD_ARGUMENT, "1e-06 or more"),
    "label": ({"label": "x" * 65}, V.BAD_ARGUMENT, "64"),
    "control character": ({"label": "a\nb"}, V.BAD_ARGUMENT, "label"),
    "too long": ({"speed": 0.001}, V.PLAN_TOO_LONG, "120 s"),
    "lin through joints": (
        {"goal": {"kind": "path", "waypoints": [[0.0] * 6], "way": "lin"}},
        V.BAD_ARGUMENT,
        "ptp through joint positions",
    ),
    "mixed": (
        {"goal": {"kind": "path", "waypoints": [[0.0] * 6, NOWHERE]}},
        V.BAD_ARGUMENT,
        "joint positions, or poses",
    ),
    "many waypoints": (
        {"goal": {"kind": "path", "waypoints": [[0.0]] * 1601}},
        V.TOO_LARGE,
        "1600",
    ),
    "no waypoints": ({"goal": {"kind": "path", "waypoints": []}}, V.BAD_ARGUMENT, "waypoints"),
    "start": ({"start": [0.0] * 5}, V.WRONG_JOINT_COUNT, ""),
    "unknown key": (
        {"goal": {"kind": "position", "name": "home", "fast": 1}},
        V.BAD_ARGUMENT,
        "fast",
    ),
    "infinite": ({"speed": float("inf")}, V.BAD_ARGUMENT, "speed"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_request_is_refused(cell: PlansCell, case: str) -> None:
    fields, code, words = REFUSED[case]
    answer = cell.make(**fields)
    assert (V(answer["code"]), words in answer["text"]) == (code, True), answer
    heads = cell.operator.ask("plans.show")["plans"]
    assert {head["state"] for head in heads} <= {"dropped"}


GOALS_TO_BE_SLOW = ("ptp", "ptp to a pose", "lin", "free")


@pytest.mark.parametrize("kind", GOALS_TO_BE_SLOW)
@pytest.mark.parametrize("how", [{"speed": 1e-6}, {"tool_speed": 1e-4}], ids=["joints", "tool"])
def test_a_plan_that_is_far_too_slow_is_too_long(
    cell: PlansCell, kind: str, how: dict[str, Any]
) -> None:
    joints = cell.turned(0.4)
    pose = pose_at(cell.home)
    x, y, z = pose["position"]
    pose["position"] = [x, y, z + 0.05]
    goals = {
        "ptp": ptp(joints),
        "ptp to a pose": {"kind": "ptp", "pose": pose},
        "lin": {"kind": "lin", "pose": pose},
        "free": {"kind": "free", "joints": joints, "planner": "BuiltInRRTConnect"},
    }
    told = cell.make(goal=goals[kind], **how)
    assert (told["code"], told["limit"]) == (V.PLAN_TOO_LONG, 120.0), told
    assert told["value"] > 120.0


def test_a_line_whose_tool_is_too_slow_is_not_timed_first() -> None:
    start = serial_robot("ur5").home_position
    here = pose_at(start)
    x, y, z = here["position"]
    goal = PoseGoal((x, y, z + 0.05), here["orientation"])
    line = PoseJob(0, start, (goal,), "base", Motion.LIN, 1.0, 1e-4)
    refusal = make_plan(UR5, UR5, PlanJob(0, start, line), lambda _: None)
    assert isinstance(refusal, Refusal)
    assert refusal.value == pytest.approx(500.0)


def test_no_motion_is_refused(cell: PlansCell) -> None:
    assert cell.make(goal=ptp(list(cell.home)))["code"] == V.NO_MOTION


def test_a_branch_that_is_not_there_is_refused(cell: PlansCell) -> None:
    goal = {"kind": "ptp", "pose": pose_at(cell.turned(0.3)), "branch": 999}
    answer = cell.make(goal=goal)
    assert answer["code"] == V.BAD_ARGUMENT
    assert "at this pose" in answer["text"]


def test_none_is_made_from_where_the_robot_stands_while_it_moves(cell: PlansCell) -> None:
    cell.operator.move(*cell.turned(1.0))
    cell.wait(100)
    assert cell.make()["code"] == V.MOVING
    assert cell.make(start=list(cell.home))["state"] == "ready"


def test_nor_without_a_report_of_where_it_stands(cell: PlansCell) -> None:
    cell.core.cell.feedback.forget()
    assert cell.make()["code"] == V.FEEDBACK_STALE


# States.


def later(cell: UnplannedCell, by: Any = None, **fields: Any) -> None:
    fields.setdefault("goal", ptp(cell.turned(0.3)))
    body = json.dumps({"op": "plans.make", **fields}).encode()
    (by or cell.operator).send(Management(5, body))


def test_a_connection_has_one_plan_made_at_a_time(unplanned: UnplannedCell) -> None:
    later(unplanned)
    assert unplanned.make()["code"] == V.PLANNING
    later(unplanned, unplanned.other())
    assert len(unplanned.open) == 2
    unplanned.answer_next()
    later(unplanned)
    assert len(unplanned.open) == 2


def test_one_that_is_being_made_is_neither_shown_nor_executed(unplanned: UnplannedCell) -> None:
    later(unplanned)
    assert unplanned.operator.ask("plans.samples", plan=1)["code"] == V.PLANNING
    assert unplanned.execute(1) is V.PLANNING
    assert unplanned.state_of(1) == "planning"
    unplanned.answer_next()
    assert unplanned.execute(1) is V.ACCEPTED


def test_how_far_it_has_come_is_told_five_times_a_second_at_most(unplanned: UnplannedCell) -> None:
    later(unplanned)
    asked, answer = unplanned.open[0]
    for number in range(20):
        word = SearchProgress(SearchStage.SEARCHING, number / 20)
        unplanned.now += 50 * MS
        unplanned.open.insert(0, (asked, answer))
        unplanned.answer_next(PlanAnswer(asked.id, word, 0.1))
    told = [each for each in unplanned.operator.all(PlanChanged) if each.stage]
    assert 4 <= len(told) <= 5
    assert {each.stage for each in told} == {PlanStage.SEARCHING}
    unplanned.answer_next()
    assert unplanned.state_of(1) == "ready"


def test_one_that_cannot_be_made_is_gone(unplanned: UnplannedCell) -> None:
    later(unplanned)
    refusal = Refusal(V.NO_PATH_FOUND, "nothing found")
    unplanned.answer_next(PlanAnswer(unplanned.open[0][0].id, refusal, 0.1))
    assert unplanned.operator.answers()[-1]["code"] == V.NO_PATH_FOUND
    assert notices(unplanned.operator)[-1] == (PlanState.DROPPED, V.NO_PATH_FOUND)
    assert unplanned.execute(1) is V.PLAN_STALE


def test_one_whose_maker_leaves_is_made_no_further(unplanned: UnplannedCell) -> None:
    maker = unplanned.other()
    later(unplanned, maker)
    maker.close()
    unplanned.answer_next()
    assert unplanned.execute(1) is V.PLAN_STALE
    assert unplanned.core.pendants.plans._book.ready == []


def test_plans_of_a_connection_that_ended_are_dropped(cell: PlansCell) -> None:
    maker = cell.other()
    plan = cell.plan(maker)
    maker.close()
    assert notices(cell.operator, plan)[-1] == (PlanState.DROPPED, V.PLAN_STALE)
    assert cell.execute(plan) is V.PLAN_STALE
    assert cell.handed == []


def test_a_plan_may_be_dropped_by_its_maker_or_with_the_authority(cell: PlansCell) -> None:
    maker, other = cell.other("maker"), cell.other("other")
    first, second, third = cell.plan(maker), cell.plan(maker), cell.plan(maker)
    assert other.ask("plans.drop", plan=first)["code"] == V.HELD_BY_OTHER
    assert maker.ask("plans.drop", plan=first) == {}
    assert cell.operator.ask("plans.drop", plan=second) == {}
    assert maker.ask("plans.drop", plan=second)["code"] == V.PLAN_STALE
    assert other.ask("plans.drop", plan=99)["code"] == V.PLAN_UNKNOWN
    assert cell.execute(third) is V.ACCEPTED
    assert maker.ask("plans.drop", plan=third)["code"] == V.MOVING


def test_one_that_is_being_made_may_be_dropped_and_its_maker_is_answered(
    unplanned: UnplannedCell,
) -> None:
    later(unplanned)
    unplanned.operator.send(Management(6, b'{"op": "plans.drop", "plan": 1}'))
    made, dropped = unplanned.operator.answers()
    assert (made["code"], dropped) == (V.PLAN_STALE, {})
    later(unplanned)
    assert unplanned.state_of(2) == "planning"


# Bounds.


def test_the_oldest_of_five_plans_of_a_connection_goes(cell: PlansCell) -> None:
    plans = [cell.plan() for _ in range(5)]
    assert cell.state_of(plans[0]) == "dropped"
    assert notices(cell.operator, plans[0])[-1] == (PlanState.DROPPED, V.TOO_MANY_PLANS)
    assert [cell.state_of(each) for each in plans[1:]] == ["ready"] * 4


def test_a_cell_keeps_eight_and_nobody_elses_goes(cell: PlansCell) -> None:
    makers = [cell.other(f"maker {number}") for number in range(2)]
    kept = [cell.plan(maker) for maker in makers for _ in range(4)]
    answer = cell.make()
    assert (answer["code"], answer["value"], answer["limit"]) == (V.TOO_MANY_PLANS, 8.0, 8.0)
    cell.plan(makers[0])
    assert [cell.state_of(each) for each in kept] == ["dropped"] + ["ready"] * 7


def test_a_server_keeps_a_number_of_plans(cell: PlansCell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_space, "MOST_OF_SERVER", 2)
    cell.plan(cell.other("a"))
    cell.plan(cell.other("b"))
    answer = cell.make()
    assert (answer["code"], answer["limit"]) == (V.TOO_MANY_PLANS, 2.0)


def test_and_so_many_bytes_of_samples(cell: PlansCell, monkeypatch: pytest.MonkeyPatch) -> None:
    first = cell.plan()
    monkeypatch.setattr(plan_space, "MOST_BYTES", cell_space(cell).size + 100)
    assert cell.make(cell.other())["code"] == V.TOO_MANY_PLANS
    assert cell.state_of(first) == "ready"
    second = cell.plan()
    assert [cell.state_of(each) for each in (first, second)] == ["dropped", "ready"]


def cell_space(cell: PlansCell) -> PlanSpace:
    return cell.core.pendants.plans._book._space


def test_whatever_becomes_of_plans_their_room_is_given_back(cell: PlansCell) -> None:
    maker = cell.other()
    cell.plan(maker)
    cell.operator.ask("plans.drop", plan=cell.plan())
    cell.make(goal={"kind": "lin", "pose": NOWHERE})
    assert cell.execute(cell.plan()) is V.ACCEPTED
    maker.close()
    cell.let_finish()
    assert (cell_space(cell).plans, cell_space(cell).size) == (0, 0)


def test_a_number_is_never_given_twice_and_is_unknown_in_another_cell(cell: PlansCell) -> None:
    other = PlansCell()
    other.core.pendants.plans._book._space = cell.core.pendants.plans._book._space
    assert [cell.plan(), other.plan(), cell.plan()] == [1, 2, 3]
    assert cell.execute(2) is V.PLAN_UNKNOWN
    assert other.execute(1) is V.PLAN_UNKNOWN
    assert other.operator.ask("plans.samples", plan=3)["code"] == V.PLAN_UNKNOWN
    assert other.handed == []


def test_notices_go_to_who_wants_them_only(cell: PlansCell) -> None:
    silent = cell.pendant("silent")
    cell.plan()
    assert notices(silent) == []


# Samples.


def test_samples_are_read_back_bit_for_bit(cell: PlansCell) -> None:
    plan = cell.plan(goal={"kind": "path", "waypoints": [cell.turned(0.3), cell.turned(0.1, 4)]})
    rows = cell.samples(plan)
    (kept,) = cell.core.pendants.plans._book.ready
    trajectory = kept.trajectory
    for index, row in enumerate(rows):
        time, position, velocity, acceleration = trajectory.row(index)
        assert row == [time, *position, *velocity, *acceleration]


def test_every_third_sample_with_the_tool(cell: PlansCell) -> None:
    plan = cell.plan()
    told = cell.ask_later(
        cell.operator, "plans.samples", plan=plan, first=2, count=4, every=3, with_tool=True
    )
    assert [round(row[0] * 100) for row in told["rows"]] == [2, 5, 8, 11]
    assert told["columns"][:3] == ["t", "q0", "q1"]
    for row, place in zip(told["rows"], told["tool"], strict=True):
        assert place[:3] == pytest.approx(UR5.forward(row[1:7]).position.tolist())
    assert (told["first"], told["every"], told["more"]) == (2, 3, True)


def test_the_last_rows_say_that_nothing_follows(cell: PlansCell) -> None:
    made = cell.make()
    last = made["samples"] - 1
    told = cell.ask_later(cell.operator, "plans.samples", plan=made["plan"], first=last)
    assert (len(told["rows"]), told["more"]) == (1, False)
    answer = cell.operator.ask("plans.samples", plan=made["plan"], first=last + 1)
    assert answer["code"] == V.BAD_ARGUMENT


def test_questions_for_samples_are_bounded(cell: PlansCell) -> None:
    plan = cell.plan(goal=ptp(cell.turned(1.5)))
    body = json.dumps({"op": "plans.samples", "plan": plan, "count": 100}).encode()
    for _ in range(6):
        cell.operator.send(Management(9, body))
    codes = [answer.get("code") for answer in cell.operator.answers()[-2:]]
    assert codes == [V.TOO_OFTEN, V.TOO_OFTEN]
    cell.wait(200)
    asked = 0
    while cell.ask_later(cell.operator, "plans.samples", plan=plan, count=1).get("code") is None:
        asked += 1
        assert asked <= 25
    answer = cell.operator.answers()[-1]
    assert answer["code"] == V.TOO_OFTEN
    cell.wait(round(answer["value"] * 1e3) + 10)
    assert "rows" in cell.ask_later(cell.operator, "plans.samples", plan=plan, count=1)


def test_where_a_frame_would_overflow_fewer_rows_come() -> None:
    """The longest robot that a file may describe would be far shorter of digits than this."""
    count, joints = 100, 16
    values = np.full((count, joints), -1.2345678901234567e-101)
    times: Array = np.linspace(0.0, 0.99, count)
    trajectory = Trajectory(times, values, values.copy(), values.copy(), times[::99].copy())
    steps = sample_text(1, trajectory, 0, 100, 1, None)
    turns = 0
    try:
        while True:
            next(steps)
            turns += 1
    except StopIteration as end:
        text = end.value
    told = json.loads(text)
    assert len(text) <= MOST_ANSWER
    assert 50 < len(told["rows"]) < 100
    assert told["more"] is True
    assert turns > 2
