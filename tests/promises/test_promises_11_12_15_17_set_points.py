"""Promises 11, 12, 15 and 17: set-points keep limits, T1's speed and a branch, and touch nothing.

Judged with arithmetic of its own, by forward kinematics of the set-points that leave for the robot,
and with that of the emulated controller's referee: not from what planner or jog say of themselves.
"""

import itertools
import json
import math
from collections import Counter

import numpy as np
import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.motion.jog_pad import EmulatedPad
from rigs.peers.server_clients import Pendant, pose

from openpendant.motion.description.limits import JointLimits, float32_ceiling
from openpendant.motion.description.robot import robot_names, serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.motion.trajectory.point_speed import elbow_link
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.planning.jobs import JointPathJob, PoseGoal, PoseJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, JogSpace, Management, Motion
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


UR5 = Kinematics(serial_robot("ur5"))
CAP = figure(12, "speed").bound / 1e3
EXCESS = figure(12, "excess").bound
JOG = {"joint_speed": 1.0, "tool_speed": 2.0, "rotation_speed": 3.0}

JOGS = [
    (JogSpace.JOINTS, "", (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    (JogSpace.JOINTS, "", (-1.0, -0.6, 0.8, 1.0, -1.0, 1.0)),
    (JogSpace.TOOL, "base", (0.0, 1.0, 0.4, 0.0, 0.0, 0.0)),
    (JogSpace.TOOL, "tool", (0.0, 0.0, -1.0, 1.0, 0.0, -1.0)),
    (JogSpace.TOOL, "base", (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)),
]


class T1(EmulatedPad):
    def __init__(self) -> None:
        super().__init__(EmulatedCell("ur5", jog=JOG))

    def jog(self, space: JogSpace, frame: str, values: tuple[float, ...]) -> None:
        assert self.press(*values, deadline=0.2, space=space, frame=frame) is V.ACCEPTED
        self.hold(600)
        assert self.release() is V.ACCEPTED
        self.finish()

    def runs(self) -> list[list[JointTrajPtFull]]:
        runs: list[list[JointTrajPtFull]] = []
        for point in self.sent:
            if point.sequence == 0:
                runs.append([])
            runs[-1].append(point)
        return runs


def fastest(run: list[JointTrajPtFull]) -> float:
    """Return the greatest speed of tool or elbow, between set-points and at each [m/s]."""
    speeds = [0.0]
    for link in (None, elbow_link(UR5)):
        for one, two in itertools.pairwise(run):
            before, after = (np.array(each.positions[:6]) for each in (one, two))
            velocity = np.array(two.velocities[:6])
            ends = [UR5.forward(at, link=link).position for at in (before, after)]
            speeds.append(math.dist(*ends) / (two.time - one.time))
            near = [
                UR5.forward(after + sign * 1e-6 * velocity, link=link).position for sign in (1, -1)
            ]
            speeds.append(math.dist(*near) / 2e-6)
    return max(speeds)


def test_promise_12_every_jog_keeps_tool_and_elbow_below_250_mm_a_second() -> None:
    hands = T1()
    for jog in JOGS:
        hands.jog(*jog)
    runs = hands.runs()
    assert len(runs) == len(JOGS)
    speeds = [fastest(run) for run in runs]
    assert max(speeds) <= CAP * (1 + EXCESS), speeds
    assert max(speeds) > 0.99 * CAP
    assert hands.cell.controller.referee.total == 0


def test_promise_12_every_planned_motion_keeps_below_it_too() -> None:
    hands = T1()
    home = hands.cell.position
    tool = UR5.forward(home)
    x, y, z = tool.position.tolist()
    assert hands.pendant.move(home[0] + 0.6, *home[1:]) is V.ACCEPTED
    hands.finish()
    assert hands.pendant.path((home[0] + 0.3, *home[1:]), home) is V.ACCEPTED
    hands.finish()
    goal = pose(2, 1.0, (x, y + 0.1, z - 0.05), tool.quaternion.tolist())
    goal.request_id = hands._request()
    assert hands.pendant.code(goal) is V.ACCEPTED
    hands.finish()
    runs = hands.runs()
    assert len(runs) == 3
    assert max(map(fastest, runs)) <= CAP * (1 + EXCESS)


@pytest.mark.parametrize(("override", "cap"), [(0.3, 0.25), (1.0, 0.1)])
def test_promise_12_override_and_cap_only_lower_it(override: float, cap: float) -> None:
    hands = T1()
    assert hands.speed(override, cap) is V.ACCEPTED
    hands.jog(*JOGS[0])
    (run,) = hands.runs()
    assert 0.0 < fastest(run) <= min(CAP, cap) * (1 + 1e-6)


@pytest.mark.parametrize(("override", "cap"), [(1.0, 0.2501), (1.01, 0.25)])
def test_promise_12_what_would_raise_it_is_refused(override: float, cap: float) -> None:
    hands = T1()
    assert hands.speed(override, cap) is V.BAD_ARGUMENT


ROBOTS = ("ur5", "abb_irb2400")

LINE = 1e-4
"""How far the tool may be off its line between samples [m]."""


def follow_lines(name: str, seed: int, count: int) -> Counter[V]:
    """Plan lines between random places of all branches; judge those that are not refused.

    Returns:
        How often a line was taken, and refused by which code.
    """
    kinematics = Kinematics(serial_robot(name))
    limits = kinematics.robot.limits
    random = np.random.default_rng([15, seed])
    ends: Counter[V] = Counter()
    for number in range(count):
        low, high = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
        start, other = random.uniform(low, high, (2, limits.dof))
        # Some lines begin and end near one another, across whatever lies between.
        if number % 2:
            other = np.clip(start + random.normal(0.0, 0.3, limits.dof), low, high)
        began, goal = kinematics.forward(start), kinematics.forward(other)
        target = PoseGoal(tuple(goal.position.tolist()), tuple(goal.quaternion.tolist()))
        job = PoseJob(number, tuple(start.tolist()), (target,), "base", Motion.LIN, 0.5)
        result = answer(name, job).result
        if isinstance(result, Refusal):
            ends[result.code] += 1
            continue
        assert isinstance(result, tuple)
        ends[V.ACCEPTED] += 1
        trajectory = result[0]
        steps = np.abs(np.diff(trajectory.position, axis=0))
        periods = np.diff(trajectory.times)[:, None]
        assert np.all(steps <= np.array(limits.velocity) * periods * (1 + 1e-6) + 1e-12)
        way = goal.position - began.position
        length = float(np.linalg.norm(way))
        for row in trajectory.position[:: max(len(trajectory.position) // 25, 1)]:
            off = kinematics.forward(row).position - began.position
            along = (off @ way) / length**2
            assert np.linalg.norm(off - along * way) <= LINE
            assert -LINE <= along * length <= length + LINE
    return ends


@pytest.mark.parametrize("name", ROBOTS)
def test_promise_15_a_line_is_followed_without_a_jump_or_refused(name: str) -> None:
    ends = follow_lines(name, 0, 6)
    assert ends[V.ACCEPTED] > 2
    assert sum(ends.values()) - ends[V.ACCEPTED] > 2


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("name", ROBOTS)
def test_promise_15_a_thousand_lines_are_followed_or_refused(name: str, seed: int) -> None:
    ends = follow_lines(name, seed, 100)
    tell(f"promise 15, {name}: {dict(ends)}")
    assert sum(ends.values()) == 100


def test_promise_15_a_joint_that_goes_round_takes_the_short_way_within_its_limits() -> None:
    """The last joint of the UR5 turns twice; a pose half a turn on is reached the near way."""
    kinematics = Kinematics(serial_robot("ur5"))
    start = [0.3, -1.2, 1.4, -1.0, -1.2, 3.0]
    goal = kinematics.forward([*start[:5], start[5] + 0.5])
    target = PoseGoal(tuple(goal.position.tolist()), tuple(goal.quaternion.tolist()))
    for motion in (Motion.LIN, Motion.PTP):
        job = PoseJob(1, tuple(start), (target,), "base", motion, 0.5)
        result = answer("ur5", job).result
        assert isinstance(result, tuple), result
        ends = result[0].position[-1]
        assert ends[5] == pytest.approx(start[5] + 0.5, abs=1e-3)


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
