"""Promise 11: what is sent keeps position, velocity and acceleration of every joint.

Judged with arithmetic of its own, and with that of the emulated controller's referee.
"""

import numpy as np
import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.limits import JointLimits, float32_ceiling
from openpendant.motion.description.robot import robot_names, serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Activity, AuthorityBeat
from openpendant.simplemsg.standard import JointTrajPtFull
from openpendant.simplemsg.verdicts import VerdictCode as V

SERIAL = [name for name in robot_names() if name != "stewart_classroom"]

VELOCITY, ACCELERATION = figure(11, "velocity").bound, figure(11, "acceleration").bound
ROUNDING = 2e-6
"""Of positions and velocities as 4-byte reals [rad, rad/s; m, m/s]."""

STRAIGHT, PLANNED = 42, 2
"""Trajectories of each robot: 1,000 of all, in closed form and by TOPP-RA."""


def judge(trajectory: Trajectory, limits: JointLimits) -> None:
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    assert np.all(np.isfinite(trajectory.position))
    assert np.all((lower <= trajectory.position) & (trajectory.position <= upper))
    fastest = np.array(limits.velocity) * (1 + VELOCITY)
    hardest = np.array(limits.acceleration) * (1 + ACCELERATION)
    assert np.all(np.abs(trajectory.velocity) <= fastest)
    assert np.all(np.abs(trajectory.acceleration) <= hardest)
    steps = np.diff(trajectory.position, axis=0) / np.diff(trajectory.times)[:, None]
    assert np.all(np.abs(steps) <= fastest)


def judge_many(name: str, seed: int, straight: int, planned: int) -> None:
    limits = serial_robot(name).limits
    random = np.random.default_rng([11, seed])
    for number in range(straight + planned):
        count = 2 if number < straight else 4
        places = random.uniform(limits.lower, limits.upper, (count, limits.dof)).tolist()
        speed = float(random.uniform(0.05, 1.0))
        if count == 2:
            judge(plan_joint_move(places[0], places[1], limits, speed=speed), limits)
            continue
        job = JointPathJob(1, tuple(places[0]), tuple(map(tuple, places[1:])), speed)
        result = answer(name, job).result
        if isinstance(result, Refusal):
            # A curve through points near a limit may swing beyond: all of it is refused, by name.
            assert result.code is V.OUT_OF_RANGE
            assert limits.names[result.joint] in result.text
            assert not limits.lower[result.joint] <= result.value <= limits.upper[result.joint]
            continue
        assert isinstance(result, tuple)
        judge(result[0], limits)


@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_holds_in_a_thousand_random_trajectories(name: str) -> None:
    judge_many(name, 0, STRAIGHT, PLANNED)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 11))
@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_holds_in_a_hundred_thousand_random_trajectories(name: str, seed: int) -> None:
    judge_many(name, seed, 400, 35)


@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_a_goal_beyond_a_limit_is_refused_with_joint_value_and_limit(name: str) -> None:
    limits = serial_robot(name).limits
    home = list(serial_robot(name).home_position)
    for joint in range(limits.dof):
        goal = list(home)
        goal[joint] = float(np.nextafter(limits.upper[joint], np.inf))
        with pytest.raises(MotionError) as refused:
            plan_joint_move(home, goal, limits)
        assert limits.names[joint] in str(refused.value)
        assert getattr(refused.value, "value", None) == goal[joint]
        assert getattr(refused.value, "upper", None) == limits.upper[joint]


def finish(cell: EmulatedCell, pendant: Pendant) -> None:
    for _ in range(600):
        pendant.send(AuthorityBeat())
        cell.wait(50)
        if cell.core.cell.activity is Activity.IDLE:
            return
    raise AssertionError("the motion does not end")


def judge_sent(points: list[JointTrajPtFull], limits: JointLimits) -> None:
    dof = limits.dof
    position, velocity, acceleration = (
        np.array([getattr(point, name)[:dof] for point in points])
        for name in ("positions", "velocities", "accelerations")
    )
    assert np.all(np.isfinite(np.hstack([position, velocity, acceleration])))
    # Limits as 4-byte reals say them, rounded outward.
    assert np.all(np.array([-float32_ceiling(-each) for each in limits.lower]) <= position)
    assert np.all(position <= np.array([float32_ceiling(each) for each in limits.upper]))
    fastest = np.array(limits.velocity) * (1 + VELOCITY)
    hardest = np.array(limits.acceleration) * (1 + ACCELERATION)
    assert np.all(np.abs(velocity) <= fastest)
    assert np.all(np.abs(acceleration) <= hardest)
    periods = np.diff([point.time for point in points])[:, None]
    assert np.all(periods > 0.0)
    # A step of 10 ms between 4-byte reals is known to a few 10⁻⁵ of a radian a second.
    assert np.all(np.abs(np.diff(position, axis=0)) <= fastest * periods + ROUNDING)
    assert np.all(np.abs(np.diff(velocity, axis=0)) <= hardest * periods + ROUNDING)


def motions_at_the_controllers_edge(count: int, seed: int) -> None:
    """Judge so many motions through points, timed by TOPP-RA, as they reach the controller.

    Each begins where the one before has ended. What is refused is not counted; most is taken.
    """
    judged = refused = 0
    for number, name in enumerate(SERIAL):
        cell = EmulatedCell(name)
        pendant = cell.holder()
        limits = serial_robot(name).limits
        random = np.random.default_rng([11, seed, number])
        share = count * (number + 1) // len(SERIAL) - count * number // len(SERIAL)
        reach = 0.03 * (np.array(limits.upper) - np.array(limits.lower))
        while share:
            through = cell.position + random.uniform(-reach, reach, (3, limits.dof))
            inside = np.clip(through, limits.lower, limits.upper)
            speed = float(random.uniform(0.3, 1.0))
            cell.sent.clear()
            if pendant.path(*map(tuple, inside), speed=speed) is not V.ACCEPTED:
                refused += 1
                assert refused <= count
                continue
            finish(cell, pendant)
            assert pendant.outcomes()[-1][1] is V.ACCEPTED
            points = [each for each in cell.sent if isinstance(each, JointTrajPtFull)]
            assert len(points) > 3
            judge_sent(points, limits)
            share -= 1
            judged += 1
        assert cell.controller.referee.total == 0
    tell(f"promise 11: {judged} motions judged at the controller, {refused} refused")
    assert judged == count


def test_promise_11_holds_in_a_motion_of_each_robot_as_the_controller_gets_it() -> None:
    motions_at_the_controllers_edge(figure(11, "few").count, 0)


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_promise_11_holds_in_a_thousand_motions_as_the_controller_gets_them() -> None:
    motions_at_the_controllers_edge(figure(11, "trajectories").count, 1)
