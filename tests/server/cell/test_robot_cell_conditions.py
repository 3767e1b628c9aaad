import math
from collections.abc import Callable

import pytest
from rigs.cells.expectations import refusal_from
from rigs.cells.robot_cell_situations import (
    GOAL,
    codes,
    emergency_stop,
    error,
    in_control,
    in_planning,
    moving,
    no_power,
    planning,
    stale,
)
from rigs.cells.server_rig import LIMITS, MS, TICK, ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.limits import float32_ceiling
from openpendant.server.cell.interlocks import outside_limits
from openpendant.server.events.events import ShutDown
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import Activity, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

Happening = Callable[[ServerRig, Pendant], object]


def test_a_joint_move_leaves_on_the_call_stack_of_its_request_and_arrives() -> None:
    rig, pendant = in_control()
    assert pendant.move(*GOAL) is V.ACCEPTED
    assert rig.points[0].sequence == 0
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]
    assert (rig.controller.position, rig.stops, rig.activity()) == (GOAL, [], Activity.IDLE)


def test_a_planned_path_is_accepted_when_its_plan_is_there() -> None:
    rig, pendant = in_control(plans_at_once=False)
    assert pendant.path((0.1, 0.1), GOAL) is None
    assert rig.activity() is Activity.PLANNING
    pendant.got.clear()
    rig.plan()
    assert rig.activity() is Activity.MOVING
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]


def not_finite(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.position = (math.nan, 0.0)
    rig.wait(10)


def tool_being_saved(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.cell.awaited = "a change of the tools is being saved"


def scene_not_in_force(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.cell.unread = "what is kept as scene is not in force"


def lease_run_out(rig: ServerRig, pendant: Pendant) -> None:
    rig.wait(2_990)
    rig.now += TICK
    rig.report()


MISSING: dict[str, tuple[Happening, V]] = {
    "authority": (lambda rig, pendant: pendant.release(), V.NOT_IN_CONTROL),
    "a lease that has not run out": (lease_run_out, V.NOT_IN_CONTROL),
    "no latched stop": (lambda rig, pendant: pendant.stop(), V.STOP_LATCHED),
    "motion link": (lambda rig, _: rig.path(ControllerPath.MOTION, False), V.CONTROLLER_DOWN),
    "state link": (lambda rig, _: rig.path(ControllerPath.STATE, False), V.CONTROLLER_DOWN),
    "a fresh report": (stale, V.FEEDBACK_STALE),
    "a position that is a number": (not_finite, V.NOT_FINITE),
    "no emergency stop": (emergency_stop, V.CONTROLLER_NOT_READY),
    "no error": (error, V.CONTROLLER_NOT_READY),
    "drive power": (no_power, V.CONTROLLER_NOT_READY),
    "no shut-down": (lambda rig, _: rig.core.handle(ShutDown(), rig.now), V.SHUTTING_DOWN),
    "no other motion": (lambda _, pendant: pendant.move(0.5, 0.5), V.MOVING),
    "no motion that is planned": (in_planning, V.PLANNING),
    "no tool that is being saved": (tool_being_saved, V.CHANGE_WHILE_MOVING),
    "the kept scene in force": (scene_not_in_force, V.BAD_DOCUMENT),
}


@pytest.mark.parametrize(("spoil", "code"), MISSING.values(), ids=MISSING)
def test_no_motion_starts_where_a_condition_is_missing(spoil: Happening, code: V) -> None:
    rig, pendant = in_control()
    spoil(rig, pendant)
    before = len(rig.points)
    assert pendant.move(*GOAL) is code
    assert pendant.path((0.1, 0.1), GOAL) is code
    assert len(rig.points) == before


@pytest.mark.parametrize(("age_ns", "code"), [(0, V.ACCEPTED), (1, V.FEEDBACK_STALE)])
def test_a_motion_starts_from_a_report_of_100_ms_and_no_older(age_ns: int, code: V) -> None:
    rig, pendant = in_control(watchdog={"deadline": 1.0})
    rig.now += 100 * MS + age_ns
    assert pendant.move(*GOAL) is code


def test_a_controller_that_never_reported_is_not_moved() -> None:
    rig = ServerRig()
    pendant = rig.holder()
    for path in ControllerPath:
        rig.path(path, True)
    assert pendant.move(*GOAL) is V.FEEDBACK_STALE


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_limit_that_was_rounded_to_4_bytes_is_taken_as_the_limit(joint: int, side: str) -> None:
    _, pendant = in_control()
    limit = float(getattr(LIMITS, side)[joint])
    goal = [0.0, 0.0]
    goal[joint] = math.copysign(float32_ceiling(abs(limit)), limit)
    assert pendant.move(*goal) is V.ACCEPTED


def test_a_target_beyond_a_limit_is_refused_with_joint_value_and_limit() -> None:
    rig, pendant = in_control()
    assert pendant.move(0.0, 2.0000005) is V.OUT_OF_RANGE
    verdict = pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.value, verdict.limit) == (1, 2.0000005, 2.0)
    assert rig.points == []


def standing(position: tuple[float, float], **modes: str) -> ServerRig:
    rig = ready(modes=modes)
    rig.controller.be_moved(position)
    rig.wait(20)
    return rig


@pytest.mark.parametrize("position", [(2.01, 0.0), (-2.01, 0.0), (0.0, 2.01), (0.0, -2.01)])
def test_each_end_of_each_joints_range_is_looked_at(position: tuple[float, float]) -> None:
    rig = standing(position)
    assert rig.holder().move(0.0, 0.0) is V.OUTSIDE_LIMITS
    refusal = refusal_from(outside_limits(rig.core.cell))
    joint = 0 if position[0] else 1
    assert (refusal.joint, refusal.limit) == (joint, 2.0 if position[joint] > 0 else -2.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_rests_a_hair_beyond_its_range_is_not_outside(side: float) -> None:
    rig = standing((side * 2.0009, 0.0))
    assert outside_limits(rig.core.cell) is None


def test_where_a_controllers_own_selector_rules_only_a_jog_leads_out() -> None:
    rig = standing((2.05, 0.0), selector="controller")
    pad = JogPad(rig)
    assert pad.pendant.move(0.0, 0.0) is V.OUTSIDE_LIMITS
    assert pad.press(-1.0, 0.0) is V.ACCEPTED


def test_a_plan_that_is_refused_moves_nothing() -> None:
    rig, pendant = planning()
    pendant.got.clear()
    rig.plan(Refusal(V.PLANNER_FAILED))
    assert pendant.verdicts() == [(pendant.last_request, V.PLANNER_FAILED)]
    assert (rig.activity(), rig.points) == (Activity.IDLE, [])


def test_a_plan_is_worth_nothing_once_the_robot_stands_elsewhere() -> None:
    rig, pendant = planning()
    rig.controller.position = (0.02, 0.0)
    rig.wait(20)
    pendant.got.clear()
    rig.plan()
    assert pendant.verdicts() == [(pendant.last_request, V.NOT_STANDING)]


@pytest.mark.parametrize("spoil", [emergency_stop, error, no_power, stale])
def test_a_plan_is_worth_nothing_once_a_condition_is_missing(spoil: Happening) -> None:
    rig, pendant = planning()
    spoil(rig, pendant)
    rig.plan()
    assert (rig.points, rig.activity()) == ([], Activity.IDLE)


def test_a_plan_that_comes_twice_starts_one_motion() -> None:
    rig, _ = planning()
    job = rig.jobs[0]
    rig.plan()
    assert rig.planned(job, rig.plan_of(job)) == []


def test_an_answer_that_holds_the_plan_of_another_job_moves_nothing() -> None:
    rig, pendant = planning()
    pendant.release()
    pendant.take()
    pendant.path((0.1, 0.1), (0.2, 0.2))
    first, second = rig.jobs
    assert rig.planned(second, rig.plan_of(first)) == []
    assert rig.activity() is Activity.PLANNING


def test_the_plan_of_a_refused_request_does_not_serve_the_next() -> None:
    rig, pendant = planning()
    pendant.release()
    pendant.take()
    pendant.path((0.1, 0.1), (0.2, 0.2))
    assert rig.plan() == []
    rig.plan()
    assert rig.activity() is Activity.MOVING


def test_a_lease_that_runs_out_in_motion_aborts_it_at_that_tick() -> None:
    rig, pendant = in_control()
    pendant.move(*GOAL, speed=0.1)
    began = rig.now
    rig.wait(2_990)
    assert rig.stops == []
    rig.wait(10)
    assert rig.stops == [began + 3_000 * MS]
    assert codes(pendant) == [V.AUTHORITY_LOST]


def test_a_lease_that_runs_out_while_planning_refuses_the_request() -> None:
    rig, pendant = planning()
    pendant.got.clear()
    rig.wait(3_000)
    assert pendant.verdicts() == [(pendant.last_request, V.AUTHORITY_LOST)]
    assert rig.plan() == []


def test_giving_the_authority_back_in_motion_stops_it() -> None:
    rig, pendant = moving()
    assert pendant.release() is V.ACCEPTED
    assert codes(pendant) == [V.AUTHORITY_LOST]
    assert len(rig.stops) == 1


@pytest.mark.parametrize("planning", [True, False])
def test_a_holder_that_disconnects_leaves_nothing_moving(planning: bool) -> None:
    rig = ready(plans_at_once=not planning)
    pendant, other = rig.holder(), rig.pendant("other")
    pendant.path((0.1, 0.1), GOAL)
    told = len(pendant.got)
    pendant.close()
    if planning:
        rig.plan()
    sent = len(rig.points)
    rig.wait(100)
    assert len(rig.stops) == (0 if planning else 1)
    assert len(rig.points) == sent
    assert len(pendant.got) == told
    assert other.take() is V.ACCEPTED
