"""Scene service: requests of pendants on frames, tools, scene, signals and trace.

Owns the translation of each request into a change of the scene or a question to it, and its answer.
`planning_scene` owns when something may change.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol, cast

from openpendant.motion.description.robot import robot_names
from openpendant.motion.errors import nearest
from openpendant.motion.frames.frame_file import FramesFile, frames_to_json, part_of_frames
from openpendant.motion.frames.frame_teaching import frame_from_four_points, frame_from_three_points
from openpendant.motion.frames.grasp import Grasp
from openpendant.motion.frames.tool_calibration import tool_centre
from openpendant.motion.planning.ompl_planner import planners
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene_file import SCENE_SCHEMA
from openpendant.motion.steps import Stepwise
from openpendant.simplemsg.pendant import PROTOCOL_VERSION
from openpendant.simplemsg.pendant.management import devices, frames, scene
from openpendant.simplemsg.pendant.management.declaration import AnyPose, Changed, Done, FoundPose
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_cell import RobotCell
from ..events.effects import Effect
from ..events.management_requests import ReplyTo, handles
from ..refusal import Refusal
from ..store.documents import DocumentKind
from .document_reading import scene_from_json
from .grasps import Grasps, SceneEdit
from .imports import FramesImport, SceneImport, ToolsImport, reading
from .planning_scene import PlanningScene
from .robot_environment import FrameChange, RobotEnvironment, SceneChange, Told
from .signals import CellSignals
from .trace import ToolTrace

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import Proximity
    from openpendant.motion.scene.grasping import Grip

_FRAMES, _TOOLS = DocumentKind.FRAMES, DocumentKind.TOOLS
_POINTS_OF_AN_ANSWER = 800
_TOLD_AT_ONCE = 64
"""Frames that are told in the turn in which they are asked for; more are told in several."""

_ENTRIES_OF_A_PART = 50
"""Tools and frames that are told of so many that they are asked for in parts: one with the longest
names takes about 1 KB of the answer, and all of these a quarter of a millisecond."""

_PER_READ = 18.0  # µs on an ordinary machine: to read an object of a scene that is imported

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class _Change(Protocol):
    """A request that changes a document, from the revision that it names."""

    @property
    def expected_revision(self) -> int: ...


class SceneService:
    """Scene service of one cell.

    Attributes:
        planners: names of those that find ways around obstacles here.
    """

    def __init__(
        self,
        cell: RobotCell,
        world: PlanningScene,
        view: RobotEnvironment,
        grasps: Grasps,
        signals: CellSignals,
        trace: ToolTrace,
        robot_name: str,
    ) -> None:
        """Join what it asks."""
        self.planners = planners()
        self._cell = cell
        self._world = world
        self._view = view
        self._grasps = grasps
        self._signals = signals
        self._trace = trace
        self._robot_name = robot_name

    # Frames and tools.

    @handles(frames.ShowFrames)
    def _show_frames(
        self, asked: frames.ShowFrames, reply: ReplyTo[frames.Frames], now: int
    ) -> list[Effect]:
        if asked.first is not None:
            return self._show_part(asked.first, reply)
        world, tree = self._world, self._view.frames
        is_small = len(tree.frames) <= _TOLD_AT_ONCE
        told: frames.Frames = {
            "content": json.loads(frames_to_json(tree)) if is_small else {},
            "names": list(tree.frames),
            "frames_revision": world.revisions[_FRAMES],
            "tools_revision": world.revisions[_TOOLS],
            "problems": {str(k): v.sentence for k, v in world.problems.items()},
        }
        if is_small:
            return reply.answer(told)
        facts = {key: value for key, value in told.items() if key != "content"}
        return world.show_frames(facts, lambda text, _: reply.answer_text(text), now)

    def _show_part(self, first: int, reply: ReplyTo[frames.Frames]) -> list[Effect]:
        world = self._world
        content, total = part_of_frames(self._view.frames, first, _ENTRIES_OF_A_PART)
        if first and first >= total:
            text = f"frames.show.first: {first}; there are {total} tools and frames, from 0"
            limit = max(total - 1, 0)
            return reply.refuse(
                Refusal(VerdictCode.BAD_ARGUMENT, text, value=float(first), limit=float(limit))
            )
        following = first + _ENTRIES_OF_A_PART
        return reply.answer(
            {
                "content": content,
                "names": [each["name"] for each in (*content["tools"], *content["frames"])],
                "frames_revision": world.revisions[_FRAMES],
                "tools_revision": world.revisions[_TOOLS],
                "problems": {str(k): v.sentence for k, v in world.problems.items()},
                "total": total,
                "next": following if following < total else None,
            }
        )

    @handles(frames.TeachFrame)
    def _teach_frame(
        self, asked: frames.TeachFrame, reply: ReplyTo[frames.TaughtFrame], now: int
    ) -> list[Effect]:
        points = asked.points
        teach = frame_from_four_points if len(points) == 4 else frame_from_three_points
        taught = teach(*points)
        return reply.answer(
            {
                "pose": _found(taught.pose),
                "angle": taught.angle,
                "tilt_per_error": taught.tilt_per_error,
                "skew": taught.skew,
            }
        )

    @handles(frames.TransformPose)
    def _transform_pose(
        self, asked: frames.TransformPose, reply: ReplyTo[frames.TransformedPose], now: int
    ) -> list[Effect]:
        at = now - round(asked.seconds_ago * 1e9) if asked.seconds_ago else None
        found = self._world.history.transform(asked.source, asked.target, at)
        return reply.answer({"pose": _found(found.compose(pose_of(asked.pose)))})

    @handles(frames.AddFrame)
    def _add_frame(self, asked: frames.AddFrame, reply: ReplyTo[Changed], now: int) -> list[Effect]:
        return self._change_frames(
            _FRAMES,
            asked,
            reply,
            now,
            lambda tree: tree.add(asked.name, pose_of(asked.pose), asked.parent),
        )

    @handles(frames.MoveFrame)
    def _move_frame(
        self, asked: frames.MoveFrame, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_frames(
            _FRAMES,
            asked,
            reply,
            now,
            lambda tree: tree.move(asked.name, pose_of(asked.pose), asked.parent),
        )

    @handles(frames.RenameFrame)
    def _rename_frame(
        self, asked: frames.RenameFrame, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_frames(
            _FRAMES, asked, reply, now, lambda tree: tree.rename(asked.name, asked.new_name)
        )

    @handles(frames.RemoveFrame)
    def _remove_frame(
        self, asked: frames.RemoveFrame, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_frames(_FRAMES, asked, reply, now, lambda tree: tree.remove(asked.name))

    @handles(frames.ImportFrames)
    def _import_frames(
        self, asked: frames.ImportFrames, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._take_frames(_FRAMES, asked, reply, now, reading(_FRAMES, asked.content))

    @handles(FramesImport)
    def _import_read_frames(
        self, asked: FramesImport, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._take_frames(_FRAMES, asked, reply, now, _was_read(asked.read))

    @handles(frames.AddTool)
    def _add_tool(self, asked: frames.AddTool, reply: ReplyTo[Changed], now: int) -> list[Effect]:
        return self._change_frames(
            _TOOLS,
            asked,
            reply,
            now,
            lambda tree: tree.add_tool(asked.name, pose_of(asked.tcp), _grasp(asked.grasp)),
        )

    @handles(frames.MoveTool)
    def _move_tool(self, asked: frames.MoveTool, reply: ReplyTo[Changed], now: int) -> list[Effect]:
        return self._change_frames(
            _TOOLS,
            asked,
            reply,
            now,
            lambda tree: tree.move_tool(asked.name, pose_of(asked.tcp), _grasp(asked.grasp)),
        )

    @handles(frames.RemoveTool)
    def _remove_tool(
        self, asked: frames.RemoveTool, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_frames(_TOOLS, asked, reply, now, lambda tree: tree.remove(asked.name))

    @handles(frames.SelectTool)
    def _select_tool(
        self, asked: frames.SelectTool, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_frames(
            _TOOLS, asked, reply, now, lambda tree: tree.select_tool(asked.name)
        )

    @handles(frames.ImportTools)
    def _import_tools(
        self, asked: frames.ImportTools, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._take_frames(_TOOLS, asked, reply, now, reading(_TOOLS, asked.content))

    @handles(ToolsImport)
    def _import_read_tools(
        self, asked: ToolsImport, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._take_frames(_TOOLS, asked, reply, now, _was_read(asked.read))

    @handles(frames.CalibrateTool)
    def _calibrate_tool(
        self, asked: frames.CalibrateTool, reply: ReplyTo[frames.CalibratedTool], now: int
    ) -> list[Effect]:
        centre = tool_centre([self._view.flange(tuple(each)) for each in asked.positions])
        return reply.answer(
            {
                "position": centre.position.tolist(),
                "residuals": list(centre.residuals),
                "max_residual": centre.max_residual,
                "uncertainty": centre.uncertainty,
            }
        )

    def _change_frames(
        self,
        kind: DocumentKind,
        asked: _Change,
        reply: ReplyTo[Changed],
        now: int,
        change: FrameChange,
    ) -> list[Effect]:
        expected, told = asked.expected_revision, _revision(reply)
        by = reply.name
        changed = self._world.change_frames(kind, change, expected, by, now, told, reply.session)
        return reply.refuse(changed) if isinstance(changed, Refusal) else changed

    def _take_frames(
        self,
        kind: DocumentKind,
        asked: _Change,
        reply: ReplyTo[Changed],
        now: int,
        file: Stepwise[FramesFile],
    ) -> list[Effect]:
        expected, told = asked.expected_revision, _revision(reply)
        by = reply.name
        changed = self._world.import_frames(kind, file, expected, by, now, told, reply.session)
        return reply.refuse(changed) if isinstance(changed, Refusal) else changed

    # The scene.

    @handles(scene.ShowScene)
    def _show_scene(
        self, asked: scene.ShowScene, reply: ReplyTo[scene.Scene], now: int
    ) -> list[Effect]:
        return self._world.show_scene(lambda text, _: reply.answer_text(text), now)

    @handles(scene.NearestBodies)
    def _nearest_bodies(
        self, asked: scene.NearestBodies, reply: ReplyTo[scene.Nearest], now: int
    ) -> list[Effect]:
        position = self._cell.feedback.position
        if position is None:
            return reply.refuse(Refusal(VerdictCode.FEEDBACK_STALE))

        def told(found: Proximity | None, at: int) -> list[Effect]:
            if found is None:
                return reply.answer({"distance": None})
            return reply.answer(
                {
                    "distance": found.distance,
                    "first": found.first,
                    "second": found.second,
                    "first_point": found.first_point.tolist(),
                    "second_point": found.second_point.tolist(),
                }
            )

        return self._world.nearest(position, told, now)

    @handles(scene.AddObject)
    def _add_object(
        self, asked: scene.AddObject, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        content = {"schema": SCENE_SCHEMA, "objects": [asked.object]}
        (added,) = scene_from_json(json.dumps(content)).objects
        return self._change_scene(asked, reply, now, lambda before: before.add(added))

    @handles(scene.RemoveObject)
    def _remove_object(
        self, asked: scene.RemoveObject, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_scene(asked, reply, now, lambda before: before.remove(asked.name))

    @handles(scene.MoveObject)
    def _move_object(
        self, asked: scene.MoveObject, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_scene(
            asked, reply, now, lambda before: before.move(asked.name, pose_of(asked.pose))
        )

    @handles(scene.AllowContact)
    def _allow_contact(
        self, asked: scene.AllowContact, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_scene(
            asked, reply, now, lambda before: before.allow(asked.first, asked.second)
        )

    @handles(scene.ForbidContact)
    def _forbid_contact(
        self, asked: scene.ForbidContact, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        return self._change_scene(
            asked, reply, now, lambda before: before.forbid(asked.first, asked.second)
        )

    @handles(scene.AttachObject)
    def _attach_object(
        self, asked: scene.AttachObject, reply: ReplyTo[scene.Attached], now: int
    ) -> list[Effect]:
        def taken(grip: Grip, revision: int, at: int) -> list[Effect]:
            held = _found(grip.grasp)
            return reply.answer({"revision": revision, "distance": grip.distance, "grasp": held})

        def refused(why: Refusal, at: int) -> list[Effect]:
            return reply.refuse(why)

        edit = _edit(asked, reply)
        return self._grasps.take(asked.name, asked.link, edit, now, taken, refused)

    @handles(scene.DetachObject)
    def _detach_object(
        self, asked: scene.DetachObject, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        edit = _edit(asked, reply)
        return self._grasps.leave(asked.name, edit, now, _revision(reply))

    @handles(scene.ImportScene)
    def _import_scene(
        self, asked: scene.ImportScene, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        imported = scene_from_json(json.dumps(asked.content))
        spent = _PER_READ * len(imported.objects)
        return self._change_scene(asked, reply, now, lambda before: imported, spent)

    @handles(SceneImport)
    def _import_read_scene(
        self, asked: SceneImport, reply: ReplyTo[Changed], now: int
    ) -> list[Effect]:
        if isinstance(asked.read, Refusal):
            return reply.refuse(asked.read)
        expected, told = asked.expected_revision, _revision(reply)
        by, session = reply.name, reply.session
        changed = self._world.import_scene(asked.read, expected, by, now, told, session)
        return reply.refuse(changed) if isinstance(changed, Refusal) else changed

    def _change_scene(
        self,
        asked: _Change,
        reply: ReplyTo[Changed],
        now: int,
        change: SceneChange,
        spent: float = 0.0,
    ) -> list[Effect]:
        expected, told = asked.expected_revision, _revision(reply)
        by, session = reply.name, reply.session
        changed = self._world.change_scene(change, expected, by, now, told, session, spent=spent)
        return reply.refuse(changed) if isinstance(changed, Refusal) else changed

    # The trace of the tool.

    @handles(devices.ShowTrace)
    def _show_trace(
        self, asked: devices.ShowTrace, reply: ReplyTo[devices.Trace], now: int
    ) -> list[Effect]:
        points = self._trace.points
        end = asked.first + _POINTS_OF_AN_ANSWER
        shown = [list(point) for point in points[asked.first : end]]
        return reply.answer({"points": shown, "total": len(points)})

    @handles(devices.ClearTrace)
    def _clear_trace(
        self, asked: devices.ClearTrace, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        self._trace.clear()
        return reply.answer({})

    # The robot itself.

    @handles(devices.ListRobots)
    def _list_robots(
        self, asked: devices.ListRobots, reply: ReplyTo[devices.Robots], now: int
    ) -> list[Effect]:
        return reply.answer({"robots": list(robot_names()), "loaded": self._robot_name})

    @handles(devices.DescribeRobot)
    def _describe_robot(
        self, asked: devices.DescribeRobot, reply: ReplyTo[devices.RobotSpecification], now: int
    ) -> list[Effect]:
        if asked.name not in (None, self._robot_name):
            return reply.refuse(self._other_robot(asked.name))
        facts = dict(self._view.specification)
        if reply.version >= PROTOCOL_VERSION:
            facts["planners"] = list(self.planners)
        return reply.answer(cast(devices.RobotSpecification, facts))

    @handles(devices.LoadRobot)
    def _load_robot(
        self, asked: devices.LoadRobot, reply: ReplyTo[devices.LoadedRobot], now: int
    ) -> list[Effect]:
        if asked.name != self._robot_name:
            return reply.refuse(self._other_robot(asked.name))
        return reply.answer({"loaded": asked.name})

    def _other_robot(self, name: str | None) -> Refusal:
        text = f"this cell has {self._robot_name!r}"
        if name is not None and name not in (known := robot_names()):
            meant = nearest(name, known)
            hint = f"; did you mean {meant!r}?" if meant else ""
            text += f"; no robot is called {name!r}{hint}"
        return Refusal(VerdictCode.ROBOT_FIXED, text)

    # Signals.

    @handles(devices.ReadAllSignals)
    def _read_signals(
        self, asked: devices.ReadAllSignals, reply: ReplyTo[devices.SignalValues], now: int
    ) -> list[Effect]:
        return reply.answer(
            {
                "offered": self._signals.is_offered,
                "inputs": list(self._signals.inputs),
                "outputs": list(self._signals.outputs),
            }
        )

    @handles(devices.SetSignal)
    def _set_signal(self, asked: devices.SetSignal, reply: ReplyTo[Done], now: int) -> list[Effect]:
        def done(refusal: Refusal | None, at: int) -> list[Effect]:
            return reply.answer({}) if refusal is None else reply.refuse(refusal)

        asking = self._signals.set_output(asked.output, asked.value, now, done)
        return reply.refuse(asking) if isinstance(asking, Refusal) else asking


def pose_of(placed: AnyPose) -> Pose:
    """Return the pose that a request holds.

    Raises:
        MotionError: the quaternion is none.
    """
    return Pose.from_values(placed["position"], placed.get("orientation", _NO_ROTATION))


def _grasp(asked: frames.ToolGrasp | None) -> Grasp | None:
    """Return the grasp of a tool that a request holds; None for the default.

    Raises:
        MotionError: the point is too far off.
    """
    if asked is None:
        return None
    x, y, z = asked["point"]
    return Grasp((x, y, z), asked["reach"], asked["part"])


def _was_read(file: FramesFile) -> Stepwise[FramesFile]:
    yield 0.0
    return file


def _edit(asked: _Change, reply: ReplyTo[Any]) -> SceneEdit:
    return SceneEdit(asked.expected_revision, reply.name, reply.session)


def _revision(reply: ReplyTo[Changed]) -> Told:
    def told(revision: int | Refusal, now: int) -> list[Effect]:
        if isinstance(revision, Refusal):
            return reply.refuse(revision)
        return reply.answer({"revision": revision})

    return told


def _found(pose: Pose) -> FoundPose:
    return {"position": pose.position.tolist(), "orientation": pose.quaternion.tolist()}
