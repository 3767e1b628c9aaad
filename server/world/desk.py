"""Frames, tools, scene, signals and trace as pendants ask for them.

Owns the translation of each request into a change of the world or a question to it, and its
answer. When something may change is `world`'s business.
"""

from __future__ import annotations

import json
from collections.abc import Callable

from openpendant.motion.errors import MotionError
from openpendant.motion.frame_file import frames_to_json
from openpendant.motion.frame_teaching import frame_from_four_points, frame_from_three_points
from openpendant.motion.frames import FLANGE, FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.robot import robot_names
from openpendant.motion.scene import Scene
from openpendant.motion.scene_file import SCENE_SCHEMA, scene_to_data
from openpendant.motion.tool_calibration import tool_centre
from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..playback.operations import Asker
from ..refusal import Refusal, refusal_of
from ..robot_cell import RobotCell
from ..store.documents import DocumentKind
from . import device_operations as device
from . import operations as op
from .documents import scene_from_json, with_frames
from .robot_surroundings import RobotSurroundings
from .signals import CellSignals
from .trace import ToolTrace
from .world import FrameChange, SceneChange, Told, World

_FRAMES, _TOOLS, _SCENE = DocumentKind.FRAMES, DocumentKind.TOOLS, DocumentKind.SCENE
_POINTS_OF_AN_ANSWER = 800


class WorldDesk:
    """Answers requests about what stands around and on the robot of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        world: World,
        view: RobotSurroundings,
        signals: CellSignals,
        trace: ToolTrace,
        robot_name: str,
    ) -> None:
        """Join what it asks."""
        self._cell = cell
        self._world = world
        self._view = view
        self._signals = signals
        self._trace = trace
        self._robot_name = robot_name

    def handle(self, asked: op.WorldOperation, asker: Asker, now: int) -> list[Outgoing]:
        """Carry out a request; the answer may come later."""
        try:
            result = self._handle(asked, asker, now)
        except MotionError as error:
            return asker.refuse(refusal_of(error))
        return asker.refuse(result) if isinstance(result, Refusal) else result

    def _handle(self, asked: op.WorldOperation, asker: Asker, now: int) -> Refusal | list[Outgoing]:
        match asked:
            case op.ShowFrames() | op.TeachFrame() | op.TransformPose() | op.CalibrateTool():
                return self._frame_question(asked, asker, now)
            case op.ShowScene() | op.NearestBodies() | device.ShowTrace() | device.ClearTrace():
                return self._scene_question(asked, asker)
            case device.ListRobots() | device.DescribeRobot() | device.LoadRobot():
                return self._robot(asked, asker)
            case device.ReadAllSignals():
                return asker.answer(
                    offered=self._signals.is_offered,
                    inputs=self._signals.inputs,
                    outputs=self._signals.outputs,
                )
            case device.SetSignal():
                return self._set_signal(asked, asker, now)
            case (
                op.AddObject()
                | op.RemoveObject()
                | op.MoveObject()
                | op.AllowContact()
                | op.AttachObject()
                | op.ImportScene()
            ):
                change = self._scene_change(asked)
                told = _revision(asker)
                return self._world.change_scene(
                    change, asked.expected_revision, asker.name, now, told
                )
        kind = _TOOLS if asked.op.startswith("tools.") else _FRAMES
        return self._world.change_frames(
            kind, _frame_change(asked, kind), asked.expected_revision, asker.name, _revision(asker)
        )

    # Questions.

    def _frame_question(
        self,
        asked: op.ShowFrames | op.TeachFrame | op.TransformPose | op.CalibrateTool,
        asker: Asker,
        now: int,
    ) -> list[Outgoing]:
        world = self._world
        match asked:
            case op.ShowFrames():
                return asker.answer(
                    content=json.loads(frames_to_json(world.frames)),
                    names=tuple(world.frames.frames),
                    frames_revision=world.revisions[_FRAMES],
                    tools_revision=world.revisions[_TOOLS],
                    problems={str(k): v.sentence for k, v in world.problems.items()},
                )
            case op.TeachFrame(points=points):
                teach = frame_from_four_points if len(points) == 4 else frame_from_three_points
                taught = teach(*points)
                return asker.answer(
                    pose=_pose(taught.pose),
                    angle=taught.angle,
                    tilt_per_error=taught.tilt_per_error,
                    skew=taught.skew,
                )
            case op.TransformPose():
                at = now - round(asked.seconds_ago * 1e9) if asked.seconds_ago else None
                found = world.history.transform(asked.source, asked.target, at)
                return asker.answer(pose=_pose(found.compose(asked.pose.pose())))
            case op.CalibrateTool():
                centre = tool_centre([self._view.flange(each) for each in asked.positions])
                return asker.answer(
                    position=centre.position.tolist(),
                    residuals=centre.residuals,
                    max_residual=centre.max_residual,
                    uncertainty=centre.uncertainty,
                )

    def _scene_question(
        self,
        asked: op.ShowScene | op.NearestBodies | device.ShowTrace | device.ClearTrace,
        asker: Asker,
    ) -> Refusal | list[Outgoing]:
        match asked:
            case op.ShowScene():
                revision = self._world.revisions[_SCENE]
                return asker.answer(content=scene_to_data(self._world.scene), revision=revision)
            case op.NearestBodies():
                position = self._cell.feedback.position
                if position is None:
                    return Refusal(VerdictCode.FEEDBACK_STALE)
                found = self._view.nearest(position)
                if found is None:
                    return asker.answer(distance=None)
                return asker.answer(
                    distance=found.distance,
                    first=found.first,
                    second=found.second,
                    first_point=found.first_point.tolist(),
                    second_point=found.second_point.tolist(),
                )
            case device.ShowTrace(first=first):
                points = self._trace.points
                shown = points[first : first + _POINTS_OF_AN_ANSWER]
                return asker.answer(points=shown, total=len(points))
            case device.ClearTrace():
                self._trace.clear()
                return asker.answer()

    def _robot(
        self, asked: device.ListRobots | device.DescribeRobot | device.LoadRobot, asker: Asker
    ) -> Refusal | list[Outgoing]:
        own = self._robot_name
        match asked:
            case device.ListRobots():
                return asker.answer(robots=robot_names(), loaded=own)
            case device.DescribeRobot(name=name) if name in (None, own):
                return asker.answer(**self._view.specification)
            case device.LoadRobot(name=name) if name == own:
                return asker.answer(loaded=own)
        known = asked.name in robot_names()
        text = f"this cell has {own!r}" + ("" if known else f"; no robot is called {asked.name!r}")
        return Refusal(VerdictCode.ROBOT_FIXED, text)

    # Changes.

    def _set_signal(
        self, asked: device.SetSignal, asker: Asker, now: int
    ) -> Refusal | list[Outgoing]:
        def done(refusal: Refusal | None, at: int) -> list[Outgoing]:
            return asker.answer() if refusal is None else asker.refuse(refusal)

        return self._signals.set_output(asked.output, asked.value, now, done)

    def _scene_change(
        self,
        asked: op.AddObject
        | op.RemoveObject
        | op.MoveObject
        | op.AllowContact
        | op.AttachObject
        | op.ImportScene,
    ) -> SceneChange:
        match asked:
            case op.AddObject():
                content = {"schema": SCENE_SCHEMA, "objects": [asked.object]}
                (added,) = scene_from_json(json.dumps(content)).objects
                return lambda scene: scene.add(added)
            case op.RemoveObject(name=name):
                return lambda scene: scene.remove(name)
            case op.MoveObject(name=name, pose=pose):
                return lambda scene: scene.move(name, pose.pose())
            case op.AllowContact(first=first, second=second):
                if asked.op == "scene.allow":
                    return lambda scene: scene.allow(first, second)
                return lambda scene: scene.forbid(first, second)
            case op.AttachObject():
                return self._holding(asked)
            case op.ImportScene():
                imported = scene_from_json(json.dumps(asked.content))
                return lambda scene: imported

    def _holding(self, asked: op.AttachObject) -> SceneChange:
        name = asked.name

        def changed(scene: Scene) -> Scene:
            position = self._cell.feedback.position or ()
            if asked.op == "scene.attach":
                link = asked.link or self._view.flange_link
                at = self._view.link_pose(position, link)
                return scene.attach(name, link, at, touching=(link,))
            held_by = scene.get(name).link or self._view.flange_link
            return scene.detach(name, self._view.link_pose(position, held_by))

        return changed


def _frame_change(
    asked: op.AddFrame
    | op.MoveFrame
    | op.RenameFrame
    | op.RemoveFrame
    | op.ImportFrames
    | op.AddTool
    | op.MoveTool
    | op.RemoveTool
    | op.SelectTool,
    kind: DocumentKind,
) -> FrameChange:
    match asked:
        case op.AddFrame(name=name, parent=parent, pose=placed):
            return lambda tree: tree.add(name, placed.pose(), parent)
        case op.MoveFrame(name=name, parent=new_parent, pose=placed):
            return lambda tree: tree.move(name, placed.pose(), new_parent)
        case op.RenameFrame(name=name, new_name=new_name):
            return lambda tree: tree.rename(name, new_name)
        case op.RemoveFrame(name=name) | op.RemoveTool(name=name):
            return lambda tree: tree.remove(name)
        case op.AddTool(name=name, tcp=tcp):
            return lambda tree: tree.add_tool(name, tcp.pose())
        case op.MoveTool(name=name, tcp=tcp):
            return lambda tree: tree.move(name, tcp.pose(), FLANGE)
        case op.SelectTool(name=tool):
            return lambda tree: tree.select_tool(tool)
        case op.ImportFrames(content=content):
            return _importing(kind, json.dumps(content))


def _importing(kind: DocumentKind, body: str) -> Callable[[FrameTree], FrameTree]:
    return lambda tree: with_frames(kind, body, tree)


def _revision(asker: Asker) -> Told:
    def told(revision: int | Refusal, now: int) -> list[Outgoing]:
        if isinstance(revision, Refusal):
            return asker.refuse(revision)
        return asker.answer(revision=revision)

    return told


def _pose(pose: Pose) -> dict[str, list[float]]:
    return {"position": pose.position.tolist(), "orientation": pose.quaternion.tolist()}
