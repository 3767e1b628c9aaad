"""Promise 13: a pose out of reach is refused by code before anything moves, and soon."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from promises.promise_figures import SLACK, Figures, tell, trials_of
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.clock.busy_machine import SCALE
from rigs.peers.server_clients import pose
from rigs.peers.wire_pendant import WirePendant
from rigs.processes.promise_rig import PromiseRig, promise_rig

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.server.planning.jobs import PoseGoal, PoseJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Motion, PoseMove, Verdict
from openpendant.simplemsg.standard import JointTrajPtFull
from openpendant.simplemsg.verdicts import VerdictCode as V

REFUSED = figure(13, "refused")
"""99th percentile of the time until the refusal."""

LATE = figure(13, "late")
PERIOD = 1.0 / figure(13, "rate").bound
"""Between two requests where there are many [s]."""

UR5 = Kinematics(serial_robot("ur5"))

REACH = {"ur5": 1.1, "kuka_iiwa14": 1.5, "abb_irb2400": 2.2}
"""No tool is farther from the base's origin than this [m]."""


def out_of_reach(robot: str, random: np.random.Generator) -> PoseGoal:
    """Return a pose beyond the reach, or for the UR5 on the axis that it turns about."""
    towards = random.normal(size=3)
    towards /= np.linalg.norm(towards)
    turn = random.normal(size=4)
    turn /= np.linalg.norm(turn)
    far = (
        0.01
        if robot == "ur5" and random.random() < 0.3
        else REACH[robot] * random.uniform(1.0, 3.0)
    )
    return PoseGoal(tuple((far * towards).tolist()), tuple(turn.tolist()))


@cache
def stretched() -> Pose:
    """Return where the UR5's tool is farthest out."""
    grid = np.linspace(-np.pi, np.pi, 49).tolist()
    poses = [UR5.forward([0.0, 0.0, 0.0, one, two, 0.0]) for one in grid for two in grid]
    return max(poses, key=lambda each: float(np.linalg.norm(each.position)))


def turned_round(pose: Pose) -> PoseGoal:
    x, y, z, w = pose.quaternion.tolist()
    return PoseGoal(tuple(pose.position.tolist()), (w, z, -y, -x))


def refusal_times(robot: str, count: int, clock: Callable[[], float]) -> list[float]:
    """Ask for poses out of reach; return how long each refusal took by a clock [s], rising."""
    random = np.random.default_rng(13)
    start = tuple(serial_robot(robot).home_position)
    took: list[float] = []
    for number in range(count):
        goal = out_of_reach(robot, random)
        motion = Motion.PTP if number % 2 else Motion.LIN
        job = PoseJob(number, start, (goal,), "base", motion, 0.5)
        began = clock()
        result = answer(robot, job).result
        took.append(clock() - began)
        assert isinstance(result, Refusal), goal
        assert result.code in (V.UNREACHABLE, V.OUT_OF_RANGE), result
        assert result.text
    return sorted(took)


@pytest.mark.realtime
@pytest.mark.parametrize("robot", sorted(REACH))
def test_promise_13_poses_out_of_reach_are_refused_with_a_code_and_soon(robot: str) -> None:
    """By the processor's time, as it is one process beside others here."""
    took = refusal_times(robot, 17, time.process_time)
    assert took[-1] <= SLACK * REFUSED.seconds * SCALE, took


@pytest.mark.soak
@pytest.mark.realtime
@pytest.mark.parametrize("robot", sorted(REACH))
def test_promise_13_a_thousand_poses_out_of_reach_are_refused_within_100_ms(robot: str) -> None:
    took = refusal_times(robot, REFUSED.trials // len(REACH) + 1, time.perf_counter)
    p50, p99 = took[len(took) // 2], took[len(took) * 99 // 100]
    figures = ", ".join(f"{1e3 * each:.1f}" for each in (p50, p99, took[-1]))
    tell(f"promise 13, {robot}: p50, p99 and max {figures} ms")
    assert p99 <= REFUSED.seconds * SCALE


def asked_by(pendant: WirePendant, random: np.random.Generator) -> PoseMove:
    goal = out_of_reach("ur5", random)
    request = pose(1, 0.5, goal.position, goal.orientation)
    request.request_id = pendant.request()
    return request


def refusals(pendant: WirePendant) -> list[V]:
    return [V(each.code) for each in pendant.got if isinstance(each, Verdict)]


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[PromiseRig]:
    with promise_rig(tmp_path, modes={"initial": "automatic"}) as made:
        yield made


@pytest.fixture
def asking(rig: PromiseRig) -> WirePendant:
    """A pendant in control that was refused once.

    The first answer takes as long as the planning process takes to start.
    """
    pendant = rig.pendant("asks in vain")
    pendant.take_control()
    assert pendant.verdict(asked_by(pendant, np.random.default_rng(99))) is V.UNREACHABLE
    pendant.got.clear()
    return pendant


@pytest.mark.realtime
@pytest.mark.parametrize(("trials", "slack"), trials_of(LATE))
def test_promise_13_a_hundred_of_them_a_second_leave_the_ticks_in_time(
    rig: PromiseRig, asking: WirePendant, trials: int, slack: float
) -> None:
    """Each is answered: as out of reach, or because the one before is still looked at.

    One in ten at least is looked at: as soon as the planning process has answered, it is asked
    the next.
    """
    random = np.random.default_rng(100)
    figures = Figures("promise 13, ticks late beside 100 requests a second")
    asked = 0
    began = time.monotonic()

    def ask_where_due() -> None:
        nonlocal asked
        while asked <= (time.monotonic() - began) / PERIOD:
            asking.send(asked_by(asking, random))
            asked += 1

    while figures.need_more(trials, LATE.ms, slack):
        rig.watch_ticks(asking, 0.7, figures, turn=0.002, meanwhile=ask_where_due)
    seconds = time.monotonic() - began
    asking.wait_until(lambda _: len(refusals(asking)) >= asked)
    asking.listen(0.05)
    refused = Counter(refusals(asking))
    assert not any(arrival.joint_velocity for arrival in rig.controller.arrivals)
    tell(f"promise 13: {asked} requests in {seconds:.1f} s; {dict(refused)}")
    assert asked >= 0.9 * seconds / PERIOD
    assert refused.total() == asked
    assert set(refused) <= {V.UNREACHABLE, V.PLANNING}
    assert refused[V.UNREACHABLE] >= asked / 10
    figures.judge(LATE.ms, slack=slack)


def test_promise_13_nothing_leaves_for_the_robot_and_it_stays_where_it_is() -> None:
    cell = EmulatedCell("ur5")
    pendant = cell.holder()
    random = np.random.default_rng(31)
    before = cell.position
    goals = [out_of_reach("ur5", random) for _ in range(4)] + [turned_round(stretched())]
    for goal in goals:
        pendant.last_request += 1
        request = pose(1, 0.5, goal.position, goal.orientation)
        request.request_id = pendant.last_request
        assert pendant.code(request) in (V.UNREACHABLE, V.OUT_OF_RANGE)
        cell.wait(50)
    assert not [item for item in cell.sent if isinstance(item, JointTrajPtFull)]
    assert cell.position == before


def test_promise_13_a_pose_may_be_out_of_reach_by_its_turn_alone() -> None:
    start = tuple(serial_robot("ur5").home_position)
    place = stretched()
    reached = PoseGoal(tuple(place.position.tolist()), tuple(place.quaternion.tolist()))
    assert isinstance(answer("ur5", _ptp(start, reached)).result, tuple)
    refused = answer("ur5", _ptp(start, turned_round(place))).result
    assert isinstance(refused, Refusal)
    assert refused.code is V.UNREACHABLE


def _ptp(start: tuple[float, ...], goal: PoseGoal) -> PoseJob:
    return PoseJob(1, start, (goal,), "base", Motion.PTP, 0.5)
