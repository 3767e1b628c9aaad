from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import MS
from rigs.peers.server_clients import Pendant

from openpendant.motion.trajectory.time_scaling import RAMP
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.simplemsg import (
    JointFeedback,
    JointPosition,
    Received,
    Status,
    TriState,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, MotionControl
from openpendant.simplemsg.pendant import MotionControlAction as Action
from openpendant.simplemsg.verdicts import VerdictCode as V

LEAD_NS = round(ControllerLink().lead * 1e9)
SHOWN_NS = round((RAMP + 0.2) * 1e9)
"""From the pause to its ramp's end, and from there until it shows, where the limits allow it."""


class ShiveringCell(EmulatedCell):
    def __init__(
        self, *, speed_noise: float = 0.0, place_noise: float = 0.0, has_speeds: bool = True
    ) -> None:
        self.chance = random.Random(5)
        self.speed_noise, self.place_noise, self.has_speeds = speed_noise, place_noise, has_speeds
        super().__init__()

    def noisy(self, values: tuple[float, ...], noise: float) -> tuple[float, ...]:
        return joint_array([value + self.chance.uniform(-noise, noise) for value in values[:6]])

    def _hear(self, path: ControllerPath, received: Received) -> None:
        match received:
            case JointFeedback() if not self.has_speeds:
                received = replace(received, valid_fields=ValidField.POSITION)
            case JointFeedback():
                speeds = self.noisy(received.velocities, self.speed_noise)
                received = replace(received, velocities=speeds)
            case Status():
                # One that tells nothing of motion leaves it to its joints.
                received = replace(received, in_motion=TriState.UNKNOWN)
        if isinstance(received, JointFeedback):
            places = self.noisy(received.positions, self.place_noise)
            received = replace(received, positions=places)
        if not isinstance(received, JointPosition):
            super()._hear(path, received)

    def activity(self) -> Activity:
        return self.core.cell.activity

    def until_shown(self) -> int | None:
        """Return how long after the joints rested PAUSED showed [ns]; None after 3 s."""
        rested = None
        for _ in range(600):
            self.wait(5)
            if rested is None and not any(self.controller.motion(self.now)[1]):
                rested = self.now
            if self.activity() is Activity.PAUSED:
                return max(self.now - (rested or self.now), 0)
        return None


NOISES: dict[str, dict[str, Any]] = {
    "exact": {},
    "noisy speeds": {"speed_noise": 0.04},
    "no speeds": {"has_speeds": False},
    "noisy places and no speeds": {"has_speeds": False, "place_noise": 5e-5},
}


def paused(cell: ShiveringCell, after: int) -> Pendant:
    cell.wait(300)
    pendant = cell.holder()
    assert pendant.move(*(value + 0.8 for value in cell.position), speed=0.3) is V.ACCEPTED
    cell.wait(after)
    assert cell.activity() is Activity.MOVING
    pendant.send(AuthorityBeat())
    assert pendant.code(MotionControl(pendant._next(), Action.PAUSE)) is V.ACCEPTED
    assert cell.activity() is Activity.PAUSING
    return pendant


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("after", [60, 230, 500])
def test_a_pause_shows_within_0_2_s_of_rest(noise: str, after: int) -> None:
    cell = ShiveringCell(**NOISES[noise])
    paused(cell, after)
    began = cell.now
    late = cell.until_shown()
    assert late is not None
    assert late <= 200 * MS
    # What had left ahead of the robot runs first, then the ramp.
    assert cell.now - began <= LEAD_NS + SHOWN_NS + 50 * MS


def test_a_robot_that_shivers_for_ever_is_paused_all_the_same() -> None:
    cell = ShiveringCell()
    paused(cell, 300)
    cell.speed_noise, cell.place_noise = 0.5, 9e-4
    late = cell.until_shown()
    assert late is not None
    assert late <= 1_000 * MS


def test_with_noisy_speeds_a_paused_motion_goes_on_arrives_and_stops() -> None:
    cell = ShiveringCell(speed_noise=0.04)
    pendant = paused(cell, 300)
    assert cell.until_shown() is not None
    assert pendant.code(MotionControl(pendant._next(), Action.RESUME)) is V.ACCEPTED
    for _ in range(20):
        cell.wait(100)
        pendant.send(AuthorityBeat())
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED]
    assert pendant.move(*(value - 0.8 for value in cell.position)) is V.ACCEPTED
    cell.wait(200)
    pendant.stop()
    assert cell.activity() is Activity.STOPPING
    cell.wait(600)
    assert cell.activity() is Activity.IDLE
    assert not any(cell.controller.motion(cell.now)[1])
