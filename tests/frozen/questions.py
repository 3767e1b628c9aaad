"""One question of each kind to planner, store, passwords, accounts and loads, as journals note it.

A journal has such a question as the words of its `repr`: the names of classes, of fields and of
every value inside are part of what is compared when it is run again.
"""

from collections.abc import Mapping
from types import UnionType
from typing import Any, get_args

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene import scene
from openpendant.server.access.accounts import AccountAction, AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.connection_loads import LoadQuestion
from openpendant.server.access.passwords import PasswordHash, Secret
from openpendant.server.events.management_requests import parse
from openpendant.server.journal.event_records import request_to_bytes
from openpendant.server.planning import jobs
from openpendant.server.programs.editing import program_tasks
from openpendant.server.programs.interpreter.motion_blocks import BlockMove, MotionBlock
from openpendant.server.programs.interpreter.run_events import OfferedSignals
from openpendant.server.programs.language.linking import link
from openpendant.server.programs.language.program import OwnRobot, Program
from openpendant.server.refusal import Refusal
from openpendant.server.store import requests
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import Extract
from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.pendant.management import statements
from openpendant.simplemsg.pendant.management.kinematics import InverseKinematics
from openpendant.simplemsg.pendant.management.program_values import (
    ArmConfiguration,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.shapes import ListMeshes, ReadMesh, ShowShapes
from openpendant.simplemsg.pendant.management.statements import Move, Speed, SpeedKind, Way
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

_START = (0.5, -1.25)
_SCENE = scene.Scene(
    (
        scene.SceneObject("box", scene.Box((0.5, 0.25, 0.125)), (1.0, 2.0, 3.0)),
        scene.SceneObject("ball", scene.Sphere(0.25), frame="base", link="tool0"),
        scene.SceneObject("post", scene.Cylinder(0.125, 2.0)),
        scene.SceneObject("rail", scene.Capsule(0.125, 2.0)),
        scene.SceneObject("part", scene.Mesh("part.stl", (0.001, 0.001, 0.001))),
    ),
    frozenset({("box", "ball"), ("post", "rail")}),
    7,
)
_GOAL = jobs.PoseGoal((0.5, 0.25, 0.125), (0.0, 0.0, 0.0, 1.0))
_POSE = PointPose((0.5, 0.25, 0.125), (0.0, 1.0, 0.0, 0.0), "table", "gripper")
_ARM = ArmConfiguration("front", "up", "no-flip", (0, 0))
_POINT = TeachPoint("above", _START, _POSE, _ARM, "grip here")
_MOVE = Move(
    Way.CIRC, "above", ("aside",), Speed(SpeedKind.TOOL, 0.25), zone=0.125, comment="slowly"
)
_FRAMES = FrameTree().add("table", Pose.from_values((0.5, 0.25, 0.125), (0.0, 0.0, 0.0, 1.0)))
_LIMITS = JointLimits(
    ("first", "second"), (-2.0, -0.5), (2.0, 0.5), (1.0, 0.5), (4.0, 2.0), (False, True)
)
_PROGRAM = Program("main", "robot", (), "gripper", "table", (_POINT,), (), "a comment")
_LINKED = link(_PROGRAM, lambda name: None)
_BLOCK = MotionBlock((BlockMove("main", 1, _MOVE, _POINT, (_POINT,)),), True)
_PROGRAM_KIND = DocumentKind.PROGRAM

STATEMENTS: tuple[Any, ...] = (
    _MOVE,
    Move(Way.PTP, "above", dwell=0.5),
    Move(Way.LIN, "above"),
    Move(Way.SPLINE, "above", ("aside",)),
    statements.Wait(0.5),
    statements.WaitInput(1, True, 2.0),
    statements.SetOutput(2, False),
    statements.ReadInput(3, "there"),
    statements.Attach("part"),
    statements.Detach("part"),
    statements.Loop(3),
    statements.IfInput(4, True),
    statements.IfFlag("there", False),
    statements.Else(),
    statements.End(),
    statements.Call("aside"),
    statements.Comment(comment="nothing"),
)

EDITS: tuple[Any, ...] = (
    statements.RecordPoint(_POINT, _MOVE, 1),
    statements.TouchUp("above", _START, _POSE, _ARM),
    statements.DeletePoint("above"),
    statements.RenamePoint("above", "below"),
    statements.CommentPoint("above", "grip here"),
    statements.ReorderPoint("above", 1),
    statements.InsertStatements(STATEMENTS, 1),
    statements.DeleteStatements(1, 2),
    statements.ReorderStatements(1, 2, 3),
    statements.ReplaceStatement(1, statements.Wait(0.5)),
    statements.CommentStatement(1, "now"),
    statements.DescribeProgram("main", "gripper", "table", "a comment"),
)

TASKS: tuple[Any, ...] = (
    program_tasks.ReadSource("text", "text", "main.program"),
    program_tasks.PrintBody("{}", "main"),
    *(program_tasks.EditBody("{}", "main", edit, OwnRobot("robot", _LIMITS)) for edit in EDITS),
    program_tasks.CompareBodies("{}", "main", "{}"),
    program_tasks.TakeHead("{}", "main", "above"),
    program_tasks.UnpackBody("{}", "main"),
)

JOBS: tuple[Any, ...] = (
    jobs.PoseJob(1, _START, (_GOAL,), "table", Motion.LIN, 0.5, 0.25, _GOAL, _SCENE),
    jobs.PoseJob(2, _START, (_GOAL, _GOAL), "base", Motion.PTP, 1.0),
    jobs.JointPathJob(3, _START, (_START, _START), 0.5, 0.25, _GOAL, scene.Scene()),
    jobs.RosPathJob(
        4, _START, (jobs.RosPoint(_START, None, 1.0), jobs.RosPoint(_START, 0.5, 0.25)), 0.1, 0.01
    ),
    jobs.BlockJob(5, _START, _BLOCK, (11,), _FRAMES, 0.5, 0.25),
    jobs.RecordingJob(6, _START, "swing", (b"rows",), Extract(4, (1, 2)), 0.01, 2.0, 0.005),
    jobs.DryRunJob(*(7, "7-1", _START, _LINKED, FrameTree()), signals=OfferedSignals(16, 8)),
    jobs.DryRunJob(
        *(8, "8-1", _START, _LINKED, FrameTree()),
        signals=Refusal(VerdictCode.SIGNALS_UNAVAILABLE, "it has none", 1, 2.0, 3.0),
    ),
    jobs.WayCheckJob(9, _START, b"positions", scene.Scene()),
    *(jobs.ProgramJob(10 + number, task) for number, task in enumerate(TASKS)),
    jobs.PlanJob(
        41, _START, jobs.PoseJob(0, _START, (_GOAL,), "table", Motion.PTP, 0.5), 2, _SCENE, _GOAL
    ),
    jobs.PlanJob(42, _START, jobs.JointPathJob(0, _START, (_START,), 0.5, 0.25, _GOAL)),
    jobs.PlanJob(43, _START, jobs.FreePath(_START, _GOAL, "RRTConnect", 3, 5.0, 0.005, 0.5)),
    jobs.ReadBody(40, 3, b'{"op":"why"}', parse),
    jobs.KinematicsQuestion(
        41,
        3,
        InverseKinematics(pose={"position": (0.5, 0.25, 0.125)}, branches="all", scene=True),
        _START,
        FrameTree(),
        jobs.PoseGoal((0.0, 0.0, 0.125), (0.0, 0.0, 0.0, 1.0)),
        scene.Scene(),
    ),
    jobs.ShapesQuestion(42, 3, ShowShapes("ur5")),
    jobs.ShapesQuestion(43, 3, ListMeshes()),
    jobs.ShapesQuestion(44, 3, ReadMesh("0" * 64, 32_768)),
)

REQUESTS: tuple[Any, ...] = (
    requests.Load(_PROGRAM_KIND, "main", 3),
    *(requests.ListHeadings(kind) for kind in DocumentKind),
    requests.ListHeadings(),
    requests.ListHistory(_PROGRAM_KIND, "main"),
    requests.Save(_PROGRAM_KIND, "main", '{"body": "größer"}', 3, "ann"),
    requests.Delete(_PROGRAM_KIND, "main", 3, "ann"),
    requests.AppendChunk("swing", 2, b"rows"),
    requests.LoadChunks("swing", 0, 100),
    requests.MeasureRecording("swing"),
    requests.TrimRecording("swing", "part", 0.5, None, "ann"),
    requests.RenameRecording("swing", "part", 3, "ann"),
)

_KEPT = PasswordHash(salt="ab" * 16, digest="cd" * 32)
CHECKS: tuple[Any, ...] = (
    VerifyJob(1, 7, Secret("a secret"), _KEPT, "192.0.2.1", "a name", has_failed=True),
)
CHANGES: tuple[Any, ...] = (
    *(AccountChange(number, "ann", action, "bob") for number, action in enumerate(AccountAction)),
    *(AccountChange(10, "ann", AccountAction.SET_ROLE, "bob", role) for role in Role),
    AccountChange(20, "ann", AccountAction.ADD, "bob", Role.VIEWER, Secret("a secret")),
)

LOADS: tuple[Any, ...] = (LoadQuestion(1, (4, 7)),)

KINDS: Mapping[str, tuple[Any, tuple[Any, ...]]] = {
    "planner": (jobs.Job, JOBS),
    "program": (program_tasks.Task, TASKS),
    "edit": (statements.Edit, EDITS),
    "statement": (statements.Statement, STATEMENTS),
    "shape": (scene.Shape, tuple(each.shape for each in _SCENE.objects)),
    "store": (requests.Request, REQUESTS),
    "passwords": (VerifyJob, CHECKS),
    "accounts": (AccountChange, CHANGES),
    "loads": (LoadQuestion, LOADS),
}
"""Of each kind of question the type of all of them, and one of each."""


def kinds_of(union: Any) -> set[type]:
    if isinstance(union, UnionType):
        return {kind for each in get_args(union) for kind in kinds_of(each)}
    return {union}


def lines() -> list[str]:
    asked = [
        *(f"planner {job!r}" for job in JOBS),
        *(f"store {request_to_bytes(request).decode()}" for request in REQUESTS),
        *(f"passwords {job!r}" for job in CHECKS),
        *(f"accounts {change!r}" for change in CHANGES),
        *(f"loads {question!r}" for question in LOADS),
    ]
    return [line.replace("\n", "\\n") for line in asked]
