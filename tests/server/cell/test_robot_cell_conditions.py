from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from rigs.cells.robot_cell_situations import GOAL, codes, emergency_stop, error, no_power, stale
from rigs.cells.server_rig import LIMITS, MS, TICK, ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.limits import float32_ceiling
from openpendant.server.events.events import ShutDown
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import Activity, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_joint_move_is_accepted_and_completed() -> None:
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(*GOAL) is V.ACCEPTED
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]
    assert rig.controller.position == GOAL
    assert rig.stops == []
    assert rig.activity() is Activity.IDLE


def test_the_first_point_leaves_on_the_call_stack_of_the_request() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.move(*GOAL)
    assert rig.points[0].sequence == 0


def test_a_planned_path_is_accepted_when_its_plan_is_there() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    assert pendant.path((0.1, 0.1), GOAL) is None
    assert rig.activity() is Activity.PLANNING
    pendant.got.clear()
    rig.plan()
    assert rig.activity() is Activity.MOVING
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]


def no_authority(rig: ServerRig, pendant: Pendant) -> None:
    pendant.release()


def latched(rig: ServerRig, pendant: Pendant) -> None:
    pendant.stop()


def no_motion_link(rig: ServerRig, pendant: Pendant) -> None:
    rig.path(ControllerPath.MOTION, False)


def no_state_link(rig: ServerRig, pendant: Pendant) -> None:
    rig.path(ControllerPath.STATE, False)


def not_finite(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.position = (math.nan, 0.0)
    rig.wait(10)


def shutting_down(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.handle(ShutDown(), rig.now)


def already_moving(rig: ServerRig, pendant: Pendant) -> None:
    pendant.move(0.5, 0.5)


def tool_being_saved(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.cell.awaited = "a change of the tools is being saved"


def scene_not_in_force(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.cell.unread = "what is kept as scene is not in force"


def lease_run_out(rig: ServerRig, pendant: Pendant) -> None:
    rig.wait(2_990)
    rig.now += TICK
    rig.report()


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (no_authority, V.NOT_IN_CONTROL),
        (lease_run_out, V.NOT_IN_CONTROL),
        (latched, V.STOP_LATCHED),
        (no_motion_link, V.CONTROLLER_DOWN),
        (no_state_link, V.CONTROLLER_DOWN),
        (stale, V.FEEDBACK_STALE),
        (not_finite, V.NOT_FINITE),
        (emergency_stop, V.CONTROLLER_NOT_READY),
        (error, V.CONTROLLER_NOT_READY),
        (no_power, V.CONTROLLER_NOT_READY),
        (shutting_down, V.SHUTTING_DOWN),
        (already_moving, V.MOVING),
        (tool_being_saved, V.CHANGE_WHILE_MOVING),
        (scene_not_in_force, V.BAD_DOCUMENT),
    ],
)
def test_no_motion_starts_where_a_condition_is_missing(
    spoil: Callable[[ServerRig, Pendant], None], code: V
) -> None:
    rig = ready()
    pendant = rig.holder()
    spoil(rig, pendant)
    before = len(rig.points)
    assert pendant.move(*GOAL) is code
    assert pendant.path((0.1, 0.1), GOAL) is code
    assert len(rig.points) == before


@pytest.mark.parametrize(("age_ns", "code"), [(0, V.ACCEPTED), (1, V.FEEDBACK_STALE)])
def test_a_motion_starts_from_a_report_of_100_ms_and_no_older(age_ns: int, code: V) -> None:
    rig = ready(watchdog={"deadline": 1.0})
    pendant = rig.holder()
    rig.now += 100 * MS + age_ns
    assert pendant.move(*GOAL) is code


def test_a_controller_that_never_reported_is_not_moved() -> None:
    rig = ServerRig()
    pendant = rig.holder()
    for path in ControllerPath:
        rig.path(path, True)
    assert pendant.move(*GOAL) is V.FEEDBACK_STALE


def test_a_second_request_while_planning_is_refused() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    assert pendant.move(*GOAL) is V.PLANNING


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_limit_that_was_rounded_to_4_bytes_is_taken_as_the_limit(joint: int, side: str) -> None:
    rig = ready()
    pendant = rig.holder()
    limit = float(getattr(LIMITS, side)[joint])
    goal = [0.0, 0.0]
    goal[joint] = math.copysign(float32_ceiling(abs(limit)), limit)
    assert pendant.move(*goal) is V.ACCEPTED


def test_a_target_beyond_a_limit_is_refused_with_joint_value_and_limit() -> None:
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(0.0, 2.0000005) is V.OUT_OF_RANGE
    verdict = pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.limit) == (1, 2.0)
    assert verdict.value == 2.0000005
    assert rig.points == []
