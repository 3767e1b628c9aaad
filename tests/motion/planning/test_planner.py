import math
import subprocess
import sys
import time

import numpy as np
import pytest
from rigs.motion.planning_scenes import Task, pillar_task, random_tasks

from openpendant.motion.errors import (
    BadArgument,
    GoalInCollision,
    NoMotion,
    NoPathFound,
    NotFinite,
    OutOfRange,
    PlannerUnavailable,
    StartInCollision,
    WrongJointCount,
)
from openpendant.motion.paths.blending import JointPolyline
from openpendant.motion.planning.goal_sampling import free_joint_position
from openpendant.motion.planning.path_check import first_contact
from openpendant.motion.planning.planner import (
    BUILT_IN,
    PlanningProgress,
    PlanningStage,
    plan_free_path,
    planners,
)
from openpendant.motion.pose import Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import Path

TEN_TIMES = 1e-3  # of the nominal 0.01 rad

# Each needs ompl; a plan with the built-in search is tested everywhere.
ompl_planners = [name for name in planners() if name != BUILT_IN]
ROBOTS = ["ur5", "kawasaki_ra10n", "rail_kr5_arc"]
QUICK = [name for name in ("RRTConnect", "LBKPIECE1", "KPIECE1", BUILT_IN) if name in planners()]


def plan(
    task: Task, planner: str = BUILT_IN, seed: int = 0, time_limit: float = 60.0
) -> JointPolyline:
    return plan_free_path(
        task.collision.kinematics,
        task.collision,
        task.start,
        task.goal,
        planner=planner,
        seed=seed,
        time_limit=time_limit,
        clock=time.perf_counter,
    )


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
def test_the_way_around_the_pillar_is_free_and_can_be_driven(planner: str, seed: int) -> None:
    task = pillar_task()
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
    except NoPathFound:
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
    plan_free_path(
        task.collision.kinematics,
        task.collision,
        task.start,
        task.goal,
        planner=BUILT_IN,
        on_progress=told.append,
    )
    stages = list(dict.fromkeys(each.stage for each in told))
    assert stages == [
        PlanningStage.SEARCHING,
        PlanningStage.SHORTENING,
        PlanningStage.CHECKING,
        PlanningStage.DONE,
    ]
    assert [each.iterations for each in told] == sorted(each.iterations for each in told)


@pytest.mark.parametrize("planner", QUICK)
def test_what_progress_raises_ends_the_plan(planner: str) -> None:
    class Cancelled(Exception):
        pass

    def cancel(progress: PlanningProgress) -> None:
        raise Cancelled

    task = pillar_task()
    arm = task.collision.kinematics
    with pytest.raises(Cancelled):
        plan_free_path(
            arm, task.collision, task.start, task.goal, planner=planner, on_progress=cancel
        )


@pytest.mark.parametrize("planner", QUICK)
def test_a_closed_scene_is_given_up_in_time(planner: str) -> None:
    task = pillar_task()
    walls = (
        # The upper arm runs 0.137 m beside the axis of the first joint, so it cannot pass these.
        SceneObject("front", Box((0.02, 2.0, 4.0)), (0.0, -1.1, 0.0)),
        SceneObject("back", Box((0.02, 2.0, 4.0)), (0.0, 1.1, 0.0)),
    )
    collision = CollisionModel(task.collision.kinematics, Scene(walls))
    goal = task.goal + 0.1 * np.eye(6)[0]
    with pytest.raises(NoPathFound) as refused:
        plan(Task(collision, task.start, goal), planner, time_limit=0.3)
    assert refused.value.planner == planner
    assert refused.value.iterations > 0


def test_bad_questions_are_refused() -> None:
    task = pillar_task()
    inside = task.start.copy()
    inside[0] = -0.22
    with pytest.raises(StartInCollision) as start:
        plan(Task(task.collision, inside, task.goal))
    assert "pillar" in (start.value.first, start.value.second)
    assert start.value.distance < 0.0
    with pytest.raises(GoalInCollision) as goal:
        plan(Task(task.collision, task.start, inside))
    assert "pillar" in (goal.value.first, goal.value.second)
    with pytest.raises(NoMotion):
        plan(Task(task.collision, task.start, task.start))
    with pytest.raises(NotFinite):
        plan(Task(task.collision, task.start, np.full(6, math.nan)))
    with pytest.raises(OutOfRange):
        plan(Task(task.collision, task.start, np.full(6, 7.0)))
    with pytest.raises(WrongJointCount):
        plan(Task(task.collision, task.start, np.zeros(5)))
    with pytest.raises(BadArgument):
        plan(task, seed=-1)
    with pytest.raises(BadArgument):
        plan(task, time_limit=0.0)
    with pytest.raises(PlannerUnavailable) as unknown:
        plan(task, "EST")
    assert unknown.value.known == planners()


@pytest.mark.parametrize("planner", ["PRM", "PRMstar"])
def test_planners_that_are_not_repeatable_are_not_offered(planner: str) -> None:
    assert planner not in planners()
    with pytest.raises(PlannerUnavailable, match="available: RRTConnect"):
        plan(pillar_task(), planner)


@pytest.mark.soak
@pytest.mark.parametrize("planner", ompl_planners)
def test_every_planner_finds_its_way_around_the_pillar(planner: str) -> None:
    task = pillar_task()
    assert_free(task, plan(task, planner, seed=1, time_limit=60.0))


def test_a_process_that_planned_ends_without_a_word() -> None:
    script = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from rigs.motion.planning_scenes import pillar_task\n"
        "from openpendant.motion.planning.planner import plan_free_path\n"
        "t = pillar_task()\n"
        "plan_free_path(t.collision.kinematics, t.collision, t.start, t.goal)\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
