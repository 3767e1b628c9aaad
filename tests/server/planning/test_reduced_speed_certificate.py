"""The cap of the mode is looked at once more where a motion was planned: by the certificate.

Planning keeps to the cap by itself, so here it is made to forget it, or to start elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pytest
from rigs.cells.refusals import refusal_from
from rigs.data.program_samples import linked

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.planning.jobs import (
    BlockJob,
    Job,
    JointPathJob,
    PoseGoal,
    PoseJob,
    RecordingJob,
)
from openpendant.server.planning.worker.job_planner import answer, kinematics_of
from openpendant.server.planning.worker.recording_planning import plan_recording as plan
from openpendant.server.programs.interpreter.control_flow import ControlFlow, Level
from openpendant.server.programs.interpreter.motion_blocks import Gatherer
from openpendant.server.refusal import Refusal
from openpendant.server.store.recording_format import Extract, pack_rows
from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = serial_robot("ur5").home_position
THERE = (HOME[0] + 0.8, *HOME[1:])
CAP = 0.25
PLANNER = "openpendant.server.planning.worker.job_planner"
BLOCKS = "openpendant.server.planning.worker.block_planning"

Planner = Callable[..., Any]


def forgetful(plan: Planner) -> Planner:
    def planned(*arguments: Any, tool_speed: Sequence[ToolSpeedLimit] = (), **named: Any) -> Any:
        assert tool_speed
        return plan(*arguments, **named)

    return planned


@pytest.fixture
def _forgets_the_cap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{PLANNER}.time_path", forgetful(time_path))
    monkeypatch.setattr(f"{PLANNER}.time_legs", forgetful(time_legs))
    monkeypatch.setattr(f"{BLOCKS}.time_path", forgetful(time_path))
    monkeypatch.setattr(f"{PLANNER}.plan_recording", lambda arm, job, _: plan(arm, job, ()))


def refused(job: Job) -> Refusal:
    result = refusal_from(answer("ur5", job).result)
    assert result.code is V.CERTIFICATE_REFUSED
    return result


def pose_job(motion: Motion) -> PoseJob:
    x, y, z = kinematics_of("ur5").forward(HOME).position.tolist()
    orientation = kinematics_of("ur5").forward(HOME).quaternion.tolist()
    goal = PoseGoal((x, y - 0.2, z + 0.1), tuple(orientation))
    return PoseJob(1, HOME, (goal,), "base", motion, 1.0, CAP)


@pytest.mark.usefixtures("_forgets_the_cap")
@pytest.mark.parametrize(
    "job",
    [
        JointPathJob(1, HOME, (THERE,), 1.0, CAP),
        JointPathJob(1, HOME, (THERE, HOME), 1.0, CAP),
        pose_job(Motion.PTP),
        pose_job(Motion.LIN),
    ],
    ids=["move", "path", "PTP", "LIN"],
)
def test_a_plan_that_forgets_the_cap_is_refused_by_the_certificate(job: Job) -> None:
    refusal = refused(job)
    assert refusal.limit == CAP
    assert refusal.value > CAP


@pytest.mark.usefixtures("_forgets_the_cap")
def test_a_playback_that_forgets_the_cap_is_refused_by_the_certificate() -> None:
    places = [HOME, (HOME[0] + 0.4, *HOME[1:]), (HOME[0] + 0.8, *HOME[1:])]
    rows = [(0.25 * index, *place, 0.0) for index, place in enumerate(places)]
    extract = Extract(8, (1, 2, 3, 4, 5, 6))
    job = RecordingJob(1, HOME, "wave", (pack_rows(rows),), extract, 0.01, tool_speed=CAP)
    assert refused(job).limit == CAP


@pytest.mark.usefixtures("_forgets_the_cap")
def test_a_block_that_forgets_the_cap_is_refused_by_the_certificate() -> None:
    gatherer = Gatherer(ControlFlow(linked("move PTP c\n")))
    block = gatherer.block((Level("main", 0, ((-1, 1),)),), lambda _: False).block
    job = BlockJob(1, HOME, block, (1,), FrameTree(), 1.0, CAP)
    assert refused(job).limit == CAP


def test_a_plan_that_starts_elsewhere_is_refused_by_the_certificate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    aside = (HOME[0] + 0.02, *HOME[1:])

    def from_elsewhere(_: object, *arguments: Any, **named: Any) -> Trajectory:
        return plan_joint_move(aside, *arguments, **named)

    monkeypatch.setattr(f"{PLANNER}.plan_joint_move", from_elsewhere)
    refusal = refused(JointPathJob(1, HOME, (THERE,), 1.0))
    assert "start" in refusal.text
    assert (refusal.value, refusal.limit) == pytest.approx((0.02, 0.01))
