import math

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.planning_scenes import pillar_task, random_tasks

from openpendant.motion.errors import NotFinite, OutOfRange, PathInCollision, WrongJointCount
from openpendant.motion.planning.path_check import check_path, first_contact
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline


def test_the_first_contact_is_named_with_its_fraction() -> None:
    task = pillar_task()
    with pytest.raises(PathInCollision) as refused:
        check_path(task.collision, [task.start, task.goal])
    assert {refused.value.first, refused.value.second} == {"wrist_1_link", "pillar"}
    assert 0.3 < refused.value.fraction < 0.35
    back = first_contact(task.collision, [task.goal, task.start])
    assert back is not None
    assert back.fraction < 1.0 - refused.value.fraction


def test_a_path_and_its_waypoints_get_the_same_verdict() -> None:
    task = pillar_task()
    line = first_contact(task.collision, JointLine(task.start, task.goal))
    points = first_contact(task.collision, [task.start, task.start, task.goal])
    assert line is not None
    assert points is not None
    assert line.fraction == pytest.approx(points.fraction, abs=1e-3)


@pytest.mark.parametrize("count", counts(4, 80))
@pytest.mark.parametrize("robot", ["ur5", "fanuc_m10ia"])
def test_the_verdict_is_that_of_looking_everywhere_ten_times_as_densely(
    robot: str, count: int
) -> None:
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


def test_a_clear_path_takes_few_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    task = pillar_task()
    robot_alone = CollisionModel(task.collision.kinematics)
    looks = []
    clearances = CollisionModel.clearances

    def counted(model: CollisionModel, position: np.ndarray) -> np.ndarray:
        looks.append(position)
        return clearances(model, position)

    monkeypatch.setattr(CollisionModel, "clearances", counted)
    assert first_contact(robot_alone, [task.start, task.goal]) is None
    assert len(looks) < 10  # of 1,800 samples: only the pan joint moves, and no pair nears


def test_a_margin_counts_as_touching() -> None:
    task = pillar_task()
    aside = task.start + 0.1 * np.eye(6)[0]
    assert first_contact(task.collision, [task.start, aside]) is None
    found = first_contact(task.collision, [task.start, aside], margin=0.2)
    assert found is not None
    assert 0.0 < found.distance <= 0.2


def test_a_bad_path_is_refused() -> None:
    collision = pillar_task().collision
    with pytest.raises(NotFinite):
        first_contact(collision, [[0.0] * 6, [math.nan] * 6])
    with pytest.raises(WrongJointCount):
        first_contact(collision, [[0.0] * 6, [0.0] * 5])
    with pytest.raises(OutOfRange):
        first_contact(collision, [[0.0] * 6, [9.0] * 6])
    with pytest.raises(WrongJointCount):
        first_contact(collision, JointLine([0.0], [1.0]))
