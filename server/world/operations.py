"""The management requests about frames, tools and scene, as JSON, and the table of all of a world.

Owns the fields of each request; what a request does is told by `desk`. Poses are position [m]
and quaternion x, y, z, w. Every change names the revision that it was made from.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from openpendant.motion.pose import Pose

from ..operation_body import OperationBody
from .device_operations import (
    ClearTrace,
    DescribeRobot,
    ListRobots,
    LoadRobot,
    ReadAllSignals,
    SetSignal,
    ShowTrace,
)

PREFIXES = ("frames.", "tools.", "scene.", "signals.", "robots.", "trace.")

Real = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Real, Real, Real]
Quaternion = tuple[Real, Real, Real, Real]
Revision = Annotated[int, Field(ge=0, description="the one that the change was made from")]


class PlacedPose(BaseModel):
    """A pose in some frame."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    position: Vector
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def pose(self) -> Pose:
        """Return it as a pose.

        Raises:
            MotionError: the quaternion is none.
        """
        return Pose.from_values(self.position, self.orientation)


class ShowFrames(OperationBody):
    """Asks for all frames and tools, which tool is selected, and the revisions."""

    op: Literal["frames.show"]


class AddFrame(OperationBody):
    """Adds a user frame."""

    op: Literal["frames.add"]
    name: str
    parent: str = "base"
    pose: PlacedPose
    expected_revision: Revision


class MoveFrame(OperationBody):
    """Puts a user frame elsewhere."""

    op: Literal["frames.move"]
    name: str
    parent: str | None = None
    pose: PlacedPose
    expected_revision: Revision


class RenameFrame(OperationBody):
    """Gives a user frame another name."""

    op: Literal["frames.rename"]
    name: str
    new_name: str
    expected_revision: Revision


class RemoveFrame(OperationBody):
    """Removes a user frame from which no other hangs."""

    op: Literal["frames.remove"]
    name: str
    expected_revision: Revision


class TeachFrame(OperationBody):
    """Asks for the frame of three points (origin, on x, on the side of y) or four.

    Keeps nothing: the frame found is added, where it is good, by `frames.add`.
    """

    op: Literal["frames.teach"]
    points: Annotated[tuple[Vector, ...], Field(min_length=3, max_length=4)]
    """In base, m."""


class TransformPose(OperationBody):
    """Asks where a pose of one frame is in another, now or at a time in the last ten seconds."""

    op: Literal["frames.transform"]
    source: str
    target: str
    pose: PlacedPose = PlacedPose(position=(0.0, 0.0, 0.0))
    seconds_ago: Annotated[float, Field(ge=0, le=10)] = 0.0


class ImportFrames(OperationBody):
    """Replaces user frames, or tools, by those of a file's content."""

    op: Literal["frames.import", "tools.import"]
    content: dict[str, Any]
    expected_revision: Revision


class AddTool(OperationBody):
    """Adds a tool: its centre point in the flange."""

    op: Literal["tools.add"]
    name: str
    tcp: PlacedPose
    expected_revision: Revision


class MoveTool(OperationBody):
    """Gives a tool another centre point."""

    op: Literal["tools.move"]
    name: str
    tcp: PlacedPose
    expected_revision: Revision


class RemoveTool(OperationBody):
    """Removes a tool that is not selected."""

    op: Literal["tools.remove"]
    name: str
    expected_revision: Revision


class SelectTool(OperationBody):
    """Selects a tool; null for the bare flange. In force once it is answered."""

    op: Literal["tools.select"]
    name: str | None
    expected_revision: Revision


class CalibrateTool(OperationBody):
    """Asks for the tool centre point from joint positions that touch one point; keeps nothing."""

    op: Literal["tools.calibrate"]
    positions: Annotated[tuple[tuple[Real, ...], ...], Field(min_length=4, max_length=20)]
    """Joints, controller side, rad or m; 4 to 20 positions, each compared with each other."""


class ShowScene(OperationBody):
    """Asks for the scene as a file's content, and its revision."""

    op: Literal["scene.show"]


class AddObject(OperationBody):
    """Adds an object, also while the robot moves."""

    op: Literal["scene.add"]
    object: dict[str, Any]
    """As in a scene file: name, shape, position, quaternion, frame."""
    expected_revision: Revision


class RemoveObject(OperationBody):
    """Removes an object."""

    op: Literal["scene.remove"]
    name: str
    expected_revision: Revision


class MoveObject(OperationBody):
    """Puts an object elsewhere in base."""

    op: Literal["scene.move"]
    name: str
    pose: PlacedPose
    expected_revision: Revision


class AllowContact(OperationBody):
    """Lets two bodies touch, or not any more."""

    op: Literal["scene.allow", "scene.forbid"]
    first: str
    second: str
    expected_revision: Revision


class AttachObject(OperationBody):
    """Lets a link take an object where both are now, or leaves it there."""

    op: Literal["scene.attach", "scene.detach"]
    name: str
    link: str | None = None
    """The link; the one that tools are bolted to where left out."""
    expected_revision: Revision


class ImportScene(OperationBody):
    """Replaces the scene by that of a file's content."""

    op: Literal["scene.import"]
    content: dict[str, Any]
    expected_revision: Revision


class NearestBodies(OperationBody):
    """Asks which two bodies are nearest to each other now, and how near."""

    op: Literal["scene.nearest"]


WorldOperation: TypeAlias = (
    ShowFrames
    | AddFrame
    | MoveFrame
    | RenameFrame
    | RemoveFrame
    | TeachFrame
    | TransformPose
    | ImportFrames
    | AddTool
    | MoveTool
    | RemoveTool
    | SelectTool
    | CalibrateTool
    | ShowScene
    | AddObject
    | RemoveObject
    | MoveObject
    | AllowContact
    | AttachObject
    | ImportScene
    | NearestBodies
    | ReadAllSignals
    | SetSignal
    | ListRobots
    | DescribeRobot
    | LoadRobot
    | ShowTrace
    | ClearTrace
)

WORLD_OPERATION: TypeAdapter[WorldOperation] = TypeAdapter(
    Annotated[WorldOperation, Field(discriminator="op")]
)
"""Reads the JSON of one of these requests."""
