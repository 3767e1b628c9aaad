from __future__ import annotations

import pytest
from rigs.cells.server_rig import LIMITS

from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.trajectory_execution import TrajectoryExecution
from openpendant.server.events.effects import ReconnectController, SendStop
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.simplemsg import JointFeedback, ValidField, joint_array
from openpendant.simplemsg.verdicts import VerdictCode as V

SECOND = 1_000_000_000
WHY = Refusal(V.STOPPED, "why")


@pytest.fixture
def driving() -> TrajectoryExecution:
    link = ControllerLink()
    return TrajectoryExecution(
        link, LIMITS, Feedback(2, link), lambda *_: [], lambda *_: [], lambda _: []
    )


@pytest.mark.parametrize(
    ("up", "linked"),
    [
        ((), False),
        ((ControllerPath.MOTION,), False),
        ((ControllerPath.STATE,), False),
        ((ControllerPath.MOTION, ControllerPath.STATE), True),
    ],
)
def test_a_motion_needs_both_links(
    driving: TrajectoryExecution, up: tuple[ControllerPath, ...], linked: bool
) -> None:
    for path in up:
        driving.path_changed(path, True)
    assert driving.is_linked is linked


@pytest.mark.parametrize(("is_up", "is_dropped"), [(True, True), (False, False)])
def test_a_stop_is_waited_for_only_where_it_went(
    driving: TrajectoryExecution, is_up: bool, is_dropped: bool
) -> None:
    driving.path_changed(ControllerPath.MOTION, is_up)
    (stop,) = driving.halt(WHY, 0)
    assert isinstance(stop, SendStop)
    dropped = any(isinstance(item, ReconnectController) for item in driving.settle(2 * SECOND))
    assert dropped is is_dropped


def test_a_stop_on_a_link_that_was_lost_since_is_waited_for_no_more(
    driving: TrajectoryExecution,
) -> None:
    driving.path_changed(ControllerPath.MOTION, True)
    driving.halt(WHY, 0)
    driving.path_changed(ControllerPath.MOTION, False)
    assert driving.settle(2 * SECOND) == []


@pytest.mark.parametrize(
    ("path", "is_known"), [(ControllerPath.STATE, False), (ControllerPath.MOTION, True)]
)
def test_nothing_of_a_state_link_that_was_lost_is_believed(
    path: ControllerPath, is_known: bool
) -> None:
    link, none = ControllerLink(), joint_array(())
    feedback = Feedback(2, link)
    driving = TrajectoryExecution(
        link, LIMITS, feedback, lambda *_: [], lambda *_: [], lambda _: []
    )
    feedback.take(JointFeedback(0, ValidField.POSITION, 0.0, none, none, none), 0)
    driving.path_changed(path, False)
    assert (feedback.position is not None) is is_known
