from __future__ import annotations

import math

import numpy as np
import pytest

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.server.planning.jobs import DryRunFound, DryRunJob
from openpendant.server.planning.worker.dry_run_planning import DryRuns
from openpendant.server.programs.language.linking import Linked
from openpendant.server.programs.language.parser import parse
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))
TURN = 1.0
HERE = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
HEAD = f"""openpendant-program/1
program "main" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints {TURN} -1.5 1.5 -1.5 -1.5 0 rad
"""


def beside_tool(turn: float) -> tuple[float, float, float]:
    """Return a place 0.25 m out of the tool, with the first axis turned [m]."""
    x, y, z = UR5.forward((turn, *HERE[1:])).position.tolist()
    away = math.hypot(x, y)
    return (x * (1 + 0.25 / away), y * (1 + 0.25 / away), z)


def ball(name: str, place: tuple[float, float, float]) -> SceneObject:
    return SceneObject(name, Sphere(0.05), place)


SCENE = Scene((ball("part", beside_tool(0.0)), ball("post", beside_tool(TURN))))


def found(statements: str, scene: Scene = SCENE) -> DryRunFound:
    program = parse(HEAD + statements)
    whole = Linked("main", {"main": program})
    job = DryRunJob(1, "test 1", HERE, whole, FrameTree(), None, scene)
    runs = DryRuns()
    told = runs.slice(UR5, job, lambda: False)
    assert isinstance(told, DryRunFound)
    return told


def test_what_is_carried_may_not_touch_what_stands() -> None:
    assert found("move PTP a\nmove PTP b\n").run.refusals == ()
    run = found("move PTP a\nattach part\nmove PTP b\n").run
    (refused,) = run.refusals
    assert (refused.index, refused.refusal and refused.refusal.code) == (2, V.PATH_IN_COLLISION)
    assert [each.index for each in run.hand_overs] == [1]


def test_what_was_left_stays_where_it_was_left() -> None:
    lone = Scene((ball("part", beside_tool(0.0)),))
    program = "move PTP a\nattach part\nmove PTP b\ndetach part\nmove PTP a\nmove PTP b\n"
    run = found(program, lone).run
    assert run.refusals == ()
    assert [each.statement.statement for each in run.hand_overs] == ["attach", "detach"]


@pytest.mark.parametrize("statement", ["attach nothing", "detach part", "attach part\nattach part"])
def test_a_hand_over_that_cannot_be_is_refused_at_its_statement(statement: str) -> None:
    run = found(f"move PTP a\n{statement}\n").run
    (refused,) = run.refusals
    assert refused.index == statement.count("\n") + 1
    assert run.complete


def test_a_loop_of_hand_overs_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.server.programs.interpreter.dry_run.MOST_HAND_OVERS", 10)
    lone = Scene((ball("part", beside_tool(0.0)),))
    run = found("loop 1000\nmove PTP a\nattach part\nmove PTP b\ndetach part\nend\n", lone).run
    assert not run.complete
    assert np.isfinite(run.duration)
