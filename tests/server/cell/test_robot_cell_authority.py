from __future__ import annotations

import pytest
from rigs.cells.robot_cell_situations import GOAL, codes, moving
from rigs.cells.server_rig import MS, ready

from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_lease_that_runs_out_in_motion_aborts_it_at_that_tick() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.move(*GOAL, speed=0.1)
    began = rig.now
    rig.wait(2_990)
    assert rig.stops == []
    rig.wait(10)
    assert rig.stops == [began + 3_000 * MS]
    assert codes(pendant) == [V.AUTHORITY_LOST]


def test_a_lease_that_runs_out_while_planning_refuses_the_request() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
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
