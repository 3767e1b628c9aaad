"""Reduced speed: tool and elbow keep to 250 mm/s in what is sent; plans are certified for it."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from rigs.cells import jog_undos
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import refusal_from
from rigs.data.program_samples import linked
from rigs.motion.jog_pad import EmulatedPad

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.kinematics.serial import Kinematics, with_tool
from openpendant.motion.pose import Pose
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit, elbow_link
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
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    JogSpace,
    JogStep,
    Motion,
    PoseMove,
    ProgramRun,
    RunKind,
)
from openpendant.simplemsg.standard import JointTrajPtFull
from openpendant.simplemsg.verdicts import VerdictCode as V

CAP = 0.25
SLACK = 1.0 + 1e-6
TILTED = (math.sin(0.3), 0.0, 0.0, math.cos(0.3))
TCP = Pose.from_values((0.05, 0.0, 0.15), TILTED)
UR5 = serial_robot("ur5")
TOOLED = Kinematics(with_tool(UR5, TCP))
BARE = Kinematics(UR5)
ELBOW = elbow_link(BARE)
STEP = 1e-6
FOLDED = (0.0, -1.2, 2.2, -1.0, 1.5, 0.0)
STRETCHED = (1.2, -0.4, 0.5, -1.6, 1.2, 1.0)


class ManualCell(EmulatedPad):
    """A UR5 in T1 whose selected tool is 150 mm long, and a pendant with the enabling held."""

    def __init__(self) -> None:
        super().__init__(EmulatedCell(has_surroundings=True))
        self.ask("tools.add", name="torch", expected_revision=0, tcp=_placed(TCP))
        self.ask("tools.select", name="torch", expected_revision=1)
        self.hold(100)
        self.begun = len(self.sent)

    def until_ended(self) -> V:
        before = len(self.pendant.outcomes())
        for _ in range(1_200):
            self.hold(50)
            if len(self.pendant.outcomes()) > before:
                return self.pendant.outcomes()[-1][1]
        raise AssertionError("the motion does not end")

    def points(self) -> list[JointTrajPtFull]:
        return self.sent[self.begun :]

    def jogged(self, space: JogSpace, values: tuple[float, ...], frame: str) -> None:
        assert self.press(*values, space=space, frame=frame) is V.ACCEPTED
        self.hold(1_500)
        assert self.release() is V.ACCEPTED


def _placed(pose: Pose) -> dict[str, list[float]]:
    return {"position": pose.position.tolist(), "orientation": pose.quaternion.tolist()}


def speeds(points: list[JointTrajPtFull]) -> tuple[float, float]:
    """Return the greatest speed of tool centre point and elbow at the points [m/s]."""
    position = np.array([point.positions[:6] for point in points])
    velocity = np.array([point.velocities[:6] for point in points])
    found = []
    for kinematics, link in ((TOOLED, None), (BARE, ELBOW)):
        ahead = kinematics.places(position + STEP * velocity, link).position
        behind = kinematics.places(position - STEP * velocity, link).position
        found.append(float(np.linalg.norm(ahead - behind, axis=1).max()) / (2 * STEP))
    return found[0], found[1]


def tool_jog(cell: ManualCell) -> None:
    cell.jogged(JogSpace.TOOL, (0.0, 0.4, -1.0, 0.0, 0.0, 0.0), "tool")


def joint_move(cell: ManualCell) -> None:
    assert cell.pendant.move(*STRETCHED) is V.ACCEPTED


def joint_path(cell: ManualCell) -> None:
    assert cell.pendant.path(FOLDED, STRETCHED) is V.ACCEPTED


def wrist_turn(cell: ManualCell) -> None:
    here = cell.cell.position
    assert cell.pendant.move(*here[:4], here[4] + 2.0, here[5] + 3.0) is V.ACCEPTED


def line(cell: ManualCell) -> None:
    here = TOOLED.forward(cell.cell.position)
    turn = Pose.from_rpy((0.0, 0.0, 0.0), (0.6, -0.4, 0.5))
    goal = here.compose(turn)
    there = (goal.position + np.array((0.05, 0.2, 0.1))).tolist()
    move = PoseMove(
        cell._request(), Motion.LIN, 1.0, "base", tuple(there), tuple(goal.quaternion.tolist())
    )
    assert cell.pendant.code(move) is V.ACCEPTED


def step(cell: ManualCell) -> None:
    by = (0.0, 0.2, 0.0, 0.4, 0.0, 0.0)
    asked = JogStep(cell._request(), 1.0, JogSpace.TOOL, "tool", 6, joint_array(by))
    assert cell.pendant.code(asked) is V.ACCEPTED


def undo(cell: ManualCell) -> None:
    tool_jog(cell)
    assert cell.until_ended() is V.ACCEPTED
    assert jog_undos.undo(cell) is V.ACCEPTED


def program(cell: ManualCell) -> None:
    revision = cell.ask("programs.create", name="main", tool="torch")["revision"]
    for name, way in (("a", "PTP"), ("b", "LIN")):
        move = {"way": way, "point": name, "speed": {"kind": "fraction", "value": 1.0}}
        revision = cell.ask(
            "programs.record", name="main", expected_revision=revision, point=name, move=move
        )["revision"]
        if name == "a":
            line(cell)
            assert cell.until_ended() is V.ACCEPTED
    run = ProgramRun(cell._request(), RunKind.ALL, 0, 1, 0, 1.0, "main")
    assert cell.pendant.code(run) is V.ACCEPTED


@pytest.fixture
def cell() -> Iterator[ManualCell]:
    made = ManualCell()
    yield made
    assert made.cell.controller.referee.total == 0


MOVES: dict[str, Callable[[ManualCell], None]] = {
    "joint jog": lambda cell: cell.jogged(JogSpace.JOINTS, (1.0, -1.0, -1.0, 1.0, 1.0, 1.0), ""),
    "tool jog": tool_jog,
    "turning jog": lambda cell: cell.jogged(JogSpace.TOOL, (0.0, 1.0, 0.0, 0.5, 0.0, 0.0), "base"),
    "joint move": joint_move,
    "joint path": joint_path,
    "wrist turn": wrist_turn,
    "line": line,
    "step": step,
    "undo": undo,
    "program": program,
}


@pytest.mark.parametrize("moves", MOVES.values(), ids=MOVES)
def test_the_selected_tool_and_the_elbow_keep_to_250_mm_s(
    cell: ManualCell, moves: Callable[[ManualCell], None]
) -> None:
    """Issue 5: T1 speed at most 250 mm/s at every tick (promise 12)."""
    moves(cell)
    assert cell.until_ended() is V.ACCEPTED
    points = cell.points()
    assert len(points) > 20
    tool, elbow = speeds(points)
    assert tool <= CAP * SLACK
    assert elbow <= CAP * SLACK
    assert max(tool, elbow) > 0.2, "so slow a motion proves nothing"


def test_a_line_is_that_of_the_selected_tool(cell: ManualCell) -> None:
    before = TOOLED.forward(cell.cell.position)
    line(cell)
    assert cell.until_ended() is V.ACCEPTED
    after = TOOLED.forward(cell.cell.position)
    way = after.position - before.position
    length = float(np.linalg.norm(way))
    assert length > 0.2
    joints = np.array([point.positions[:6] for point in cell.points()])
    gone = TOOLED.places(joints).position - before.position
    aside = gone - np.outer(gone @ way / length**2, way)
    assert np.linalg.norm(aside, axis=1).max() < 1e-4


HOME = serial_robot("ur5").home_position
THERE = (HOME[0] + 0.8, *HOME[1:])
PLANNER = "openpendant.server.planning.worker.job_planner"
MOTIONS = "openpendant.server.planning.worker.motion_planning"
BLOCKS = "openpendant.server.planning.worker.block_planning"

Planner = Callable[..., Any]


def forgetful(plan: Planner) -> Planner:
    def planned(*arguments: Any, tool_speed: Sequence[ToolSpeedLimit] = (), **named: Any) -> Any:
        assert tool_speed
        return plan(*arguments, **named)

    return planned


@pytest.fixture
def _forgets_the_cap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{MOTIONS}.time_path", forgetful(time_path))
    monkeypatch.setattr(f"{MOTIONS}.time_legs", forgetful(time_legs))
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


def recording_job() -> RecordingJob:
    places = [(HOME[0] + ahead, *HOME[1:]) for ahead in (0.0, 0.4, 0.8)]
    rows = [(0.25 * index, *place, 0.0) for index, place in enumerate(places)]
    extract = Extract(8, (1, 2, 3, 4, 5, 6))
    return RecordingJob(1, HOME, "wave", (pack_rows(rows),), extract, 0.01, tool_speed=CAP)


def block_job() -> BlockJob:
    gatherer = Gatherer(ControlFlow(linked("move PTP c\n")))
    block = gatherer.block((Level("main", 0, ((-1, 1),)),), lambda _: False).block
    return BlockJob(1, HOME, block, (1,), FrameTree(), 1.0, CAP)


JOBS = {
    "move": JointPathJob(1, HOME, (THERE,), 1.0, CAP),
    "path": JointPathJob(1, HOME, (THERE, HOME), 1.0, CAP),
    "PTP": pose_job(Motion.PTP),
    "LIN": pose_job(Motion.LIN),
    "playback": recording_job(),
    "block": block_job(),
}


@pytest.mark.usefixtures("_forgets_the_cap")
@pytest.mark.parametrize("job", JOBS.values(), ids=JOBS)
def test_a_plan_that_forgets_the_cap_is_refused_by_the_certificate(job: Job) -> None:
    refusal = refused(job)
    assert refusal.limit == CAP
    assert refusal.value > CAP


def test_a_plan_that_starts_elsewhere_is_refused_by_the_certificate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    aside = (HOME[0] + 0.02, *HOME[1:])

    def from_elsewhere(_: object, *arguments: Any, **named: Any) -> Trajectory:
        return plan_joint_move(aside, *arguments, **named)

    monkeypatch.setattr(f"{MOTIONS}.plan_joint_move", from_elsewhere)
    refusal = refused(JointPathJob(1, HOME, (THERE,), 1.0))
    assert "start" in refusal.text
    assert (refusal.value, refusal.limit) == pytest.approx((0.02, 0.01))
