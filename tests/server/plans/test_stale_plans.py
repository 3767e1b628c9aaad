"""A stale plan never moves anything (promise 34): each cause, and what leaves a plan ready."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from promises.promise_table import figure
from rigs.cells.planning_pendants import PlansCell, notices

from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    EnablingPosition,
    OperatingMode,
    PlanChanged,
    PlanState,
    ResetStop,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PART = (-0.4869, -0.10915, 0.413)
"""In front of the flange, 9 mm from it, where the robot is at home."""

TOOL = {"position": [0.0, 0.0, 0.1]}

Change = Callable[[PlansCell], None]


@pytest.fixture
def cell() -> Iterator[PlansCell]:
    made = PlansCell()
    made.operator.ask("tools.add", name="pen", tcp=TOOL, expected_revision=0)
    made.operator.ask("frames.add", name="table", pose=TOOL, expected_revision=0)
    made.add_box("part", PART, 0.02)
    made.wait(100)
    yield made
    assert made.controller.referee.total == 0


def revision(cell: PlansCell, of: str) -> int:
    if of == "scene":
        return int(cell.operator.ask("scene.show")["revision"])
    return int(cell.operator.ask("frames.show")[f"{of}_revision"])


def scene_grows(cell: PlansCell) -> None:
    cell.add_box("new", (-2.0, 2.0, 2.0))


def scene_shrinks(cell: PlansCell) -> None:
    cell.operator.ask("scene.remove", name="part", expected_revision=revision(cell, "scene"))


def tools_change(cell: PlansCell) -> None:
    cell.operator.ask(
        "tools.add", name="other", tcp=TOOL, expected_revision=revision(cell, "tools")
    )


def frames_change(cell: PlansCell) -> None:
    cell.operator.ask(
        "frames.add", name="shelf", pose=TOOL, expected_revision=revision(cell, "frames")
    )


def tool_is_selected(cell: PlansCell) -> None:
    cell.operator.ask("tools.select", name="pen", expected_revision=revision(cell, "tools"))


def something_is_carried(cell: PlansCell) -> None:
    cell.operator.ask("scene.attach", name="part", expected_revision=revision(cell, "scene"))


def robot_moves(cell: PlansCell) -> None:
    assert cell.operator.move(*cell.turned(0.002)) is V.ACCEPTED
    cell.let_finish()


def cap_falls(cell: PlansCell) -> None:
    assert cell.operator.mode(OperatingMode.MANUAL_REDUCED) is V.ACCEPTED


def beat() -> AuthorityBeat:
    return AuthorityBeat()


CAUSES: dict[str, tuple[Change, str]] = {
    "scene grows": (scene_grows, "scene changed"),
    "scene shrinks": (scene_shrinks, "scene changed"),
    "tools change": (tools_change, "tools changed to revision 2"),
    "frames change": (frames_change, "frames changed to revision 2"),
    "tool is selected": (tool_is_selected, "the selected tool is 'pen', it was none"),
    "carried": (something_is_carried, "what is carried changed"),
    "moved": (robot_moves, "Base (shoulder_pan_joint) stands at 0.00"),
    "cap falls": (cap_falls, "the cap of the tool speed is 0.25 m/s, it was none"),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_promise_34_a_stale_plan_is_refused_and_moves_nothing(cell: PlansCell, cause: str) -> None:
    change, words = CAUSES[cause]
    plan = cell.plan()
    change(cell)
    cell.wait(20)
    assert notices(cell.operator, plan)[-1] == (PlanState.STALE, V.PLAN_STALE)
    assert cell.execute(plan) is V.PLAN_STALE
    assert words in last_text(cell)
    cell.wait(100)
    assert cell.handed == []


def test_a_notice_names_the_joint_that_moved_and_its_unit(cell: PlansCell) -> None:
    cell.plan()
    robot_moves(cell)
    cell.wait(20)
    text = cell.operator.all(PlanChanged)[-1].text
    assert text.startswith("Base (shoulder_pan_joint) stands at 0.00")
    assert text.endswith(" rad, the plan starts at 0.000000 rad")


@pytest.mark.parametrize("cause", [cause for cause in CAUSES if cause != "moved"])
def test_promise_34_in_the_turn_of_its_cause_already(cell: PlansCell, cause: str) -> None:
    change, _ = CAUSES[cause]
    plan = cell.plan()
    before = cell.now
    change(cell)
    if cell.now == before:
        assert cell.execute(plan) in (V.PLAN_STALE, V.CHANGE_WHILE_MOVING)
    cell.wait(20)
    assert cell.execute(plan) is V.PLAN_STALE
    assert cell.handed == []


def test_promise_34_everybody_is_told_within_a_tick(cell: PlansCell) -> None:
    plan = cell.plan()
    looking_on = cell.other()
    cap_falls(cell)
    cell.wait(10 * figure(34, "told").count)
    assert notices(looking_on, plan) == [(PlanState.STALE, V.PLAN_STALE)]


def test_a_plan_expires_after_a_minute(cell: PlansCell) -> None:
    plan = cell.plan()
    for _ in range(figure(34, "kept").count * 10 - 1):
        cell.operator.send(beat())
        cell.wait(100)
    assert cell.state_of(plan) == "ready"
    cell.operator.send(beat())
    cell.wait(110)
    assert notices(cell.operator, plan)[-1] == (PlanState.EXPIRED, V.PLAN_STALE)
    assert cell.execute(plan) is V.PLAN_STALE
    assert "expired 0." in last_text(cell)


def test_a_move_of_less_than_a_milliradian_leaves_it_ready(cell: PlansCell) -> None:
    plan = cell.plan()
    assert cell.operator.move(*cell.turned(0.0009)) is V.ACCEPTED
    cell.let_finish()
    assert cell.state_of(plan) == "ready"
    assert cell.execute(plan) is V.ACCEPTED
    cell.let_finish()


def test_a_rail_may_have_moved_by_a_tenth_of_a_millimetre() -> None:
    cell = PlansCell("rail_kr5_arc", has_surroundings=False)
    rail = cell.limits.prismatic.index(True)
    assert cell.operator.mode(OperatingMode.AUTOMATIC) is V.ACCEPTED
    for shift, state in ((0.00008, "ready"), (0.00025, "stale")):
        plan = cell.plan(goal={"kind": "ptp", "joints": cell.turned(0.2, 1)})
        assert cell.operator.move(*cell.turned(shift, rail)) is V.ACCEPTED
        cell.let_finish()
        assert cell.state_of(plan) == state


def test_the_declared_noise_of_a_real_controller_makes_no_plan_stale() -> None:
    cell = PlansCell(has_surroundings=False)
    plan = cell.plan()
    cell.core.cell.feedback.says_emulated = False
    cell.reported = lambda position, _: (position[0] + 0.0015, *position[1:])
    cell.wait(100)
    assert cell.state_of(plan) == "ready"
    cell.reported = lambda position, _: (position[0] + 0.0021, *position[1:])
    cell.wait(100)
    assert cell.state_of(plan) == "stale"


def test_a_higher_cap_leaves_it_ready(cell: PlansCell) -> None:
    cap_falls(cell)
    plan = cell.plan()
    assert cell.operator.mode(OperatingMode.AUTOMATIC) is V.ACCEPTED
    cell.wait(50)
    assert cell.execute(plan) is V.ACCEPTED
    cell.let_finish()


def test_a_cap_that_falls_above_that_of_the_plan_leaves_it_ready(cell: PlansCell) -> None:
    plan = cell.plan(tool_speed=0.1)
    cap_falls(cell)
    cell.wait(50)
    assert cell.state_of(plan) == "ready"


def test_a_failed_change_leaves_it_ready(cell: PlansCell) -> None:
    plan = cell.plan()
    answer = cell.operator.ask("tools.add", name="pen", tcp=TOOL, expected_revision=7)
    assert answer["code"] == V.REVISION_CONFLICT
    cell.wait(50)
    assert cell.state_of(plan) == "ready"


# Refusals of a motion leave it ready.


def test_a_latched_stop_leaves_it_ready(cell: PlansCell) -> None:
    plan = cell.plan()
    cell.operator.stop()
    cell.wait(50)
    assert cell.execute(plan) is V.STOP_LATCHED
    assert cell.operator.code(ResetStop(cell.operator._next())) is V.ACCEPTED
    assert cell.execute(plan) is V.ACCEPTED
    cell.let_finish()


def test_so_does_an_enabling_device_that_is_not_held(cell: PlansCell) -> None:
    cap_falls(cell)
    plan = cell.plan()
    assert cell.execute(plan) is V.NOT_ENABLED
    cell.operator.enable(EnablingPosition.RELEASED, EnablingPosition.HELD)
    assert cell.execute(plan) is V.ACCEPTED


def test_so_does_a_mode_that_forbids(cell: PlansCell) -> None:
    plan = cell.plan(tool_speed=0.05)
    assert cell.operator.mode(OperatingMode.RECOVERY) is V.ACCEPTED
    assert cell.execute(plan) is V.MODE_FORBIDS
    assert cell.state_of(plan) == "ready"


def test_so_does_an_authority_that_is_not_held(cell: PlansCell) -> None:
    other = cell.other()
    plan = cell.plan(other)
    assert cell.execute(plan, other) is V.HELD_BY_OTHER
    cell.operator.release()
    assert cell.execute(plan, other) is V.NOT_IN_CONTROL
    assert other.take() is V.ACCEPTED
    assert cell.execute(plan, other) is V.ACCEPTED


def test_so_does_an_override_that_is_not_one_where_that_is_asked_for(cell: PlansCell) -> None:
    plan = cell.plan()
    assert cell.operator.speed(0.5) is V.ACCEPTED
    assert cell.execute(plan, override_is_one=1) is V.BAD_ARGUMENT
    assert last_text(cell) == "the speed override is 0.5; asked for: 1"
    assert cell.execute(plan, override_is_one=7) is V.BAD_ARGUMENT
    assert cell.operator.speed(0.0) is V.ACCEPTED
    assert cell.execute(plan) is V.OVERRIDE_ZERO
    assert cell.operator.speed(1.0) is V.ACCEPTED
    assert cell.execute(plan, override_is_one=1) is V.ACCEPTED
    cell.let_finish()


def test_so_does_an_object_that_is_being_added(cell: PlansCell) -> None:
    plan = cell.plan()
    cell.core.cell.unbuilt = "a change of the scene is being put in force"
    assert cell.execute(plan) is V.CHANGE_WHILE_MOVING
    assert cell.state_of(plan) == "ready"


def test_a_plan_from_elsewhere_is_never_executed(cell: PlansCell) -> None:
    made = cell.make(start=cell.turned(0.3))
    assert made["executable"] is False
    assert made["why"]["condition"] == "plan"
    assert cell.execute(made["plan"]) is V.NOT_STANDING
    assert cell.state_of(made["plan"]) == "ready"


def test_it_stays_ready_where_the_robot_moves_elsewhere_but_a_scene_makes_it_stale(
    cell: PlansCell,
) -> None:
    plan = cell.plan(start=cell.turned(0.3))
    robot_moves(cell)
    assert cell.state_of(plan) == "ready"
    scene_grows(cell)
    cell.wait(20)
    assert cell.state_of(plan) == "stale"


def last_text(cell: PlansCell) -> str:
    return cell.operator.all(Verdict)[-1].text
