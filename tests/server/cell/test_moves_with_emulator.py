from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.robot_cell_situations import codes
from rigs.cells.server_rig import MS, jobs_in
from rigs.peers.server_clients import RosClient

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
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Home, Motion, PoseMove
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))


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
    assert (cell.jobs, codes(cell.operator)[-1]) == ([], V.ACCEPTED)
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
    at = UR5.forward(goal).position.tolist()
    cell.add_ball(at, 0.05)
    assert cell.operator.move(*goal) is V.PATH_IN_COLLISION
    assert [type(job) for job in cell.jobs] == [JointPathJob]
    assert cell.core.cell.activity is Activity.IDLE


def test_a_look_that_was_kept_is_worth_nothing_in_another_scene(cell: PlanningCell) -> None:
    here, there = cell.position, turned(cell, 0.2)
    cell.operator.move(*there)
    cell.let_finish()
    at = UR5.forward(here).position.tolist()
    cell.add_ball(at, 0.04)
    assert cell.operator.move(*here) is V.PATH_IN_COLLISION


def test_a_move_that_ends_beside_an_object_is_made_once_the_planning_process_found_it_free(
    cell: PlanningCell,
) -> None:
    goal = turned(cell, 0.3)
    at = UR5.forward(turned(cell, 0.7)).position.tolist()
    small = CollisionModel(UR5, Scene((SceneObject("ball", Sphere(0.01), tuple(at)),)))
    pairs = [index for index, pair in enumerate(small.pairs) if "ball" in pair]
    away = small.clearances(np.array(goal))[pairs].min()
    cell.add_ball(at, 0.01 + away - 0.5 * MARGIN)
    assert cell.operator.move(*goal) is V.ACCEPTED
    assert [type(job) for job in cell.jobs] == [JointPathJob]
    cell.let_finish()
    assert codes(cell.operator)[-1] is V.ACCEPTED


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
    at = UR5.forward(goal).position.tolist()
    assert cell.operator.move(*goal, speed=0.3) is V.ACCEPTED
    assert cell.jobs == []
    cell.wait(300)
    cell.add_ball(at, 0.05)
    assert isinstance(cell.jobs[0], WayCheckJob)
    cell.let_finish()
    assert codes(cell.operator)[-1] is V.PATH_IN_COLLISION


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


def test_a_move_onto_the_limits_themselves_arrives(cell: PlanningCell) -> None:
    here = cell.position
    for goal in ((*here[:5], cell.limits.upper[5]), here):
        assert cell.operator.move(*goal) is V.ACCEPTED
        cell.let_finish()
    assert codes(cell.operator) == [V.ACCEPTED] * 2


@pytest.mark.parametrize("motion", Motion)
def test_a_pose_is_reached_by_either_motion(cell: PlanningCell, motion: Motion) -> None:
    pose = UR5.forward(cell.position)
    x, y, z = pose.position.tolist()
    target = (x, y, z - 0.05)
    request = PoseMove(5, motion, 0.5, "base", target, tuple(pose.quaternion.tolist()))
    assert cell.operator.code(request) is V.ACCEPTED
    cell.let_finish()
    assert codes(cell.operator) == [V.ACCEPTED]
    assert UR5.forward(cell.position).position.tolist() == pytest.approx(target, abs=1e-4)


@pytest.mark.parametrize("after", [10, 200, 600])
def test_a_stop_brings_it_to_rest_and_a_reset_moves_nothing(cell: PlanningCell, after: int) -> None:
    goal = tuple(value + 1.0 for value in cell.position)
    cell.operator.move(*goal)
    cell.wait(after)
    cell.operator.stop()
    cell.wait(1_000)
    assert cell.operator.reset() is V.ACCEPTED
    rest = cell.position
    cell.wait(500)
    assert cell.position == rest
    assert codes(cell.operator) == [V.STOPPED]
    assert cell.operator.move(*goal) is V.ACCEPTED
    cell.let_finish()
    assert cell.position == pytest.approx(goal, abs=1e-6)


@pytest.fixture
def client(cell: PlanningCell) -> RosClient:
    cell.operator.release()
    return cell.ros()


def stream(client: RosClient, cell: EmulatedCell, *offsets: float) -> None:
    """Send points at 5 ms, each asking for 0.4 s."""
    home = cell.position
    for index, offset in enumerate(offsets):
        client.point(index, *(value + offset for value in home), duration=0.4)
        cell.wait(5)


def test_a_streamed_trajectory_is_never_faster_than_asked(
    cell: PlanningCell, client: RosClient
) -> None:
    home = cell.position
    stream(client, cell, 0.0, 0.05, 0.1, 0.15)
    cell.wait(160)
    moved = cell.now
    assert cell.core.cell.activity is Activity.MOVING
    cell.let_finish()
    assert cell.now - moved >= (3 * 400 - 20) * MS
    assert cell.position == pytest.approx([value + 0.15 for value in home], abs=1e-5)


def test_a_superseding_trajectory_ends_where_the_new_one_ends(
    cell: PlanningCell, client: RosClient
) -> None:
    home = cell.position
    stream(client, cell, 0.0, 0.2, 0.4)
    cell.wait(500)
    client.point(0, *home, duration=0.5)
    client.point(1, *(value - 0.1 for value in home), duration=0.5)
    cell.wait(400)
    cell.let_finish()
    cell.wait(100)
    cell.let_finish()
    assert cell.position == pytest.approx([value - 0.1 for value in home], abs=1e-5)
