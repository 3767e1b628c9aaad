from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.motion.jog_pad import EmulatedPad

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import JogEnd, JogEnded, JogSpace, JogStep, JogUndo
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))


@pytest.fixture
def pad() -> Iterator[EmulatedPad]:
    made = EmulatedPad(EmulatedCell("ur5"))
    yield made
    assert made.cell.controller.referee.total == 0


def undo(pad: EmulatedPad) -> V | None:
    return pad.pendant.code(JogUndo(pad._request(), 1.0))


def test_a_held_joint_key_moves_that_joint_and_release_ends_it(pad: EmulatedPad) -> None:
    before = pad.cell.position
    assert pad.press(0.0, 0.0, 1.0, 0.0, 0.0, 0.0) is V.ACCEPTED
    jog = pad.pendant.last_request
    pad.hold(500)
    assert pad.release() is V.ACCEPTED
    pad.finish()
    (ended,) = pad.pendant.all(JogEnded)
    moved = np.array(pad.cell.position) - np.array(before)
    assert moved[2] > 0.05
    assert np.abs(np.delete(moved, 2)).max() < 1e-6
    assert ended.reason == JogEnd.RELEASED
    assert ended.stop_time > 0.0
    assert pad.pendant.outcomes()[-1] == (jog, V.ACCEPTED)


@pytest.mark.parametrize(
    ("frame", "values"),
    [
        ("base", (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        ("tool", (0.0, 0.5, -0.5, 0.0, 0.0, 0.0)),
        ("base", (1.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    ],
)
def test_a_held_tool_key_moves_the_tool_along_its_axis(
    pad: EmulatedPad, frame: str, values: tuple[float, ...]
) -> None:
    before = UR5.forward(pad.cell.position)
    assert pad.press(*values, space=JogSpace.TOOL, frame=frame) is V.ACCEPTED
    pad.hold(400)
    pad.release()
    pad.finish()
    after = UR5.forward(pad.cell.position)
    axes = before.rotation if frame == "tool" else np.eye(3)
    way = axes.T @ (after.position - before.position)
    direction = np.array(values[:3]) / np.linalg.norm(values[:3])
    assert way @ direction > 0.03
    assert np.linalg.norm(way - (way @ direction) * direction) < 1e-4


def test_a_second_key_takes_over_without_a_stop(pad: EmulatedPad) -> None:
    pad.press(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    first = pad.pendant.last_request
    pad.hold(300)
    assert pad.press(1.0, 1.0, 0.0, 0.0, 0.0, 0.0) is V.ACCEPTED
    assert pad.pendant.outcomes()[-1] == (first, V.ACCEPTED)
    pad.hold(300)
    assert min(pad.sent[-1].velocities[:2]) > 0.05
    pad.release()
    pad.finish()


def test_an_undo_leads_back_to_where_the_jog_began(pad: EmulatedPad) -> None:
    before = pad.cell.position
    pad.press(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, space=JogSpace.TOOL, frame="base")
    pad.hold(600)
    pad.release()
    pad.finish()
    assert undo(pad) is V.ACCEPTED
    pad.finish()
    assert pad.pendant.outcomes()[-1] == (pad.pendant.last_request, V.ACCEPTED)
    assert np.abs(np.array(pad.cell.position) - before).max() < 1e-4
    assert undo(pad) is V.NO_JOG_TO_UNDO


def test_the_rest_of_an_undo_goes_on_along_the_way_and_not_over_what_it_had_done(
    pad: EmulatedPad,
) -> None:
    before = pad.cell.position
    pad.press(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    pad.hold(1_500)
    corner = pad.cell.position
    pad.press(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    pad.hold(1_500)
    pad.release()
    pad.hold(1_000)
    assert undo(pad) is V.ACCEPTED
    while pad.cell.position[0] > 0.5 * (before[0] + corner[0]):
        pad.hold(50)
    pad.pendant.stop()
    pad.hold(500)
    halfway = pad.cell.position
    assert pad.pendant.reset() is V.ACCEPTED
    pad.let_go()
    pad.squeeze()
    sent = len(pad.sent)
    assert undo(pad) is V.ACCEPTED
    pad.finish()
    rest = np.array([point.positions[:6] for point in pad.sent[sent:]])
    assert rest[:, 0].max() <= halfway[0] + 1e-4, "the way to the corner is not gone again"
    assert np.abs(np.array(pad.cell.position) - before).max() < 1e-4
    assert undo(pad) is V.NO_JOG_TO_UNDO


def test_a_step_moves_the_tool_by_its_increment(pad: EmulatedPad) -> None:
    before = UR5.forward(pad.cell.position).position
    by = joint_array((0.0, 0.0, 0.01))
    step = JogStep(pad._request(), 1.0, JogSpace.TOOL, "base", 6, by)
    assert pad.pendant.code(step) is V.ACCEPTED
    pad.finish()
    assert pad.pendant.outcomes()[-1][1] is V.ACCEPTED
    after = UR5.forward(pad.cell.position).position
    assert after - before == pytest.approx((0.0, 0.0, 0.01), abs=1e-5)
