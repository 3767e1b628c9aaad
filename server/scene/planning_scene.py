"""Planning scene of one cell: its stored frames, tools and objects, with revisions.

Owns when each may change and in which order a change takes effect. Frames and tools change only
while the robot is at rest, and only once they are on the disk, so that a published change is
always stored; until the store has acknowledged or refused it, no motion starts. An object that is
added to the scene counts at once, because it may be in the path. Knows no files; the mathematics
are behind `SceneModel`.

Owns which document of the store holds what: `frames` the user frames, `tools` the tools and which
is selected, `scene` the objects and the pairs that may touch; each is named after its cell.
`motion` owns what the values mean. Meshes are files of the server, so a document from outside must
not name one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from openpendant.motion.errors import FrameInUse, MotionError, SceneFileError
from openpendant.motion.frames.frame_file import frames_from_json, frames_to_json
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Mesh, Scene, left, taken
from openpendant.motion.scene.scene_file import scene_from_data, scene_to_data
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.execution.feedback import JointHistory, JointVector
from ..events.effects import Effect
from ..events.pending import AskStore
from ..planning.jobs import PoseGoal
from ..refusal import Refusal, refusal_of
from ..store.documents import Document, DocumentKind, Heading
from ..store.requests import Answer, Load, Save
from ..store.store_errors import NotFound, StoreError

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import Proximity


WORLD_KINDS = (DocumentKind.TOOLS, DocumentKind.FRAMES, DocumentKind.SCENE)
"""In the order in which they are read: a user frame may hang from a tool."""


def document_of(kind: DocumentKind, frames: FrameTree, scene: Scene) -> str:
    """Return the body of a document of the planning scene."""
    if kind is DocumentKind.SCENE:
        return json.dumps(scene_to_data(scene), ensure_ascii=False)
    whole = json.loads(frames_to_json(frames))
    if kind is DocumentKind.TOOLS:
        whole["frames"] = []
    else:
        whole["tools"], whole["selected_tool"] = [], None
    return json.dumps(whole, ensure_ascii=False)


def with_frames(kind: DocumentKind, body: str, tree: FrameTree) -> FrameTree:
    """Return a tree whose user frames, or tools, are those of a document.

    Args:
        kind: frames or tools; those that the tree has of the kind are replaced.

    Raises:
        MotionError: the document is none, or frames that stay hang from what goes.
    """
    selected = tree.selected_tool
    if kind is DocumentKind.TOOLS:
        bare = tree.select_tool(None)
        for tool in tree.tools:
            bare = bare.remove(tool.name)
        grown = frames_from_json(body, "tools", bare)
        return grown
    bare = tree
    for frame in reversed(tree.user_frames):
        bare = bare.remove(frame.name)
    grown = frames_from_json(body, "frames", bare)
    # A document of frames selects no tool, which is not to say that none is selected.
    return grown if grown.selected_tool == selected else grown.select_tool(selected)


def scene_from_json(body: str) -> Scene:
    """Return the scene of a document or of a file's text.

    Raises:
        MotionError: it is none, or has a mesh.
    """
    try:
        content = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise SceneFileError("scene", "", f"is not JSON: {error}"[:200]) from None
    if not isinstance(content, dict):
        raise SceneFileError("scene", "", "is not an object; accepted: one with a schema")
    scene = scene_from_data(content, "scene")
    for each in scene.objects:
        if isinstance(each.shape, Mesh):
            problem = "is a mesh; accepted: box, sphere, cylinder, capsule"
            raise SceneFileError("scene", f"object {each.name!r}", problem)
    return scene


class SceneModel(Protocol):
    """The robot's mathematics, as far as the planning scene needs them."""

    frames: FrameTree
    scene: Scene

    @property
    def flange_link(self) -> str:
        """Name of the link that tools are bolted to."""

    def apply_scene(self, frames: FrameTree, scene: Scene) -> None:
        """Put frames, tools and scene in force.

        Raises:
            MotionError: the scene does not fit the robot; all stays as it was.
        """

    def flange(self, position: JointVector) -> Pose:
        """Return the flange in the base frame at (n,) joints."""

    def link_pose(self, position: JointVector, link: str) -> Pose:
        """Return a link of the robot in the base frame at (n,) joints.

        Raises:
            FrameUnknown: there is no such link.
        """


class Ground(Protocol):
    """The cell, as far as the planning scene asks it and reports to it."""

    def show_scene(self, awaited: str, unread: str) -> None:
        """Take the reasons why no motion may start.

        Args:
            awaited: which frames and tools the store is asked about, in words; empty for none.
            unread: what the store keeps and could not be put in force, in words; empty for nothing.
        """

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""


class RobotEnvironment(SceneModel, Protocol):
    """The mathematics of one robot in its scene."""

    @property
    def specification(self) -> Mapping[str, Any]:
        """Limits, Denavit-Hartenberg table and home of the robot, as JSON can hold them."""

    @property
    def tool_in_flange(self) -> PoseGoal | None:
        """The centre point of the selected tool in the flange; None for the flange itself."""

    def nearest(self, position: Sequence[float]) -> Proximity | None:
        """Return the nearest two bodies at (n,) joints; None where there is nothing to check."""

    def is_surely_free(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Return True if a straight move between (n,) joints surely touches nothing in the scene.

        Takes about 1 ms at most; False means only that the full check is needed.
        """

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""


Told: TypeAlias = Callable[[int | Refusal, int], list[Effect]]
"""Takes the new revision of a document, or why it was not changed, and the time."""

FrameChange: TypeAlias = Callable[[FrameTree], FrameTree]
SceneChange: TypeAlias = Callable[[Scene], Scene]
Watcher: TypeAlias = Callable[[Scene, int], list[Effect]]
"""Takes the changed scene, and the time."""

_IN_ONE_TREE = (DocumentKind.FRAMES, DocumentKind.TOOLS)
"""Kinds that share one frame tree: a saved change of one puts the other in force as it was."""


class PlanningScene:
    """Frames, tools and scene of one cell.

    Attributes:
        revisions: of the document of each kind; 0 where there is none yet.
        problems: documents that could not be read, by kind; what they hold is not in force.
        history: poses of the frames in the last seconds.
    """

    def __init__(
        self, name: str, view: SceneModel, ground: Ground, ask: AskStore, watcher: Watcher
    ) -> None:
        """Make a scene with the robot's own frames and no objects."""
        self.revisions = dict.fromkeys(WORLD_KINDS, 0)
        self.problems: dict[DocumentKind, Refusal] = {}
        self.history = JointHistory(view.flange, view.frames)
        self._name = name
        self._view = view
        self._ground = ground
        self._ask = ask
        self._watcher = watcher
        self._saving: set[DocumentKind] = set()
        self._reading: list[DocumentKind] = []

    @property
    def frames(self) -> FrameTree:
        """The named frames and tools in force."""
        return self._view.frames

    @property
    def scene(self) -> Scene:
        """The objects in force."""
        return self._view.scene

    # From the store.

    def load(self) -> list[Effect]:
        """Have the documents of the cell read, one after the other."""
        self._reading = list(WORLD_KINDS)
        return self._load_next()

    def _load_next(self) -> list[Effect]:
        self._tell_cell()
        if not self._reading:
            return []
        kind = self._reading[0]

        def loaded(answer: Answer, now: int) -> list[Effect]:
            del self._reading[0]
            out = self._take_document(kind, answer, now)
            return out + self._load_next()

        return self._ask(Load(kind, self._name), loaded)

    def _take_document(self, kind: DocumentKind, answer: Answer, now: int) -> list[Effect]:
        if isinstance(answer, NotFound):
            return []
        if isinstance(answer, StoreError):
            self.problems[kind] = answer.refusal()
            return []
        if not isinstance(answer, Document):
            return []
        self.revisions[kind] = answer.heading.revision
        try:
            if kind is DocumentKind.SCENE:
                return self._stand(self.frames, scene_from_json(answer.body), now)
            return self._stand(with_frames(kind, answer.body, self.frames), self.scene, now)
        except MotionError as error:
            self.problems[kind] = refusal_of(error)
            return []

    # Changes.

    def change_frames(
        self, kind: DocumentKind, change: FrameChange, expected: int, author: str, told: Told
    ) -> Refusal | list[Effect]:
        """Change user frames or tools while the robot is at rest; in force once it is saved.

        Args:
            kind: frames or tools.
            expected: revision of the document that the change was made from.
            told: called with the new revision, or why it was not saved.
        """
        refusal = self._not_now(kind) or self._stale(kind, expected)
        if refusal is not None:
            return refusal
        try:
            tree = change(self.frames)
            self._check_apart(kind, tree)
        except MotionError as error:
            return refusal_of(error)

        def saved(answer: Answer, now: int) -> list[Effect]:
            refused = self._saved(kind, answer)
            if refused is not None:
                return told(refused, now)
            out = self._stand(tree, self.scene, now)
            return out + told(self.revisions[kind], now)

        return self._save(kind, tree, self.scene, author, saved)

    def change_scene(
        self, change: SceneChange, expected: int, author: str, now: int, told: Told
    ) -> Refusal | list[Effect]:
        """Change the scene; while the robot moves, objects may only be added to it.

        Added objects are in force at once, and after a restart once they are saved.
        """
        refusal = self._stale(DocumentKind.SCENE, expected)
        if refusal is not None:
            return refusal
        before = self.scene
        try:
            scene = change(before)
            if not _only_adds(before, scene):
                refusal = self._not_now(DocumentKind.SCENE)
                if refusal is not None:
                    return refusal
            out = self._stand(self.frames, scene, now)
        except MotionError as error:
            return refusal_of(error)

        def saved(answer: Answer, at: int) -> list[Effect]:
            refused = self._saved(DocumentKind.SCENE, answer)
            if refused is None:
                return told(self.revisions[DocumentKind.SCENE], at)
            text = f"in force until the server ends, but not kept: {refused.sentence}"
            return told(Refusal(refused.code, text, value=refused.value, limit=refused.limit), at)

        return out + self._save(DocumentKind.SCENE, self.frames, scene, author, saved)

    def carry(self, name: str, at: JointVector, now: int) -> Refusal | list[Effect]:
        """Attach an object to the flange's link where it is, for a program.

        The document of the scene is not changed: a restart puts each object where it was taught.
        """
        link = self._view.flange_link
        pose = self._view.link_pose(at, link)
        return self._in_passing(lambda scene: taken(scene, name, link, pose), now)

    def put_down(self, name: str, at: JointVector, now: int) -> Refusal | list[Effect]:
        """Detach a carried object where it is, for a program."""
        view = self._view

        def changed(scene: Scene) -> Scene:
            return left(scene, name, view.flange_link, lambda link: view.link_pose(at, link))

        return self._in_passing(changed, now)

    def _in_passing(self, change: SceneChange, now: int) -> Refusal | list[Effect]:
        try:
            return self._stand(self.frames, change(self.scene), now)
        except MotionError as error:
            return refusal_of(error)

    def _stand(self, frames: FrameTree, scene: Scene, now: int) -> list[Effect]:
        """Put frames and scene in force."""
        changed = scene != self.scene
        new_frames = frames is not self.frames
        self._view.apply_scene(frames, scene)
        if new_frames:
            self.history.define(now, frames)
        return self._watcher(scene, now) if changed else []

    def _save(
        self,
        kind: DocumentKind,
        frames: FrameTree,
        scene: Scene,
        author: str,
        saved: Callable[[Answer, int], list[Effect]],
    ) -> list[Effect]:
        self._saving.add(kind)
        self._tell_cell()
        body = document_of(kind, frames, scene)
        return self._ask(Save(kind, self._name, body, self.revisions[kind], author), saved)

    def _saved(self, kind: DocumentKind, answer: Answer) -> Refusal | None:
        self._saving.discard(kind)
        if isinstance(answer, Heading):
            self.revisions[kind] = answer.revision
            self.problems.pop(kind, None)
        self._tell_cell()
        if isinstance(answer, Heading):
            return None
        if isinstance(answer, StoreError):
            return answer.refusal()
        text = f"the store answered with a {type(answer).__name__}"
        return Refusal(VerdictCode.STORE_FAILED, text)

    def _tell_cell(self) -> None:
        """Report to the cell what is being saved and what is unreadable; either blocks motion."""
        texts = [
            f"what is kept as {kind} is not in force: {problem.sentence};"
            f" accepted: motion once a change of the {kind} is saved"
            for kind, problem in self.problems.items()
            if self.revisions[kind]  # else the store could not even say that there is any
        ]
        awaited = self._being_read() or self._being_saved(_IN_ONE_TREE)
        self._ground.show_scene(awaited, "; ".join(texts))

    def _being_read(self) -> str:
        return f"what is kept as {', '.join(self._reading)} is being read" if self._reading else ""

    def _being_saved(self, kinds: tuple[DocumentKind, ...]) -> str:
        """Return which of some kinds is being saved, in words; empty for none."""
        found = next((kind for kind in kinds if kind in self._saving), None)
        return "" if found is None else f"a change of the {found} is being saved"

    # Rules.

    def _not_now(self, kind: DocumentKind) -> Refusal | None:
        busy = self._ground.under_way()
        if not busy:
            return None
        return Refusal(VerdictCode.CHANGE_WHILE_MOVING, f"{kind.value}: {busy}")

    def _stale(self, kind: DocumentKind, expected: int) -> Refusal | None:
        """Return why a change does not fit the kept revision; names both revisions."""
        together = _IN_ONE_TREE if kind in _IN_ONE_TREE else (kind,)
        busy = self._being_read() or self._being_saved(together)
        if busy:
            return Refusal(VerdictCode.STORE_BUSY, f"not changed while {busy}")
        current = self.revisions[kind]
        if expected == current:
            return None
        text = f"{kind.value}: the change was made from revision {expected}, kept is {current}"
        return Refusal(VerdictCode.REVISION_CONFLICT, text, value=current, limit=expected)

    def _check_apart(self, kind: DocumentKind, tree: FrameTree) -> None:
        """Refuse a change of one document that would change the other, too.

        Raises:
            FrameInUse: a tool was changed from which user frames hang.
        """
        other = DocumentKind.FRAMES if kind is DocumentKind.TOOLS else DocumentKind.TOOLS
        before = document_of(other, self.frames, self.scene)
        if document_of(other, tree, self.scene) != before:
            hanging = tuple(frame.name for frame in self.frames.user_frames)
            raise FrameInUse("tool", hanging)


def _only_adds(before: Scene, after: Scene) -> bool:
    """Return True if a change only adds objects and leaves objects and pairs as they are."""
    kept = after.objects[: len(before.objects)] == before.objects
    return kept and after.allowed == before.allowed
