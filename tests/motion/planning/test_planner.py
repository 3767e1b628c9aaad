import math
import subprocess
import sys
import time
from typing import Any
from unittest.mock import Mock, patch

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.planning_scenes import Task, pillar_task, random_tasks

from openpendant.motion import errors
from openpendant.motion.paths.blending import JointPolyline
from openpendant.motion.planning import path_check
from openpendant.motion.planning.ompl_planner import planners
from openpendant.motion.planning.path_check import check_path, first_contact
from openpendant.motion.planning.planner import (
    PlanningProgress,
    PlanningStage,
    free_joint_position,
    plan_free_path,
)
from openpendant.motion.planning.rrt_connect import BUILT_IN, rrt_connect, shorten
from openpendant.motion.pose import Array, Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline, Path

TEN_TIMES = 1e-3  # of the nominal 0.01 rad

# Each needs ompl; a plan with the built-in search is tested everywhere.
ompl_planners = [name for name in planners() if name != BUILT_IN]
ROBOTS = ["ur5", "kawasaki_ra10n", "rail_kr5_arc"]
QUICK = [name for name in ("RRTConnect", "LBKPIECE1", "KPIECE1", BUILT_IN) if name in planners()]


@pytest.fixture
def task() -> Task:
    return pillar_task()


def plan(task: Task, planner: str = BUILT_IN, seed: int = 0, **more: Any) -> JointPolyline:
    arm, asked = task.collision.kinematics, {"planner": planner, "seed": seed, "time_limit": 60.0}
    given: dict[str, Any] = {"clock": time.perf_counter, **asked, **more}
    return plan_free_path(arm, task.collision, task.start, task.goal, **given)


def assert_free(task: Task, path: Path) -> None:
    s = np.linspace(0.0, path.length, math.ceil(path.length / TEN_TIMES) + 1)
    positions = path.evaluate(s)
    np.testing.assert_array_equal(positions[0], task.start)
    np.testing.assert_array_equal(positions[-1], task.goal)
    assert not task.collision.any_collides(positions)


@pytest.mark.parametrize(
    ("planner", "seed"),
    [
        pytest.param(
            planner, seed, marks=() if planner == BUILT_IN or not seed else pytest.mark.soak
        )
        for planner in QUICK
        for seed in range(3)
    ],
)
def test_the_way_around_a_pillar_is_free_and_drivable(planner: str, seed: int, task: Task) -> None:
    path = plan(task, planner, seed)
    assert_free(task, path)
    limits = task.collision.kinematics.limits
    motion = time_path(path, limits)
    certify(motion, limits, start=task.start)
    assert not task.collision.any_collides(motion.position)


@pytest.mark.parametrize("planner", QUICK)
def test_the_same_seed_gives_the_same_plan(planner: str) -> None:
    first, again, other = (plan(pillar_task(), planner, seed) for seed in (5, 5, 6))
    s = np.linspace(0.0, first.length, 100)
    np.testing.assert_array_equal(first.evaluate(s), again.evaluate(s))
    assert other.length != first.length


@pytest.mark.parametrize("robot", ROBOTS)
def test_no_plan_in_random_scenes_touches_anything(robot: str) -> None:
    found = [_plan_or_none(task, seed) for seed, task in enumerate(random_tasks(robot, range(3)))]
    assert sum(found) >= 2


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("planner", QUICK[::3])
@pytest.mark.parametrize(
    "robot", ["ur5", "abb_irb2400", "kawasaki_ra10n", "fanuc_m10ia", "rail_kr5_arc"]
)
def test_no_plan_in_two_hundred_scenes_touches_anything(robot: str, planner: str) -> None:
    tasks = random_tasks(robot, range(1000, 1200))
    found = [_plan_or_none(task, seed, planner) for seed, task in enumerate(tasks)]
    assert sum(found) >= 150


def _plan_or_none(task: Task, seed: int, planner: str = BUILT_IN) -> bool:
    try:
        path = plan(task, planner, seed, time_limit=3.0)
    except errors.NoPathFound:
        return False
    assert_free(task, path)
    return True


def test_a_part_is_picked_and_placed_over_a_wall() -> None:
    kinematics = pillar_task().collision.kinematics
    part = SceneObject("part", Box((0.06, 0.06, 0.06)), (-0.45, -0.3, 0.032))
    wall = SceneObject("wall", Box((0.6, 0.04, 0.3)), (-0.5, 0.0, 0.15))
    table = SceneObject("table", Box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.05))
    scene = Scene((part, wall, table))
    # The hand reaches down to the top of the part.
    grasp = Pose.from_rpy([-0.45, -0.3, 0.063], [math.pi, 0.0, 0.0])
    place = Pose.from_rpy([-0.45, 0.3, 0.063], [math.pi, 0.0, 0.0])
    touching = scene.allow("part", "wrist_3_link")
    home = np.array(kinematics.robot.home_position)
    at_part = free_joint_position(CollisionModel(kinematics, touching), grasp, home)
    plan(Task(CollisionModel(kinematics, touching), home, at_part))
    held = scene.attach("part", "tool0", kinematics.forward(at_part), ("wrist_3_link",))
    carrying = CollisionModel(kinematics, held)
    at_place = free_joint_position(carrying, place, at_part)
    carried = plan(Task(carrying, at_part, at_place))
    assert_free(Task(carrying, at_part, at_place), carried)
    # The straight way would have led the part through the wall.
    assert first_contact(carrying, [at_part, at_place]) is not None
    placed = held.detach("part", kinematics.forward(at_place))
    np.testing.assert_allclose(placed.get("part").position, (-0.45, 0.3, 0.032), atol=1e-4)
    assert not CollisionModel(kinematics, placed).collides(home)


def test_progress_is_told_from_the_search_to_the_end() -> None:
    task, told = pillar_task(), list[PlanningProgress]()
    plan(task, on_progress=told.append)
    assert list(dict.fromkeys(each.stage for each in told)) == list(PlanningStage)
    assert [each.iterations for each in told] == sorted(each.iterations for each in told)


@pytest.mark.parametrize("planner", QUICK)
def test_what_progress_raises_ends_the_plan(planner: str) -> None:
    with pytest.raises(InterruptedError, match="by the user"):
        plan(pillar_task(), planner, on_progress=Mock(side_effect=InterruptedError("by the user")))


@pytest.mark.parametrize("planner", QUICK)
def test_a_closed_scene_is_given_up_in_time(planner: str, task: Task) -> None:
    walls = (
        # The upper arm runs 0.137 m beside the axis of the first joint, so it cannot pass these.
        SceneObject("front", Box((0.02, 2.0, 4.0)), (0.0, -1.1, 0.0)),
        SceneObject("back", Box((0.02, 2.0, 4.0)), (0.0, 1.1, 0.0)),
    )
    collision = CollisionModel(task.collision.kinematics, Scene(walls))
    goal = task.goal + 0.1 * np.eye(6)[0]
    with pytest.raises(errors.NoPathFound) as refused:
        plan(Task(collision, task.start, goal), planner, time_limit=0.3)
    assert refused.value.planner == planner
    assert refused.value.iterations > 0


def test_bad_questions_are_refused(task: Task) -> None:
    inside = task.start.copy()
    inside[0] = -0.22
    touching = "wrist_1_link and pillar touch at the {0} .* accepted: a {0} where nothing touches"
    with pytest.raises(errors.StartInCollision, match=touching.format("start")) as start:
        plan(Task(task.collision, inside, task.goal))
    assert start.value.distance < 0.0
    with pytest.raises(errors.GoalInCollision, match=touching.format("goal")):
        plan(Task(task.collision, task.start, inside))
    with pytest.raises(errors.NoMotion):
        plan(Task(task.collision, task.start, task.start))
    with pytest.raises(errors.NotFinite):
        plan(Task(task.collision, task.start, np.full(6, math.nan)))
    with pytest.raises(errors.OutOfRange):
        plan(Task(task.collision, task.start, np.full(6, 7.0)))
    with pytest.raises(errors.WrongJointCount):
        plan(Task(task.collision, task.start, np.zeros(5)))
    with pytest.raises(errors.BadArgument):
        plan(task, seed=-1)
    with pytest.raises(errors.BadArgument):
        plan(task, time_limit=0.0)
    with pytest.raises(errors.PlannerUnavailable) as unknown:
        plan(task, "EST")
    assert unknown.value.known == planners()


@pytest.mark.parametrize("planner", ["PRM", "PRMstar"])
def test_planners_that_are_not_repeatable_are_not_offered(planner: str) -> None:
    assert planner not in planners()
    with pytest.raises(errors.PlannerUnavailable, match="available: RRTConnect"):
        plan(pillar_task(), planner)


@pytest.mark.soak
@pytest.mark.parametrize("planner", ompl_planners)
def test_every_planner_finds_its_way_around_the_pillar(planner: str, task: Task) -> None:
    assert_free(task, plan(task, planner, seed=1, time_limit=60.0))


def test_a_process_that_planned_ends_without_a_word() -> None:
    script = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from rigs.motion.planning_scenes import pillar_task\n"
        "from openpendant.motion.planning.planner import plan_free_path\n"
        "t = pillar_task()\n"
        "plan_free_path(t.collision.kinematics, t.collision, t.start, t.goal)\n"
    )
    command = [sys.executable, "-c", script]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")


LOWER, UPPER = np.full(2, -2.0), np.full(2, 2.0)
START, GOAL = np.array([-1.0, 0.0]), np.array([1.0, 0.0])


def around_the_disc(start: Array, end: Array) -> bool:
    """A disc of radius 0.5 lies in the middle of the plane."""
    points = start + np.linspace(0.0, 1.0, 50)[:, np.newaxis] * (end - start)
    return bool((np.linalg.norm(points, axis=1) > 0.5).all())


def through_no_wall(start: Array, end: Array) -> bool:
    return bool(start[0] * end[0] > 0.0)


def length(waypoints: Array) -> float:
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())


@pytest.mark.parametrize("seed", range(10))
def test_a_way_around_is_found_and_shortened(seed: int) -> None:
    random = np.random.default_rng(seed)
    found = rrt_connect(START, GOAL, LOWER, UPPER, around_the_disc, random=random).waypoints
    assert found is not None
    short = shorten(found, around_the_disc, random=random)
    for waypoints in (found, short):
        np.testing.assert_array_equal(waypoints[[0, -1]], [START, GOAL])
        assert all(map(around_the_disc, waypoints[:-1], waypoints[1:]))
    # The shortest way: two tangents of the disc and the arc between them.
    assert 2.256 < length(short) < min(length(found) + 1e-12, 2.8)


def test_a_free_line_needs_no_search() -> None:
    random = np.random.default_rng(0)
    aside = np.array([-1.0, 1.0])
    found = rrt_connect(START, aside, LOWER, UPPER, around_the_disc, random=random)
    assert found.iterations == 0
    assert found.waypoints is not None
    np.testing.assert_array_equal(found.waypoints, [START, aside])


def test_a_closed_way_ends_after_the_iterations_allowed() -> None:
    random = np.random.default_rng(0)
    found = rrt_connect(START, GOAL, LOWER, UPPER, through_no_wall, random=random, iterations=50)
    assert (found.waypoints, found.iterations) == (None, 50)


def test_the_caller_may_end_the_search() -> None:
    random = np.random.default_rng(0)
    found = rrt_connect(
        START, GOAL, LOWER, UPPER, through_no_wall, random=random, proceed=lambda i: i < 7
    )
    assert (found.waypoints, found.iterations) == (None, 7)


def test_the_first_contact_is_named_with_its_fraction(task: Task) -> None:
    with pytest.raises(errors.PathInCollision) as refused:
        check_path(task.collision, [task.start, task.goal])
    assert {refused.value.first, refused.value.second} == {"wrist_1_link", "pillar"}
    assert 0.3 < refused.value.fraction < 0.35
    back = first_contact(task.collision, [task.goal, task.start])
    assert back is not None
    assert back.fraction < 1.0 - refused.value.fraction


def test_a_long_path_is_checked_in_parts_with_the_same_verdict(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    far = [task.goal, task.start]
    aside = task.goal + 0.9 * np.eye(6)[5]
    ways = (far, [task.goal, aside, *far], [task.goal, aside, task.goal, aside])
    whole = [first_contact(task.collision, way) for way in ways]
    monkeypatch.setattr(path_check, "_MOST_AT_ONCE", 1)  # parts of 1,024 samples
    parts = [first_contact(task.collision, way) for way in ways]
    for once, in_parts in zip(whole[:2], parts[:2], strict=True):
        assert once is not None
        assert in_parts is not None
        assert in_parts.fraction == once.fraction
        assert (in_parts.first, in_parts.second) == (once.first, once.second)
    assert whole[1] is not None
    assert whole[1].fraction * 3_600 > 2_000  # samples
    assert whole[2] is parts[2] is None


def test_a_path_and_its_waypoints_get_the_same_verdict(task: Task) -> None:
    line = first_contact(task.collision, JointLine(task.start, task.goal))
    points = first_contact(task.collision, [task.start, task.start, task.goal])
    assert line is not None
    assert points is not None
    assert line.fraction == pytest.approx(points.fraction, abs=1e-3)


@pytest.mark.parametrize("count", counts(4, 80))
@pytest.mark.parametrize("robot", ["ur5", "fanuc_m10ia"])
def test_the_verdict_is_that_of_looking_ten_times_as_densely(robot: str, count: int) -> None:
    touched = 0
    for task in random_tasks(robot, range(count)):
        path = JointSpline([task.start, (task.start + 2 * task.goal) / 3, task.goal])
        found = first_contact(task.collision, path)
        # Nominally 0.01 rad; ten times as densely is 0.001.
        s = np.linspace(0.0, path.length, math.ceil(path.length / 1e-3))
        hits = (index for index, q in enumerate(path.evaluate(s)) if task.collision.collides(q))
        first = next(hits, None)
        assert (first is None) == (found is None)
        if first is not None and found is not None:
            touched += 1
            fraction = first / (len(s) - 1)
            assert found.fraction == pytest.approx(fraction, abs=2e-3 / path.length)
    assert touched > count / 4


def test_a_clear_path_takes_few_looks(task: Task) -> None:
    robot_alone = CollisionModel(task.collision.kinematics)
    with patch.object(robot_alone, "clearances", wraps=robot_alone.clearances) as looks:
        assert first_contact(robot_alone, [task.start, task.goal]) is None
    assert looks.call_count < 10  # of 1,800 samples: only the pan joint moves, and no pair nears


def test_a_margin_counts_as_touching(task: Task) -> None:
    aside = task.start + 0.1 * np.eye(6)[0]
    assert first_contact(task.collision, [task.start, aside]) is None
    found = first_contact(task.collision, [task.start, aside], margin=0.2)
    assert found is not None
    assert 0.0 < found.distance <= 0.2


def test_a_bad_path_is_refused() -> None:
    collision = pillar_task().collision
    with pytest.raises(errors.NotFinite):
        first_contact(collision, [[0.0] * 6, [math.nan] * 6])
    with pytest.raises(errors.WrongJointCount):
        first_contact(collision, [[0.0] * 6, [0.0] * 5])
    with pytest.raises(errors.OutOfRange):
        first_contact(collision, [[0.0] * 6, [9.0] * 6])
    with pytest.raises(errors.WrongJointCount):
        first_contact(collision, JointLine([0.0], [1.0]))
