"""A grasp is a fact (promise 36): what is taken is within reach, whoever asks.

One random robot position, tool and body after another. A pendant's request, a program's `attach`
and its dry run are each held against a distance that is worked out by other formulas than theirs.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect
from rigs.cells.surrounded_cell import SurroundedCell, robot
from rigs.motion.bodies_and_points import any_solid, any_turn, distance_to

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.frames.grasp import MOST_REACH, Grasp
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene, SceneObject
from openpendant.server.planning.jobs import DryRunFound, DryRunJob
from openpendant.server.planning.worker.dry_run_planning import DryRuns
from openpendant.server.programs.language.linking import Linked
from openpendant.server.programs.language.parser import parse
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import Management, Outcome
from openpendant.simplemsg.verdicts import VerdictCode as V

FEW = 300
TRIALS = figure(36, "trials").count
EXACT = figure(36, "exact").bound * 1e-6

UR5 = Kinematics(robot())
ATTACH = Linked(
    "main", {"main": parse('openpendant-program/1\nprogram "main" robot ur5\nattach part\n')}
)


class Trial:
    """Robot, tool and body of one trial, and how far they are apart."""

    def __init__(self, random: np.random.Generator) -> None:
        lower, upper = np.array(robot().limits.lower), np.array(robot().limits.upper)
        self.joints: tuple[float, ...] = tuple(random.uniform(lower, upper).tolist())
        tcp = Pose.from_values(random.uniform(-0.2, 0.2, 3).tolist(), any_turn(random))
        x, y, z = random.uniform(-0.05, 0.05, 3).tolist()
        self.reach = float(random.choice([0.0, 0.01, MOST_REACH, random.uniform(0, MOST_REACH)]))
        grasp = Grasp((x, y, z), self.reach)
        self.tools = FrameTree().add_tool("gripper", tcp, grasp).select_tool("gripper")
        tool = UR5.forward(self.joints).compose(tcp)
        point = tool.compose(Pose.from_values((x, y, z), (0.0, 0.0, 0.0, 1.0))).position
        shape, turn = any_solid(random), any_turn(random)
        # Near enough that about as many are within reach as are not.
        away = random.normal(size=3) * random.choice([0.01, 0.05, 0.2])
        px, py, pz = (point + away).tolist()
        self.scene = Scene((SceneObject("part", shape, (px, py, pz), turn),))
        turned = Pose.from_values((0.0, 0.0, 0.0), turn).rotation
        self.distance = distance_to(shape, turned.T @ -away)

    @property
    def is_near(self) -> bool:
        return self.distance <= self.reach


class GraspedCell(SurroundedCell):
    def prepare(self, trial: Trial) -> None:
        """Put robot, tool and body where a trial has them; nothing is stored."""
        steps = self.mathematics.scene_steps(trial.scene)
        while True:
            try:
                next(steps)
            except StopIteration as built:
                self.mathematics.apply_scene(trial.tools, built.value)
                break
        self.report(trial.joints)

    def by_request(self, trial: Trial) -> tuple[V | None, float]:
        self.prepare(trial)
        revision = self.around.world.revisions[DocumentKind.SCENE]
        done, answer = self._answer("scene.attach", {"name": "part", "expected_revision": revision})
        if done:
            return None, answer["distance"]
        assert answer["limit"] == trial.reach
        return V(answer["code"]), answer["value"]

    def by_program(self, trial: Trial) -> tuple[V | None, float]:
        self.prepare(trial)
        told: list[Refusal | None] = []
        self.perform(self.around.attach("part", self.now, told.append))
        self.until(lambda: bool(told))
        return _read(told[0])


def by_dry_run(trial: Trial) -> tuple[V | None, float]:
    job = DryRunJob(1, "test 1", trial.joints, ATTACH, trial.tools, None, trial.scene)
    found = expect(DryRunFound, DryRuns().slice(UR5, job, lambda: False))
    (hand_over,) = found.run.hand_overs
    return _read(hand_over.refusal)


def _read(refusal: Refusal | None) -> tuple[V | None, float]:
    return (None, 0.0) if refusal is None else (refusal.code, refusal.value)


def judged(folder: Path, trials: int, seed: int) -> Counter[str]:
    cell, random, seen = GraspedCell(folder), np.random.default_rng(seed), Counter[str]()
    for number in range(trials):
        trial = Trial(random)
        if abs(trial.distance - trial.reach) < EXACT and trial.distance:
            seen["too near the limit to say"] += 1
            continue
        expected = None if trial.is_near else V.NOTHING_GRIPPED
        told = cell.by_request(trial), cell.by_program(trial), by_dry_run(trial)
        assert [code for code, _ in told] == [expected] * 3, (seed, number, trial.distance, told)
        measured = told[:1] if trial.is_near else told
        for _, distance in measured:
            assert distance == pytest.approx(trial.distance, abs=EXACT), (seed, number)
        held = cell.mathematics.scene.get("part").link
        assert held == (robot().tool_link if trial.is_near else None)
        seen["taken" if trial.is_near else "refused"] += 1
        seen["inside"] += trial.distance == 0.0
    cell.store.close()
    return seen


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_promise_36_nothing_is_taken_from_beyond_reach(seed: int, tmp_path: Path) -> None:
    seen = judged(tmp_path, FEW // 3, seed)
    assert min(seen["taken"], seen["refused"], seen["inside"]) > FEW // 30, seen


@pytest.mark.soak
def test_promise_36_nothing_is_taken_from_beyond_reach_in_ten_thousand_trials(
    tmp_path: Path,
) -> None:
    seen = judged(tmp_path, TRIALS, 36)
    tell(f"grasps: {dict(seen)}")
    assert seen["taken"] + seen["refused"] > 0.99 * TRIALS


# A whole program, run and dry: the object that one statement left is where the next one looks.

PROGRAM = """openpendant-program/1
program "main" robot ur5 tool gripper
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints 0.1 -1.5 1.5 -1.5 -1.5 0 rad
move PTP a
attach part
move PTP b
detach part
move PTP a
attach part
move PTP b
"""


class ProgrammedCell(EmulatedCell):
    def __init__(self) -> None:
        super().__init__(has_surroundings=True)
        self.user = self.holder("ann")
        tip = Pose.from_values((0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0))
        part = UR5.forward((0.0, -1.5, 1.5, -1.5, -1.5, 0.0)).compose(tip).position.tolist()
        tcp = {"position": [0.0, 0.0, 0.1]}
        ball = {"name": "part", "shape": {"type": "sphere", "radius": 0.01}, "position": part}
        ask = self.ask
        ask("tools.add", name="gripper", tcp=tcp, expected_revision=0)
        ask("tools.select", name="gripper", expected_revision=1)
        ask("scene.add", object=ball, expected_revision=0)
        ask("programs.save", name="main", body=PROGRAM, expected_revision=0)

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Make a request, which may take a while; return its answer."""
        before = len(self.user.answers())
        self.user.send(Management(self.user._next(), json.dumps({"op": op, **fields}).encode()))
        for _ in range(100):
            if len(self.user.answers()) > before:
                break
            self.wait(10)
        (answer,) = self.user.answers()[before:]
        return answer


def test_promise_36_a_program_and_its_dry_run_end_at_the_same_line_by_the_same_distance() -> None:
    cell = ProgrammedCell()
    found = cell.ask("programs.dry_run", name="main")
    missed, taken, left = found["scene"]  # what is refused comes first
    assert [each["reachable"] for each in (taken, left, missed)] == [True, True, False]
    assert (missed["code"], missed["object"]) == (V.NOTHING_GRIPPED, "part")
    assert missed["line"] > left["line"] > taken["line"]
    run = messages.ProgramRun(cell.user._next(), 1, 0, 1, 0, 1.0, "main")
    assert cell.user.code(run) is V.ACCEPTED
    for _ in range(100):
        cell.user.send(messages.AuthorityBeat())
        cell.wait(100)
        outcomes = [each for each in cell.user.got if isinstance(each, Outcome)]
        if outcomes:
            break
    (outcome,) = outcomes
    assert outcome.code == V.NOTHING_GRIPPED
    assert outcome.text == missed["text"]
    assert outcome.limit == pytest.approx(0.01)
    last = cell.user.all(messages.ProgramReport)[-1]
    assert (last.line, last.text) == (missed["line"], missed["text"])
