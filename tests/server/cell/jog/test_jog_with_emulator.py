"""Which key leads out of a limit, a singularity or a contact is told by name, and does (J23)."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.jog_undos import undo
from rigs.clock.busy_machine import SCALE
from rigs.motion.jog_pad import EmulatedPad

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import JogEnd, JogEnded, JogSpace, JogStep, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))


@pytest.fixture
def pad() -> Iterator[EmulatedPad]:
    made = EmulatedPad(EmulatedCell("ur5"))
    yield made
    assert made.cell.controller.referee.total == 0


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


LEAVING_MS = 1_000
LONGEST_ANSWER = 2e-3
"""What an answer may take of the event loop [s]."""

DOWN = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)


class Jogged(EmulatedPad):
    def __init__(self) -> None:
        super().__init__(EmulatedCell(has_surroundings=True))

    def jog(self, space: int, values: tuple[float, ...], frame: str, milliseconds: int) -> None:
        assert self.press(*values, space=space, frame=frame) is V.ACCEPTED
        self.hold(milliseconds)
        self.release()
        self.hold(500)

    def holds(self) -> list[dict[str, Any]]:
        holds: list[dict[str, Any]] = self.ask("jog.retreat")["holds"]
        return holds

    def go(self, way: dict[str, Any]) -> None:
        self.jog(way["space"], tuple(way["values"]), way["frame"], LEAVING_MS)

    def put_below(self, name: str, distance: float, revision: int = 0) -> None:
        x, y, z = self.newest_state.tool_position
        box = {"type": "box", "size": [0.3, 0.3, 0.05]}
        body = {"name": name, "shape": box, "position": [x, y, z - distance]}
        self.ask("scene.add", object=body, expected_revision=revision)

    def stand_at(self, **joints: float) -> None:
        goal = list(self.cell.position)
        for name, value in joints.items():
            goal[int(name[1:]) - 1] = value
        self.turn_to(OperatingMode.AUTOMATIC)
        assert self.pendant.move(*goal, speed=1.0) is V.ACCEPTED
        self.finish()
        assert self.pendant.outcomes()[-1][1] is V.ACCEPTED
        self.turn_to(OperatingMode.MANUAL_REDUCED)


@pytest.fixture
def jogged() -> Iterator[Jogged]:
    made = Jogged()
    yield made
    assert not any(made.cell.controller.referee.counts.values())


def test_a_robot_that_stands_free_needs_no_way_out(jogged: Jogged) -> None:
    assert jogged.holds() == []


def test_out_of_a_joint_limit_leads_that_joint_the_other_way(jogged: Jogged) -> None:
    jogged.stand_at(j6=jogged.cell.limits.upper[5] - 0.15)
    jogged.jog(JogSpace.JOINTS, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "", 2_000)
    hold = next(each for each in jogged.holds() if each["reason"] == "joint-limit")
    assert hold["text"].startswith("Wrist-Twist stands at ")
    assert [way["press"] for way in hold["ways"]] == ["Wrist-Twist towards -"]
    jogged.go(hold["ways"][0])
    assert "joint-limit" not in {each["reason"] for each in jogged.holds()}


@pytest.mark.parametrize("near", [0.0, 0.02, -0.02])
def test_out_of_a_wrist_singularity_leads_a_joint(jogged: Jogged, near: float) -> None:
    jogged.stand_at(j5=near)
    (hold,) = jogged.holds()
    assert (hold["reason"], hold["text"]) == ("singularity", "it stands at the wrist singularity")
    (way,) = hold["ways"]
    assert way["press"].startswith("Wrist-Pitch towards ")
    jogged.go(way)
    assert jogged.holds() == []


def test_out_of_two_singularities_at_once_lead_two_joints_together(jogged: Jogged) -> None:
    """The elbow is straight and the wrist, too: either joint alone leaves it at the other."""
    jogged.stand_at(j3=0.0, j5=0.0)
    (hold,) = jogged.holds()
    told = "it stands at the elbow singularity and near another, so one joint alone does not"
    assert hold["text"].startswith(told)
    (way,) = hold["ways"]
    assert way["press"].startswith("Upper-Arm towards ")
    assert " and Wrist-Pitch towards " in way["press"]
    for _ in range(2):  # at 250 mm/s a long arm takes longer than one press
        jogged.go(way)
    assert jogged.holds() == []


def test_out_of_a_stretched_arm_leads_the_tool_back_or_a_joint(jogged: Jogged) -> None:
    """The tool is jogged outwards until the elbow is all but straight."""
    jogged.stand_at(j2=-0.9, j3=0.7, j4=-1.2)
    toward = tuple(jogged.newest_state.tool_position)
    reach = max(abs(toward[0]), abs(toward[1]))
    outward = (toward[0] / reach, toward[1] / reach, 0.0, 0.0, 0.0, 0.0)
    jogged.jog(JogSpace.TOOL, outward, "base", 4_000)
    (hold,) = jogged.holds()
    assert hold["text"] == "it stands at the elbow singularity"
    assert (hold["ways"][0]["frame"], hold["ways"][-1]["press"]) == ("base", "Upper-Arm towards +")
    jogged.go(hold["ways"][0])
    assert jogged.holds() == []


def test_out_of_a_contact_leads_the_opposite_of_the_key_that_led_there(jogged: Jogged) -> None:
    jogged.put_below("table", 0.2)
    jogged.jog(JogSpace.TOOL, DOWN, "base", 3_000)
    (hold,) = jogged.holds()
    assert hold["reason"] == "collision"
    assert "table" in hold["text"]
    assert hold["ways"][0]["press"] == "tool Z+ in base"
    joint = hold["ways"][1]
    assert joint["press"].startswith("Lower-Arm ")
    jogged.go(hold["ways"][0])
    assert jogged.holds() == []

    jogged.jog(JogSpace.TOOL, DOWN, "base", 3_000)
    jogged.go(joint)
    assert jogged.holds() == []


def test_the_way_out_is_told_once_the_robot_stands(jogged: Jogged) -> None:
    jogged.turn_to(OperatingMode.AUTOMATIC)
    jogged.pendant.move(*(value + 0.5 for value in jogged.cell.position), speed=0.2)
    jogged.hold(300)
    assert jogged.pendant.ask("jog.retreat")["code"] == V.MOVING


def test_an_answer_takes_less_than_2_ms_of_the_event_loop(jogged: Jogged) -> None:
    for number in range(10):
        jogged.put_below(f"plate {number}", 0.2 + 0.1 * number, revision=number)
    jogged.jog(JogSpace.TOOL, DOWN, "base", 3_000)
    assert jogged.holds()
    least = 1.0
    for _ in range(100):  # what else the machine does makes most of them dearer, not all
        began = time.thread_time()
        jogged.ask("jog.retreat")
        least = min(least, time.thread_time() - began)
        if least <= LONGEST_ANSWER * SCALE:
            break
    assert least <= LONGEST_ANSWER * SCALE
