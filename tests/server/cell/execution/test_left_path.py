"""A robot that is reported elsewhere than commanded is stopped in the turn of that report.

On the virtual clock, through the codec, in each kind of motion (promise 52).
"""

from collections.abc import Callable, Sequence

import pytest
from rigs.cells.ros_situations import unknown_mode
from rigs.cells.server_rig import ready
from rigs.cells.watched_motions import (
    MOTIONS,
    MS,
    Commanded,
    MovingCell,
    following_ros,
    jogging,
    moving,
    why,
)

from openpendant.simplemsg.pendant import Activity, MotionControl, MotionControlAction
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

Place = tuple[float, ...]
WARM_MS = 400
DEFAULTS = {"path_tolerance": 0.02, "lag": 0.08, "noise": 0.001}


def shifted(place: Place, joint: int, by: float) -> Place:
    return tuple(at + by * (number == joint) for number, at in enumerate(place))


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize(
    ("joint", "jump", "code"),
    [(1, 0.3, V.LEFT_THE_PATH), (4, -0.3, V.LEFT_THE_PATH), (2, 7.0, V.OVER_RANGE)],
    ids=["by 0.3 rad", "back by 0.3 rad", "out of its range"],
)
def test_promise_52_a_jump_stops_the_robot_in_the_turn_of_its_first_report(
    motion: Callable[[], MovingCell], joint: int, jump: float, code: V
) -> None:
    it = motion()
    it.wait(WARM_MS)
    assert it.stops == 0
    jumps_at = it.cell.now + 10 * MS
    it.cell.reported = lambda at, now: shifted(at, joint, jump if now >= jumps_at else 0.0)
    points = len(it.cell.sent)
    assert it.until_stopped(20) == jumps_at
    assert it.code is code
    assert f"joint {joint + 1}" in it.reason
    sent = it.cell.sent[points:]
    assert sum(message.sequence >= 0 for message in sent) == 0  # type: ignore[attr-defined]


def test_why_tells_joint_value_and_tolerances_and_the_remedy_of_what_it_was_stopped_for() -> None:
    it = moving()
    it.wait(WARM_MS)
    it.cell.reported = lambda at, now: shifted(at, 1, 0.3)
    it.until_stopped(20)
    it.cell.reported = None
    it.cell.wait(1_000)
    (stop,) = [each for each in why(it.cell)["conditions"] if each["condition"] == "stop"]
    assert "Lower-Arm is reported 0.2" in stop["text"]
    assert "path_tolerance 0.01 rad, lag 0.01 s at" in stop["text"]
    assert stop["cause"] == CATALOGUE[V.LEFT_THE_PATH].cause
    assert stop["remedy"] == CATALOGUE[V.LEFT_THE_PATH].remedy


@pytest.mark.parametrize("motion", [moving, following_ros])
def test_promise_52_reports_that_are_right_and_wrong_in_turn_stop_it_by_the_first_that_is_wrong(
    motion: Callable[[], MovingCell],
) -> None:
    it = motion()
    it.wait(WARM_MS)
    since = it.cell.now
    it.cell.reported = lambda at, now: shifted(at, 3, 0.3 * ((now - since) // (10 * MS) % 2 == 0))
    assert it.until_stopped(40) == since + 20 * MS
    assert it.code is V.LEFT_THE_PATH
    # It goes on reporting so: the stop stays, and that the robot seems to move is told.
    it.wait(2_000)
    assert it.code is V.LEFT_THE_PATH
    assert "Wrist-Roll moved by 0.3000 rad" in why(it.cell)["remarks"][0]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize(
    "change",
    [lambda place: place[::-1], lambda place: tuple(0.1 * (n + 1) for n in range(len(place)))],
    ids=["reversed order", "another robot"],
)
def test_promise_52_reports_of_the_wrong_joints_or_robot_stop_it(
    motion: Callable[[], MovingCell], change: Callable[[Place], Place]
) -> None:
    it = motion()
    it.wait(WARM_MS)
    changes_at = it.cell.now + 10 * MS
    it.cell.reported = lambda at, now: change(at) if now >= changes_at else at
    assert it.until_stopped(20) == changes_at
    assert it.code is V.LEFT_THE_PATH


@pytest.mark.parametrize("motion", [moving, following_ros])
def test_promise_52_a_robot_1_rad_ahead_on_its_path_has_left_it(
    motion: Callable[[], MovingCell],
) -> None:
    it = motion()
    it.wait(WARM_MS)
    before = it.cell.position
    it.wait(10)
    after = it.cell.position
    way = [b - a for a, b in zip(before, after, strict=True)]
    rate = max(map(abs, way))
    ahead_at = it.cell.now + 10 * MS
    it.cell.reported = lambda at, now: (
        tuple(a + w / rate for a, w in zip(at, way, strict=True)) if now >= ahead_at else at
    )
    assert it.until_stopped(20) == ahead_at
    assert it.code is V.LEFT_THE_PATH


@pytest.mark.parametrize("motion", MOTIONS)
def test_promise_52_a_run_away_is_stopped_by_the_first_report_beyond_a_tolerance(
    motion: Callable[[], MovingCell],
) -> None:
    it = motion()
    it.wait(WARM_MS)
    oracle = Commanded(it)
    since = it.cell.now
    beyond: set[int] = set()

    def running_away(at: Place, now: int) -> Place:
        reported = shifted(at, 0, 2.0 * (now - since) / 1e9)
        if oracle.beyond(reported, now, 0.01, 0.01, 0.0):
            beyond.add(now)
        return reported

    it.cell.reported = running_away
    stopped = it.until_stopped(100)
    assert it.code is V.LEFT_THE_PATH
    assert {stopped} == beyond


def slowly_moving(settings: dict[str, float]) -> MovingCell:
    """Move joint 1 alone, at 0.29 rad/s, and hold the others."""
    it = moving((1.0, 0, 0, 0, 0, 0), speed=0.0925, controller=settings)
    it.wait(WARM_MS)
    before = it.cell.position[0]
    it.wait(100)
    assert 0.28 < (it.cell.position[0] - before) / 0.1 <= 0.3
    return it


def jogged_slowly(settings: dict[str, float]) -> MovingCell:
    it = jogging((0.37, 0, 0, 0, 0, 0), controller=settings)
    it.wait(WARM_MS)
    return it


FOUND = [
    pytest.param({}, 4, 60, id="emulated, held still"),
    pytest.param({}, 0, 200, id="emulated, moving"),
    pytest.param(DEFAULTS, 4, 100, id="defaults, held still"),
    pytest.param(DEFAULTS, 0, 600, id="defaults, moving"),
]
SAGS = [
    pytest.param(motion, sign, *found.values, id=f"{name}: {found.id}")
    for name, motion, sign in (
        ("move, forwards", slowly_moving, 1.0),
        ("move, backwards", slowly_moving, -1.0),
        ("jog, forwards", jogged_slowly, 1.0),
    )
    for found in (FOUND if sign > 0 else FOUND[:3])
]


@pytest.mark.parametrize(("motion", "sign", "settings", "joint", "within_ms"), SAGS)
def test_promise_52_a_sagging_joint_is_found_in_time(
    motion: Callable[[dict[str, float]], MovingCell],
    sign: float,
    settings: dict[str, float],
    joint: int,
    within_ms: int,
) -> None:
    it = motion(settings)
    since = it.cell.now
    it.cell.reported = lambda at, now: shifted(at, joint, sign * 0.5 * (now - since) / 1e9)
    assert it.until_stopped(within_ms) - since <= within_ms * MS
    assert it.code is V.LEFT_THE_PATH


@pytest.mark.parametrize(
    ("motion", "settings", "within_ms"),
    [(jogged_slowly, {}, 200), (jogged_slowly, DEFAULTS, 200), (slowly_moving, DEFAULTS, 600)],
    ids=["jog, emulated", "jog, defaults", "move, defaults"],
)
def test_a_joint_that_sags_backwards_along_its_path_is_stopped_in_time_whoever_finds_it(
    motion: Callable[[dict[str, float]], MovingCell], settings: dict[str, float], within_ms: int
) -> None:
    """It looks like one that is behind, and is sent no more than the lead: the motion runs dry."""
    it = motion(settings)
    since = it.cell.now
    it.cell.reported = lambda at, now: shifted(at, 0, -0.5 * (now - since) / 1e9)
    assert it.until_stopped(within_ms) - since <= within_ms * MS


def test_the_ramp_of_a_stop_leads_off_the_path_and_is_no_reason_for_another() -> None:
    it = moving(speed=1.0)
    it.wait(WARM_MS)
    assert it.pendant.code(MotionControl(50, MotionControlAction.PROGRAM_STOP)) is V.ACCEPTED
    since = it.cell.now
    it.cell.reported = lambda at, now: shifted(at, 4, min(1.0 * (now - since) / 1e9, 0.1))
    it.wait(60)
    assert it.cell.core.cell.activity is Activity.STOPPING
    it.wait(2_000)
    assert it.cell.core.cell.stop is None


class FastTool:
    """A tool that goes 10 m with each radian of the first joint."""

    lever_arms = ((10.0, 0.0),)

    def speed_points(self, position: Sequence[float]) -> tuple[Place, ...]:
        return ((10.0 * position[0], 0.0, 0.0),)


def test_the_cap_of_t1_binds_a_pendants_motion_and_no_trajectory_of_a_controller_in_automatic() -> (
    None
):
    """One that does not tell its mode counts as manual, but its file may let ROS-I move it."""
    rig = ready(
        modes={"selector": "controller"},
        ros_i={"unknown_mode_is_automatic": True},
        controller={"lag": 0.0, "noise": 0.0},
    )
    rig.core.cell.driving.points = FastTool()
    unknown_mode(rig)
    client = rig.ros()
    client.trajectory((0.0, 0.0), (0.3, 0.1))
    rig.wait(6_000)
    assert rig.controller.position[0] == pytest.approx(0.3)
    before = rig.core.cell.stop
    client.close()
    pendant = rig.holder()
    assert pendant.move(0.0, 0.0) is V.ACCEPTED
    rig.wait(600)
    after = rig.core.cell.stop
    assert before is None
    assert after is not None
    assert after.code is V.OVER_SPEED
