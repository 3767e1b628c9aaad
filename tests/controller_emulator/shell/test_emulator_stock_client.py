"""The emulator alone suits the stock ROS-I client: its placeholders and what it does not know."""

import pytest
from rigs.cells.controller_rig import FAILURE, LIMITS, SUCCESS, ControllerRig, ratio_point

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg import CommType, MsgType, message_type

PLACEHOLDER = 10.0
SECOND = 1_000_000_000


def arrives_after(rig: ControllerRig, joint: float, most_ms: int) -> int:
    """Return after how many milliseconds the first joint stands at a value."""
    for elapsed in range(0, most_ms, 10):
        if abs(rig.position[0] - joint) < 1e-6 and not rig.status.in_motion:
            return elapsed
        rig.wait(10)
    pytest.fail(f"not at {joint} after {most_ms} ms but at {rig.position[0]}")


def test_the_placeholder_costs_nothing_where_the_robot_stands(rig: ControllerRig) -> None:
    points = [(0.0, PLACEHOLDER), (0.1, 0.5), (0.2, 0.5)]
    for number, (joint, duration) in enumerate(points):
        assert rig.code(ratio_point(number, (joint, 0.0), duration)) is SUCCESS
    assert 900 <= arrives_after(rig, 0.2, 3_000) <= 1_300


def test_it_costs_nothing_in_a_download_either(rig: ControllerRig) -> None:
    topic = CommType.TOPIC
    rig.send(ratio_point(-1, (0.0, 0.0), PLACEHOLDER, comm_type=topic))
    rig.send(ratio_point(1, (0.1, 0.0), 0.5, comm_type=topic))
    rig.send(ratio_point(-3, (0.2, 0.0), 0.5, comm_type=topic))
    assert 900 <= arrives_after(rig, 0.2, 3_000) <= 1_300


@pytest.mark.parametrize(("ratio", "share"), [(0.5, 0.5), (0.1, 0.1), (0.0, 0.1)])
def test_elsewhere_velocity_says_how_fast(ratio: float, share: float, rig: ControllerRig) -> None:
    assert rig.code(ratio_point(0, (0.4, 0.0), PLACEHOLDER, velocity=ratio)) is SUCCESS
    least = 1_000 * 0.4 / (share * LIMITS.velocity[0])
    assert least - 20 <= arrives_after(rig, 0.4, 4_000) <= least + 700
    assert rig.violations == {}


@pytest.mark.parametrize("duration", [9.99, 10.01])
def test_any_other_duration_is_meant(duration: float, rig: ControllerRig) -> None:
    assert rig.code(ratio_point(0, (0.0, 0.0), duration)) is SUCCESS
    assert rig.code(ratio_point(1, (0.1, 0.0), 0.5)) is SUCCESS
    assert arrives_after(rig, 0.1, 12_000) >= 9_900


def test_a_first_point_far_away_is_still_within_the_limits() -> None:
    assert ControllerRig().code(ratio_point(0, (3.0, 0.0), PLACEHOLDER)) is FAILURE


@pytest.mark.parametrize("is_wanted", [True, False])
def test_type_15_can_be_switched_off(*, is_wanted: bool) -> None:
    settings = EmulatorSettings.model_validate({"joint_feedback": is_wanted})
    controller = build_controller(settings, SECOND)
    kinds = {message_type(message) for message in controller.state_messages(SECOND)}
    assert (MsgType.JOINT_FEEDBACK in kinds) is is_wanted
    assert {MsgType.JOINT_POSITION, MsgType.STATUS} <= kinds
