"""Plans in the planning process: the same seed gives the same samples, and what is told of them."""

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.planning.ompl_planner import planners
from openpendant.motion.planning.rrt_connect import BUILT_IN
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.server.planning.jobs import (
    FreePath,
    JointPathJob,
    PlanAnswer,
    PlanJob,
    SearchProgress,
)
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = serial_robot("ur5").home_position
GOAL = (HOME[0] + 1.2, *HOME[1:])
UR5 = Kinematics(serial_robot("ur5"))


def pillar() -> Scene:
    middle = UR5.forward((HOME[0] + 0.6, *HOME[1:])).position.tolist()
    return Scene((SceneObject("pillar", Box((0.12, 0.12, 0.12)), tuple(middle)),))


def around(planner: str = BUILT_IN, seed: int = 3, margin: float = 0.005) -> PlanJob:
    motion = FreePath(HOME, GOAL, planner, seed, 5.0, margin, 0.5)
    return PlanJob(1, HOME, motion, None, pillar())


def digest(planned: PlanAnswer) -> str:
    assert isinstance(planned.result, tuple), planned.result
    trajectory = planned.result[0]
    arrays = trajectory.times, trajectory.position, trajectory.velocity, trajectory.acceleration
    return hashlib.sha256(b"".join(each.tobytes() for each in arrays)).hexdigest()


PLANNERS = sorted({"RRTConnect", BUILT_IN} & set(planners()))

ELSEWHERE = """
from test_plan_making import PLANNERS, answer, around, digest
print(*(digest(answer("ur5", around(planner))) for planner in PLANNERS))
"""


def test_promise_35_the_same_seed_gives_the_same_samples_in_another_process() -> None:
    here = [digest(answer("ur5", around(planner))) for planner in PLANNERS]
    ran = subprocess.run(
        [sys.executable, "-c", ELSEWHERE],
        env={"PYTHONPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.split() == here


def test_another_seed_gives_other_samples() -> None:
    assert digest(answer("ur5", around(seed=3))) != digest(answer("ur5", around(seed=4)))


def test_a_search_tells_how_far_it_has_come_and_then_answers() -> None:
    told: list[PlanAnswer] = []
    last = answer("ur5", around(), told.append)
    assert told
    for word in told:
        assert isinstance(word.result, SearchProgress)
        assert 0.0 <= word.result.fraction <= 1.0
        assert not word.is_final
    assert last.is_final


def test_its_clearance_is_the_least_of_all_samples() -> None:
    planned = answer("ur5", around())
    assert isinstance(planned.result, tuple)
    assert planned.facts is not None
    nearest = planned.facts.nearest
    assert nearest is not None
    model = CollisionModel(UR5, pillar())
    pairs = [number for number, pair in enumerate(model.pairs) if "pillar" in pair]
    every = [min(model.clearances_of(pairs, place)) for place in planned.result[0].position]
    assert nearest.distance == pytest.approx(min(every), abs=1e-4)
    assert nearest.distance > 0.0
    at = round(nearest.at / 0.01)
    assert every[at] == pytest.approx(nearest.distance, abs=1e-9)


def test_without_objects_there_is_no_clearance() -> None:
    planned = answer("ur5", PlanJob(1, HOME, JointPathJob(0, HOME, (GOAL,), 0.5), None, Scene()))
    assert planned.facts is not None
    assert planned.facts.nearest is None


def test_a_larger_margin_keeps_farther_away() -> None:
    def clearance(margin: float) -> float:
        planned = answer("ur5", around(margin=margin))
        assert planned.facts is not None
        assert planned.facts.nearest is not None
        return planned.facts.nearest.distance

    assert clearance(0.01) > 0.01 > clearance(0.0)


def test_a_contact_on_the_straight_way_is_refused() -> None:
    job = PlanJob(1, HOME, JointPathJob(0, HOME, (GOAL,), 0.5), None, pillar())
    refused = answer("ur5", job).result
    assert isinstance(refused, Refusal)
    assert refused.code is V.PATH_IN_COLLISION


@pytest.mark.parametrize(("duration", "is_refused"), [(119.9, False), (120.5, True)])
def test_two_minutes_are_the_longest(duration: float, is_refused: bool) -> None:
    speed = 1.2 / duration / serial_robot("ur5").limits.velocity[0]
    planned = answer("ur5", PlanJob(1, HOME, JointPathJob(0, HOME, (GOAL,), speed)))
    if not is_refused:
        assert isinstance(planned.result, tuple)
        return
    assert isinstance(planned.result, Refusal)
    assert planned.result.code is V.PLAN_TOO_LONG
    assert planned.result.limit == 120.0
