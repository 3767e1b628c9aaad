from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.ros_face_situations import (
    PATH,
    down,
    e_stopped,
    jobs,
    latched,
    manual,
    moving,
    unknown_mode,
)
from rigs.cells.server_rig import FAILURE, MS, SUCCESS, ServerRig, ready

from openpendant.simplemsg.pendant import Activity, AuthorityChanged, AuthorityReason, SetSpeed
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_the_first_point_takes_the_authority_and_tells_everybody() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros("127.0.0.1")
    client.point(0, 0.0, 0.0)
    (change,) = pendant.all(AuthorityChanged)
    assert (change.holder, change.client) == (client.session, "ROS-I 127.0.0.1")
    assert pendant.take() is V.HELD_BY_OTHER


def held(rig: ServerRig) -> None:
    rig.holder()


def stale(rig: ServerRig) -> None:
    rig.now += 101 * MS


def override_of_0(rig: ServerRig) -> None:
    pendant = rig.holder()
    assert pendant.code(SetSpeed(pendant._next(), 0.0, 0.0)) is V.ACCEPTED
    pendant.release()


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (override_of_0, V.OVERRIDE_ZERO),
        (held, V.HELD_BY_OTHER),
        (manual, V.NOT_AUTOMATIC),
        (unknown_mode, V.NOT_AUTOMATIC),
        (latched, V.STOP_LATCHED),
        (down, V.CONTROLLER_DOWN),
        (stale, V.FEEDBACK_STALE),
        (e_stopped, V.CONTROLLER_NOT_READY),
    ],
)
def test_a_client_that_may_not_move_gets_failure_and_is_closed(
    spoil: Callable[[ServerRig], None], code: V
) -> None:
    rig = ready()
    spoil(rig)
    client = rig.ros()
    before = rig.core.cell.authority.holder
    assert client.point(0, 0.0, 0.0) is FAILURE
    assert client.point(1, 0.1, 0.0) is FAILURE
    assert len(client.closed_for) == 1
    assert rig.core.ros.refused is code
    assert rig.core.cell.authority.holder == before


def test_an_address_that_is_not_allowed_may_not_move_but_may_stop() -> None:
    rig, _ = moving()
    stranger = rig.ros("10.0.0.9")
    assert stranger.point(0, 0.0, 0.0) is FAILURE
    assert stranger.closed_for
    assert rig.core.ros.refused is V.ADDRESS_NOT_ALLOWED
    assert stranger.stop() is SUCCESS
    assert len(rig.stops) == 1


def test_an_unknown_mode_is_taken_for_automatic_where_the_cell_says_so() -> None:
    rig = ready(ros_i={"unknown_mode_is_automatic": True})
    unknown_mode(rig)
    assert rig.ros().point(0, 0.0, 0.0) is SUCCESS


def test_a_mode_that_changes_while_points_are_collected_ends_it() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH)
    manual(rig)
    rig.wait(200)
    assert jobs(rig) == []
    assert client.closed_for
    assert rig.core.ros.refused is V.NOT_AUTOMATIC


def test_authority_without_use_is_given_back_after_3_s_at_rest() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros()
    client.trajectory(*PATH)
    while rig.activity() is not Activity.IDLE or not rig.points:
        rig.wait(10)
    rested = rig.now
    while rig.core.cell.authority.holder is not None:
        rig.wait(10)
    assert rig.now == rested + 3_000 * MS
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.RELEASED
    assert client.closed_for == []
    assert client.trajectory((0.0, 0.0)) == [SUCCESS]
