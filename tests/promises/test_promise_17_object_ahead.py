"""Promise 17: an object put in the way of a moving robot, at any time, is never touched."""

import json

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Management
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))
SWEEP = 1.5
"""How far the first joint turns [rad]."""


def run(random: np.random.Generator) -> V | None:
    """Put a ball somewhere ahead at a random time.

    Returns:
        How the motion ended; None where the arm was at the place of the ball already.
    """
    cell = EmulatedCell("ur5", has_surroundings=True)
    pendant = cell.holder()
    start = cell.position
    ahead = random.uniform(0.25, 1.0)
    place = UR5.forward([start[0] + ahead * SWEEP, *start[1:]]).position
    place = place + random.normal(0.0, 0.03, 3)
    ball = SceneObject("ball", Sphere(0.05), tuple(place.tolist()))
    model = CollisionModel(UR5, Scene((ball,)))
    pairs = [index for index, pair in enumerate(model.pairs) if "ball" in pair]
    assert pendant.move(start[0] + SWEEP, *start[1:], speed=0.3) is V.ACCEPTED
    # The ball comes while the arm is on its way, and not where the arm is already.
    cell.wait(int(random.integers(2, 60)) * 10)
    free = float(model.clearances(np.array(cell.position))[pairs].min())
    if free < 0.05:
        return None
    pendant.last_request += 1
    body = {"op": "scene.add", "object": _json(ball), "expected_revision": 0}
    pendant.send(Management(pendant.last_request, json.dumps(body).encode()))
    for _ in range(1_000):
        pendant.send(AuthorityBeat())
        cell.wait(10)
        nearest = float(model.clearances(np.array(cell.position))[pairs].min())
        assert nearest > 0.0, "the arm touches the ball"
        if cell.core.cell.activity is Activity.IDLE:
            break
    assert cell.controller.referee.total == 0
    return pendant.outcomes()[-1][1]


def _json(ball: SceneObject) -> dict[str, object]:
    assert isinstance(ball.shape, Sphere)
    shape = {"type": "sphere", "radius": ball.shape.radius}
    return {"name": ball.name, "shape": shape, "position": list(ball.position)}


def test_promise_17_a_ball_put_ahead_of_the_arm_is_never_touched() -> None:
    random = np.random.default_rng(17)
    ends = [run(random) for _ in range(5)]
    assert V.PATH_IN_COLLISION in ends


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(10))
def test_promise_17_five_hundred_balls_are_never_touched(seed: int) -> None:
    random = np.random.default_rng([17, seed])
    ends = [run(random) for _ in range(50)]
    assert V.PATH_IN_COLLISION in ends
    assert set(ends) <= {V.PATH_IN_COLLISION, V.ACCEPTED, None}
