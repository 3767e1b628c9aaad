from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.jog_undos import step
from rigs.cells.server_rig import MS, ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.cell.execution.setpoint_sources import Press, PressCounter
from openpendant.server.endpoints.pendant.notifications import RecentStates
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Activity, JogRelease
from openpendant.simplemsg.verdicts import VerdictCode as V


def jogging() -> tuple[ServerRig, JogPad]:
    rig = ready(modes={"initial": "manual_high"})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    return rig, pad


def let_go(pad: JogPad) -> None:
    assert pad.release() is V.ACCEPTED


def fall_silent(pad: JogPad) -> None:
    pad.is_pressed = False


@pytest.mark.parametrize("end", [let_go, fall_silent])
def test_a_press_that_took_over_from_a_braking_one_ends_as_any_other(
    end: Callable[[JogPad], None],
) -> None:
    rig, pad = jogging()
    let_go(pad)
    pad.hold(20)
    assert rig.activity() is Activity.JOGGING
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    end(pad)
    pad.hold(500)
    assert rig.activity() is Activity.IDLE
    before = rig.controller.position
    pad.hold(100)
    assert rig.controller.position == before


def test_the_release_of_an_earlier_press_does_not_end_the_one_that_is_held() -> None:
    rig, pad = jogging()
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    assert pad.pendant.code(JogRelease(900, 1)) is V.NOTHING_TO_CONTROL
    pad.hold(300)
    assert rig.activity() is Activity.JOGGING


def test_the_release_of_another_connection_ends_no_press() -> None:
    rig, pad = jogging()
    other = rig.pendant("other")
    assert other.code(JogRelease(900, pad.press_number)) is V.NOTHING_TO_CONTROL
    pad.hold(300)
    assert rig.activity() is Activity.JOGGING


def test_a_connection_that_ends_gives_no_other_its_dead_numbers_back() -> None:
    presses = PressCounter()
    for session in (1, 2):
        assert isinstance(presses.begin(session, 5, 0.15, 0), Press)
    presses.forget(2)
    again = presses.begin(1, 5, 0.15, 0)
    assert isinstance(again, Refusal)
    assert again.code is V.PRESS_DEAD


def test_a_state_that_was_the_newest_for_more_than_half_a_second_is_no_recent_one() -> None:
    states = RecentStates()
    states.sent(7, 0)
    assert states.fault(7, 500 * MS) is None
    stale = states.fault(7, 500 * MS + 1)
    assert stale is not None
    assert stale.code is V.PRESS_STALE


def test_an_increment_is_planned_under_the_cap_that_was_lowered() -> None:
    rig = ready(plans_at_once=False, modes={"initial": "manual_reduced"})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.speed(1.0, 0.1) is V.ACCEPTED
    step(pad, 0.3, 0.0)
    (job,) = rig.jobs
    assert isinstance(job, JointPathJob)
    assert job.tool_speed == 0.1
