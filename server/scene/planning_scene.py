"""Planning scene of one cell: its stored frames, tools and objects, with revisions.

Owns when each may change and in which order a change takes effect. Frames and tools change only
while the robot is at rest, and only once they are on the disk, so that a published change is
always stored; until the store has acknowledged or refused it, no motion starts. An object that is
added to the scene counts at once, because it may be in the path. Knows no files; the mathematics
are behind `SceneModel`.

Owns how a scene comes into force. It is built beside the one in force, in steps of about a
millisecond, one turn of them in a tick; then it takes that one's place and is saved. One is built
at a time. What a program takes or puts down waits for its turn; any other change is refused
meanwhile. A scene of few objects is built, and in force, before the request returns: the steps are
counted by their effort, not timed, so that a journal that is run again has the same turns. So are
those in which a document of the store, or one that a planning process has read for a client,
becomes a scene or frames.

Objects that are added count for whatever is planned as soon as it is known that they fit, and a
motion under way is checked against them from then on (promise 17). Until their model is in force
no jog begins, as it would not see them, and no way is taken for free without the planning process.
After any other change no motion begins until it is in force.

Owns which document of the store holds what: `frames` the user frames, `tools` the tools and which
is selected, `scene` the objects and the pairs that may touch; each is named after its cell.
`document_reading` owns what may stand in them.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from openpendant.motion.errors import FrameInUse, MotionError
from openpendant.motion.frames.frame_file import FramesFile, read_frames
from openpendant.motion.frames.frame_tree import FLANGE, FrameTree
from openpendant.motion.scene.scene import Scene, left
from openpendant.motion.scene.scene_transfer import SceneInTransfer
from openpendant.motion.steps import Stepwise
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.execution.feedback import JointHistory, JointVector
from ..events.effects import Effect
from ..events.pending import Pending, Steps
from ..refusal import Refusal, refusal_of
from ..store.documents import Document, DocumentKind, Heading
from ..store.requests import Answer, Load, Save
from ..store.store_errors import NotFound, StoreError
from .building_turns import Turns, dropped, until_it_fits
from .document_reading import placed, scene_of
from .document_texts import COMPACT, FramesText, SceneText, joined
from .robot_environment import FrameChange, Ground, InForce, SceneChange, SceneModel, Told, Watcher

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import BuildStep, Proximity


_Made = TypeVar("_Made")

WORLD_KINDS = (DocumentKind.TOOLS, DocumentKind.FRAMES, DocumentKind.SCENE)
"""In the order in which they are read: a user frame may hang from a tool."""


class _Building(NamedTuple):
    """A change of the scene that is being built.

    Attributes:
        scene: what it leads to.
        only_adds: it leaves objects and pairs as they are.
    """

    scene: Scene
    only_adds: bool


class _KeptFrames(NamedTuple):
    """Frames and tools that are ready to be put in force, and the body of their document."""

    tree: FrameTree
    body: str


_SWAP = 800.0  # µs: to put in force what is built, and to have it saved
_PER_OBJECT = 0.3  # µs: to make a scene of another
_PER_ALLOWED = 0.2  # µs
_PER_FRAME = 1.3  # µs: to make a tree of another, and to compare the two

_BUILT = "a change of the scene is being put in force"

_IN_ONE_TREE = (DocumentKind.FRAMES, DocumentKind.TOOLS)
"""Kinds that share one frame tree: a saved change of one puts the other in force as it was."""


class PlanningScene:
    """Frames, tools and scene of one cell.

    Attributes:
        revisions: of the document of each kind; 0 where there is none yet.
        problems: documents that could not be read, by kind; what they hold is not in force.
        history: poses of the frames in the last seconds.
        handed_over: how often a program took an object or put one down. The revision, which is that
            of the document, stays the same with it.
    """

    def __init__(
        self, name: str, view: SceneModel, ground: Ground, pending: Pending, watcher: Watcher
    ) -> None:
        """Make a scene with the robot's own frames and no objects."""
        self.revisions = dict.fromkeys(WORLD_KINDS, 0)
        self.problems: dict[DocumentKind, Refusal] = {}
        self.history = JointHistory(view.flange, view.frames)
        self.handed_over = 0
        self._name = name
        self._view = view
        self._ground = ground
        self._pending = pending
        self._watcher = watcher
        self._saving: set[DocumentKind] = set()
        self._reading: list[DocumentKind] = []
        self._building: _Building | None = None
        self._waiting: deque[Callable[[int], list[Effect]]] = deque()
        self._scene_text, self._shown_scene = SceneText(), SceneText(COMPACT)
        self._frames_text, self._shown_frames = FramesText(), FramesText(COMPACT)
        self._body = ""  # of the scene that was built last

    @property
    def frames(self) -> FrameTree:
        """The named frames and tools in force."""
        return self._view.frames

    @property
    def scene(self) -> Scene:
        """The objects in force."""
        return self._view.scene

    @property
    def is_busy(self) -> bool:
        """Whether something is being read, built or saved."""
        return bool(self._reading or self._building or self._saving)

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

        def put_in_force(refusal: Refusal | None, now: int) -> list[Effect]:
            if refusal is not None:
                self.problems[kind] = refusal
            del self._reading[0]
            return self._load_next()

        def loaded(answer: Answer, now: int) -> list[Effect]:
            return self._take_document(kind, answer, put_in_force, now)

        return self._pending.ask(Load(kind, self._name), loaded)

    def _take_document(
        self, kind: DocumentKind, answer: Answer, then: InForce, now: int
    ) -> list[Effect]:
        if isinstance(answer, NotFound):
            return then(None, now)
        if isinstance(answer, StoreError):
            return then(answer.refusal(), now)
        if not isinstance(answer, Document):
            return then(None, now)
        self.revisions[kind] = answer.heading.revision
        if kind is DocumentKind.SCENE:
            return self._take_scene(answer.body, then, now)

        def read(found: FrameTree | Refusal, at: int) -> list[Effect]:
            if isinstance(found, Refusal):
                return then(found, at)
            self._stand(found, at)
            return then(None, at)

        return self._pending.run(Turns().find(self._tree_in(kind, answer.body)), read, now)

    def _take_scene(self, body: str, then: InForce, now: int) -> list[Effect]:
        turns = Turns()

        def read(found: Scene | Refusal, at: int) -> list[Effect]:
            if isinstance(found, Refusal):
                return then(found, at)
            return self._build(found, at, then, turns)

        return self._pending.run(turns.find(scene_of(body)), read, now)

    def _tree_in(self, kind: DocumentKind, body: str) -> Stepwise[FrameTree]:
        """Read a stored document of frames or tools, and make the tree ready for planning."""
        read = yield from read_frames(body, kind.value)
        tree = yield from placed(kind, read, self.frames)
        yield from tree.pickle_steps(self.frames)
        return tree

    # Changes.

    def change_frames(
        self,
        kind: DocumentKind,
        change: FrameChange,
        expected: int,
        author: str,
        now: int,
        told: Told,
        session: int = 0,
    ) -> Refusal | list[Effect]:
        """Change user frames or tools while the robot is at rest; in force once it is saved.

        Args:
            kind: frames or tools.
            expected: revision of the document that the change was made from.
            told: called with the new revision, or why it was not saved.
            session: connection of the author, 0 for the server.
        """
        refusal = self._not_now(kind) or self._stale(kind, expected)
        if refusal is not None:
            return refusal
        try:
            tree = change(self.frames)
            self._check_apart(kind, tree)
        except MotionError as error:
            return refusal_of(error)
        turns = Turns(_PER_FRAME * len(tree.frames))
        kept = self._kept(kind, tree)
        return self._keep_frames(kind, kept, turns, (author, session), now, told)

    def import_frames(
        self,
        kind: DocumentKind,
        reading: Stepwise[FramesFile],
        expected: int,
        author: str,
        now: int,
        told: Told,
        session: int = 0,
    ) -> Refusal | list[Effect]:
        """Replace user frames or tools by those of a file, in steps.

        Args:
            kind: frames or tools, as for `change_frames`; so are the others.
            reading: reads the file.
            session: connection of the author, 0 for the server.
        """
        refusal = self._not_now(kind) or self._stale(kind, expected)
        if refusal is not None:
            return refusal
        steps = self._imported(kind, reading)
        return self._keep_frames(kind, steps, Turns(), (author, session), now, told)

    def _imported(self, kind: DocumentKind, reading: Stepwise[FramesFile]) -> Stepwise[_KeptFrames]:
        read = yield from reading
        tree = yield from placed(kind, read, self.frames)
        yield _PER_FRAME * len(tree.frames)
        self._check_apart(kind, tree)
        return (yield from self._kept(kind, tree))

    def _kept(self, kind: DocumentKind, tree: FrameTree) -> Stepwise[_KeptFrames]:
        """Make frames ready for planning, and the text of a document of them."""
        yield from tree.pickle_steps(self.frames)
        is_tools = kind is DocumentKind.TOOLS
        body = yield from self._frames_text.steps(tree, frames=not is_tools, tools=is_tools)
        return _KeptFrames(tree, body)

    def _keep_frames(
        self,
        kind: DocumentKind,
        steps: Stepwise[_KeptFrames],
        turns: Turns,
        by: tuple[str, int],
        now: int,
        told: Told,
    ) -> list[Effect]:
        """Make frames that are to be kept, save them, and put them in force.

        Args:
            by: name of the author, and its connection.
        """

        def made(found: _KeptFrames | Refusal, at: int) -> list[Effect]:
            if isinstance(found, Refusal):
                self._saving.discard(kind)
                self._tell_cell()
                return told(found, at)
            tree, body = found

            def saved(answer: Answer, kept_at: int) -> list[Effect]:
                refused = self._saved(kind, answer)
                if refused is not None:
                    return told(refused, kept_at)
                self._stand(tree, kept_at)
                return told(self.revisions[kind], kept_at)

            return self._save(kind, body, *by, saved)

        # From now on: nobody may change what the tree is made from, and no motion may begin.
        self._saving.add(kind)
        self._tell_cell()
        return self._pending.run(turns.find(steps), made, now)

    def change_scene(
        self,
        change: SceneChange,
        expected: int,
        author: str,
        now: int,
        told: Told,
        session: int = 0,
        *,
        spent: float = 0.0,
    ) -> Refusal | list[Effect]:
        """Change the scene; while the robot moves, objects may only be added to it.

        It is in force once it is built, and after a restart once it is saved, too.

        Args:
            spent: what whoever asks has done in this turn already [µs].
        """
        refusal = self._stale(DocumentKind.SCENE, expected)
        if refusal is not None:
            return refusal
        before = self.scene
        try:
            scene = change(before)
            # One object, or as many as a small body names.
            spent += sum(self._view.held_steps(before, scene))
        except MotionError as error:
            return refusal_of(error)
        refusal = self._unfit_now(before, scene)
        if refusal is not None:
            return refusal
        # That the scene was made belongs to the first turn, too.
        spent += _PER_OBJECT * len(scene.objects) + _PER_ALLOWED * len(scene.allowed)
        turns = Turns(spent)
        return self._build(
            scene, now, self._saves_scene(author, session, told), turns, is_kept=True
        )

    def import_scene(
        self,
        arriving: SceneInTransfer,
        expected: int,
        author: str,
        now: int,
        told: Told,
        session: int = 0,
    ) -> Refusal | list[Effect]:
        """Replace the scene by one that a planning process has read; else as `change_scene`.

        While it is not known yet whether it only adds, no motion begins, and one that is under way
        counts as unchecked.
        """
        refusal = self._stale(DocumentKind.SCENE, expected)
        if refusal is not None:
            return refusal
        before, turns = self.scene, Turns()
        has_arrived = is_announced = False

        then = self._saves_scene(author, session, told)

        def arrived(scene: Scene | Refusal, at: int) -> list[Effect]:
            nonlocal has_arrived
            has_arrived = True
            if isinstance(scene, Refusal):
                refused: Refusal | None = scene
            else:
                refused = self._unfit_now(before, scene)
                if refused is None:
                    announced = now if is_announced else None
                    return self._build(scene, at, then, turns, is_kept=True, announced=announced)
            out = self._watcher.planned_in(before, at, at) if is_announced else []
            return out + self._end_building(refused, then, at)

        self._building = _Building(before, only_adds=False)
        self._tell_cell()
        out = self._pending.run(turns.find(self._in_reach(arriving, before)), arrived, now)
        if not has_arrived:
            is_announced = True
            out += self._watcher.announced(now)
        return out

    def _unfit_now(self, before: Scene, after: Scene) -> Refusal | None:
        """Return why a scene may not take the place of another while the robot moves."""
        return None if _only_adds(before, after) else self._not_now(DocumentKind.SCENE)

    def _in_reach(self, arriving: SceneInTransfer, before: Scene) -> Stepwise[Scene]:
        scene = yield from arriving.arrived(before)
        yield from self._view.held_steps(before, scene)
        return scene

    def _saves_scene(self, author: str, session: int, told: Told) -> InForce:
        """Return what saves the scene that was built last, once it is in force."""

        def saved(answer: Answer, at: int) -> list[Effect]:
            refused = self._saved(DocumentKind.SCENE, answer)
            if refused is None:
                return told(self.revisions[DocumentKind.SCENE], at)
            text = f"in force until the server ends, but not kept: {refused.sentence}"
            return told(Refusal(refused.code, text, value=refused.value, limit=refused.limit), at)

        def put_in_force(refused: Refusal | None, at: int) -> list[Effect]:
            if refused is not None:
                return told(refused, at)
            return self._save(DocumentKind.SCENE, self._body, author, session, saved)

        return put_in_force

    def carry(self, name: str, at: JointVector, now: int, then: InForce) -> list[Effect]:
        """Let the selected tool take an object within its reach, for a program.

        The document of the scene is not changed: a restart puts each object where it was taught.

        Args:
            at: (n,) joints; of the robot now, which stands until `then` is called.
        """
        return self._in_passing(
            lambda scene: self._view.gripped(scene, name, at, None).scene, now, then
        )

    def put_down(self, name: str, at: JointVector, now: int, then: InForce) -> list[Effect]:
        """Detach a carried object where it is, for a program; arguments as of `carry`."""
        view = self._view

        def changed(scene: Scene) -> Scene:
            return left(scene, name, view.flange_link, lambda link: view.link_pose(at, link))

        return self._in_passing(changed, now, then)

    def _in_passing(self, change: SceneChange, now: int, then: InForce) -> list[Effect]:
        def begin(at: int) -> list[Effect]:
            try:
                scene = change(self.scene)
            except MotionError as error:
                return then(refusal_of(error), at)
            spent = _PER_OBJECT * len(scene.objects) + _PER_ALLOWED * len(scene.allowed)
            return self._build(scene, at, built, Turns(spent))

        def built(refused: Refusal | None, at: int) -> list[Effect]:
            self.handed_over += refused is None
            return then(refused, at)

        if self._building is not None:
            self._waiting.append(begin)
            return []
        return begin(now)

    # Questions.

    def nearest(
        self,
        position: Sequence[float],
        then: Callable[[Proximity | None, int], list[Effect]],
        now: int,
    ) -> list[Effect]:
        """Find the nearest two bodies at (n,) joints in the scene in force, in as many turns."""
        return self._pending.run(Turns().take(self._view.nearest_steps(position)), then, now)

    def show_scene(self, then: Callable[[str, int], list[Effect]], now: int) -> list[Effect]:
        """Tell the scene in force with its revision, as the JSON of a reply, in as many turns."""
        scene, revision = self.scene, self.revisions[DocumentKind.SCENE]

        def made(content: str, at: int) -> list[Effect]:
            return then(joined({"content": content, "revision": str(revision)}, COMPACT), at)

        return self._pending.run(Turns().make(self._shown_scene.steps(scene)), made, now)

    def show_frames(
        self, facts: Mapping[str, Any], then: Callable[[str, int], list[Effect]], now: int
    ) -> list[Effect]:
        """Tell frames and tools in force as the JSON of a reply, in as many turns.

        Args:
            facts: what is told beside their content, by its key.
        """

        def made(content: str, at: int) -> list[Effect]:
            rest = {
                key: json.dumps(value, ensure_ascii=False, separators=COMPACT)
                for key, value in facts.items()
            }
            return then(joined({"content": content, **rest}, COMPACT), at)

        return self._pending.run(Turns().make(self._shown_frames.steps(self.frames)), made, now)

    # To put something in force.

    def _stand(self, frames: FrameTree, now: int) -> None:
        """Put frames in force."""
        self._view.apply_scene(frames, self._view.built)
        self.history.define(now, frames)

    def _build(
        self,
        scene: Scene,
        now: int,
        then: InForce,
        turns: Turns,
        *,
        is_kept: bool = False,
        announced: int | None = None,
    ) -> list[Effect]:
        """Build a scene, and put it in force.

        Args:
            then: called once it is in force, or will not be.
            turns: with what was spent already of the first.
            is_kept: it will be saved, so that its text is made, too.
            announced: when the watcher was told already that something comes [ns].
        """
        before = self.scene
        building = _Building(scene, _only_adds(before, scene))
        self._building = building
        self._tell_cell()
        asked = now if announced is None else announced
        is_announced = announced is not None
        steps = self._view.scene_steps(scene)

        def built(found: Any, at: int) -> list[Effect]:
            if isinstance(found, Refusal):
                # What was planned around meanwhile is not there.
                out = self._watcher.planned_in(before, at, at) if building.only_adds else []
                return out + self._end_building(found, then, at)
            return self._put_in_force(building, found, at) + self._end_building(None, then, at)

        def fitting(refused: Refusal | None, at: int) -> list[Effect]:
            nonlocal is_announced
            was_announced, is_announced = is_announced, True
            if refused is not None:
                out: list[Effect] = (
                    self._watcher.planned_in(before, at, at) if was_announced else []
                )
                return out + self._end_building(refused, then, at)
            out = []
            if building.only_adds and (scene != before or was_announced):
                self._watcher.seen(is_whole=False)
                out += self._watcher.planned_in(scene, at, asked)
            made = self._made(steps, turns, scene if is_kept else None)
            return out + self._pending.run(made, built, at)

        out = self._pending.run(until_it_fits(scene, before, steps, turns), fitting, now)
        if building.only_adds and not is_announced:
            is_announced = True
            out += self._watcher.announced(now)
        return out

    def _made(
        self, steps: Generator[BuildStep, None, Any], turns: Turns, kept: Scene | None
    ) -> Steps[Any]:
        """Make a scene that fits, and the text of one to be kept; return why it cannot be made."""
        try:
            found = yield from turns.take(steps)
        except MotionError as error:
            return refusal_of(error)
        if kept is not None:
            self._body = yield from turns.make(self._scene_text.steps(kept))
        yield from turns.spend(_SWAP)
        return found

    def _put_in_force(self, building: _Building, built: Any, now: int) -> list[Effect]:
        before = self._view.built
        is_changed = building.scene != self.scene
        self._view.apply_scene(self.frames, built)
        out = [] if before is built else self._pending.run(dropped(before), _nothing, now)
        if not is_changed or building.only_adds:
            return out
        return out + self._watcher.planned_in(building.scene, now, now)

    def _end_building(self, refused: Refusal | None, then: InForce, now: int) -> list[Effect]:
        self._building = None
        self._watcher.seen(is_whole=True)
        self._tell_cell()
        out = then(refused, now)
        while self._waiting and self._building is None:
            out += self._waiting.popleft()(now)
        return out

    def _save(
        self,
        kind: DocumentKind,
        body: str,
        author: str,
        session: int,
        saved: Callable[[Answer, int], list[Effect]],
    ) -> list[Effect]:
        self._saving.add(kind)
        self._tell_cell()
        save = Save(kind, self._name, body, self.revisions[kind], author, session)
        return self._pending.ask(save, saved)

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
        building = self._building
        awaited = self._being_read() or self._being_saved(_IN_ONE_TREE)
        unbuilt = ""
        if building is not None and building.only_adds:
            unbuilt = _BUILT
        elif building is not None:
            awaited = awaited or _BUILT
        self._ground.show_scene(awaited, "; ".join(texts), unbuilt)

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
        if not busy and kind is DocumentKind.SCENE and self._building is not None:
            busy = _BUILT
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
        if _of_the_other(kind, tree) != _of_the_other(kind, self.frames):
            hanging = tuple(frame.name for frame in self.frames.user_frames)
            raise FrameInUse("tool", hanging)


def _of_the_other(kind: DocumentKind, tree: FrameTree) -> list[object]:
    """Return what the document of the other kind says; a pose that stays is the same object."""
    has_tools = kind is DocumentKind.FRAMES
    own = [each for each in tree.frames.values() if not each.predefined]
    said: list[object] = [tree.selected_tool] if has_tools else []
    said += [
        (each.name, each.parent, id(each.pose), each.grasp)
        for each in own
        if (each.parent == FLANGE) is has_tools
    ]
    return said


def _nothing(_: object, now: int) -> list[Effect]:
    return []


def _only_adds(before: Scene, after: Scene) -> bool:
    """Return True if a change only adds objects and leaves objects and pairs as they are."""
    kept = after.objects[: len(before.objects)] == before.objects
    return kept and after.allowed == before.allowed
