from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import jobs_in

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.clearance import MARGIN
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.motion.trajectory.ptp import straight_move
from openpendant.server.events.effects import Effect
from openpendant.server.planning.jobs import JointPathJob, WayCheckJob
from openpendant.server.refusal import refusal_of
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Home
from openpendant.simplemsg.verdicts import VerdictCode as V


class PlanningCell(EmulatedCell):
    def __init__(self, **settings: Any) -> None:
        self.jobs: list[object] = []
        super().__init__(has_surroundings=True, **settings)
        self.operator = self.holder()
        self.wait(100)

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.jobs += jobs_in(outgoing)
        return super().perform(outgoing)

    def let_finish(self) -> None:
        for _ in range(400):
            self.operator.send(AuthorityBeat())
            self.wait(100)
            if self.core.cell.activity is Activity.IDLE:
                return
        raise AssertionError("the motion does not end")

    def add_ball(self, position: list[float], radius: float) -> None:
        ball = {"name": "ball", "shape": {"type": "sphere", "radius": radius}, "position": position}
        self.operator.ask("scene.add", object=ball, expected_revision=0)


@pytest.fixture
def cell() -> Iterator[PlanningCell]:
    made = PlanningCell()
    yield made
    assert made.controller.referee.total == 0


def turned(cell: EmulatedCell, angle: float) -> tuple[float, ...]:
    return (cell.position[0] + angle, *cell.position[1:])


@pytest.mark.parametrize("angle", [0.02, 0.3, -1.0])
def test_a_move_whose_way_is_surely_free_begins_on_the_spot(
    cell: PlanningCell, angle: float
) -> None:
    goal = turned(cell, angle)
    assert cell.operator.move(*goal) is V.ACCEPTED
    assert cell.core.cell.activity is Activity.MOVING
    cell.let_finish()
    assert (cell.jobs, cell.operator.outcomes()[-1][1]) == ([], V.ACCEPTED)
    assert cell.position == pytest.approx(goal, abs=1e-3)


def test_home_begins_on_the_spot(cell: PlanningCell) -> None:
    cell.operator.move(*turned(cell, 0.3))
    cell.let_finish()
    assert cell.operator.code(Home(cell.operator.last_request + 1, 1.0, "home")) is V.ACCEPTED
    assert cell.jobs == []


def test_a_move_into_an_object_is_looked_at_by_the_planning_process_and_refused(
    cell: PlanningCell,
) -> None:
    goal = turned(cell, 0.6)
    at = Kinematics(serial_robot("ur5")).forward(goal).position.tolist()
    cell.add_ball(at, 0.05)
    assert cell.operator.move(*goal) is V.PATH_IN_COLLISION
    assert [type(job) for job in cell.jobs] == [JointPathJob]
    assert cell.core.cell.activity is Activity.IDLE


def test_a_look_that_was_kept_is_worth_nothing_in_another_scene(cell: PlanningCell) -> None:
    here, there = cell.position, turned(cell, 0.2)
    cell.operator.move(*there)
    cell.let_finish()
    at = Kinematics(serial_robot("ur5")).forward(here).position.tolist()
    cell.add_ball(at, 0.04)
    assert cell.operator.move(*here) is V.PATH_IN_COLLISION


def test_a_move_that_ends_beside_an_object_is_made_once_the_planning_process_found_it_free(
    cell: PlanningCell,
) -> None:
    goal = turned(cell, 0.3)
    kinematics = Kinematics(serial_robot("ur5"))
    at = kinematics.forward(turned(cell, 0.7)).position.tolist()
    small = CollisionModel(kinematics, Scene((SceneObject("ball", Sphere(0.01), tuple(at)),)))
    pairs = [index for index, pair in enumerate(small.pairs) if "ball" in pair]
    away = small.clearances(np.array(goal))[pairs].min()
    cell.add_ball(at, 0.01 + away - 0.5 * MARGIN)
    assert cell.operator.move(*goal) is V.ACCEPTED
    assert [type(job) for job in cell.jobs] == [JointPathJob]
    cell.let_finish()
    assert cell.operator.outcomes()[-1][1] is V.ACCEPTED


def test_a_move_that_takes_longer_than_a_minute_goes_to_the_planning_process(
    cell: PlanningCell,
) -> None:
    assert cell.operator.move(*turned(cell, 0.8), speed=0.003) is V.ACCEPTED
    assert [type(job) for job in cell.jobs] == [JointPathJob]


def test_an_object_that_comes_is_looked_for_ahead_of_a_move_that_began_on_the_spot(
    cell: PlanningCell,
) -> None:
    """Promise 17, for a motion that the planning process has not seen."""
    goal = turned(cell, 1.0)
    at = Kinematics(serial_robot("ur5")).forward(goal).position.tolist()
    assert cell.operator.move(*goal, speed=0.3) is V.ACCEPTED
    assert cell.jobs == []
    cell.wait(300)
    cell.add_ball(at, 0.05)
    assert isinstance(cell.jobs[0], WayCheckJob)
    cell.let_finish()
    assert cell.operator.outcomes()[-1][1] is V.PATH_IN_COLLISION


@pytest.mark.parametrize("fault", ["nowhere", "beyond", "slow"])
def test_what_cannot_be_timed_is_refused_as_the_planning_process_would(
    cell: PlanningCell, fault: str
) -> None:
    here = cell.core.cell.feedback.standing_at
    goal = {"nowhere": here, "beyond": (7.0, *here[1:]), "slow": turned(cell, 0.8)}[fault]
    speed = 1e-5 if fault == "slow" else 1.0
    code = cell.operator.move(*goal, speed=speed)
    with pytest.raises(MotionError) as error:
        straight_move(here, goal, serial_robot("ur5").limits, speed=speed)
    assert code is refusal_of(error.value).code
    assert cell.jobs == []
