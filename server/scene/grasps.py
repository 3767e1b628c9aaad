"""Grasps of one cell: what its robot takes and leaves, for pendants and for programs.

Owns what is demanded before an object changes hands: the joints as reported just now, and a robot
at rest. Owns the emulated part sensor of the selected tool: an input of the controller that is 1
after a grasp, 0 after one that missed and after letting go. `planning_scene` owns how the scene
changes, and `motion.scene.grasping` what is within reach.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from openpendant.motion.scene.scene import Scene, left
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.execution.feedback import JointVector
from ..cell.robot_cell import RobotCell
from ..events.effects import Effect, LogLine
from ..refusal import Refusal
from .planning_scene import PlanningScene
from .robot_environment import SceneChange, SceneModel, Told
from .signals import CellSignals

if TYPE_CHECKING:
    from openpendant.motion.scene.grasping import Grip

_MEASURED = 250.0  # µs on an ordinary machine: where the tool is, and how far from the object

GripTold: TypeAlias = Callable[["Grip", int, int], list[Effect]]
"""Takes how an object is held, the new revision of the scene, and the time."""

RefusalTold: TypeAlias = Callable[[Refusal, int], list[Effect]]
"""Takes why an object was not taken, and the time."""

Rearranged: TypeAlias = Callable[[Refusal | None], None]
"""Takes why an object was not taken or left, None where it was; called once."""


class SceneEdit(NamedTuple):
    """From which revision of the scene somebody changes it, and who."""

    expected: int
    author: str
    session: int


class Grasps:
    """Grasps of one cell."""

    def __init__(
        self, cell: RobotCell, view: SceneModel, world: PlanningScene, signals: CellSignals
    ) -> None:
        """Join what it asks."""
        self._cell = cell
        self._view = view
        self._world = world
        self._signals = signals

    # For a pendant: the scene is saved.

    def take(
        self,
        name: str,
        link: str | None,
        edit: SceneEdit,
        now: int,
        taken: GripTold,
        refused: RefusalTold,
    ) -> list[Effect]:
        """Let a link take an object within reach.

        Args:
            link: None for that of the selected tool.
            taken: called once the scene is kept.
            refused: called with the reason where it is not.
        """
        at = self._standing_at(now, self._cell.under_way())
        if isinstance(at, Refusal):
            return refused(at, now)
        part = self._part if link in (None, self._view.flange_link) else None
        found: list[Grip] = []

        def changed(before: Scene) -> Scene:
            found.append(self._view.gripped(before, name, at, link))
            return found[0].scene

        def told(revision: int | Refusal, then: int) -> list[Effect]:
            # It may be in force and could not be kept all the same.
            sensed = self._show(part, True, then) if self._holder(name) else []
            if isinstance(revision, Refusal):
                return refused(revision, then) + sensed
            return taken(found[0], revision, then) + sensed

        asked = self._change(changed, edit, now, told)
        if isinstance(asked, Refusal):
            return refused(asked, now) + self._missed(part, asked, now)
        return asked

    def leave(self, name: str, edit: SceneEdit, now: int, told: Told) -> list[Effect]:
        """Leave an object that the robot carries where it is; arguments as of `take`."""
        at = self._standing_at(now, self._cell.under_way())
        if isinstance(at, Refusal):
            return told(at, now)
        part = self._part if self._holder(name) == self._view.flange_link else None

        def kept(revision: int | Refusal, then: int) -> list[Effect]:
            sensed = [] if self._holder(name) else self._show(part, False, then)
            return told(revision, then) + sensed

        def changed(before: Scene) -> Scene:
            view = self._view
            return left(before, name, view.flange_link, lambda link: view.link_pose(at, link))

        asked = self._change(changed, edit, now, kept)
        return told(asked, now) if isinstance(asked, Refusal) else asked

    def _change(
        self, change: SceneChange, edit: SceneEdit, now: int, told: Told
    ) -> Refusal | list[Effect]:
        expected, author, session = edit
        return self._world.change_scene(
            change, expected, author, now, told, session, spent=_MEASURED
        )

    # For a program: a restart puts each object where it was taught.

    def take_in_passing(self, name: str, now: int, then: Rearranged) -> list[Effect]:
        """Let the selected tool take an object within reach."""
        at = self._standing_at(now)
        if isinstance(at, Refusal):
            then(at)
            return []
        part = self._part

        def told(refused: Refusal | None, sensed_at: int) -> list[Effect]:
            then(refused)
            if refused is not None:
                return self._missed(part, refused, sensed_at)
            return self._show(part, True, sensed_at)

        return self._world.carry(name, at, now, told)

    def leave_in_passing(self, name: str, now: int, then: Rearranged) -> list[Effect]:
        """Leave an object that the robot carries where it is."""
        at = self._standing_at(now)
        if isinstance(at, Refusal):
            then(at)
            return []
        part = self._part if self._holder(name) == self._view.flange_link else None

        def told(refused: Refusal | None, sensed_at: int) -> list[Effect]:
            then(refused)
            return [] if refused is not None else self._show(part, False, sensed_at)

        return self._world.put_down(name, at, now, told)

    # What is demanded, and what is shown.

    def _standing_at(self, now: int, busy: str = "") -> JointVector | Refusal:
        """Return the joints as reported just now, of a robot at rest, or why they are not.

        Args:
            busy: what is under way that may not be, in words; empty for nothing.
        """
        feedback = self._cell.feedback
        position = feedback.position
        if position is None or not feedback.is_fresh(now):
            age = feedback.age(now)
            text = "" if age is None else f"the last position report is {age / 1e6:.0f} ms old"
            return Refusal(VerdictCode.FEEDBACK_STALE, text)
        if not busy and not feedback.is_standing:
            busy = "the robot moves"
        return Refusal(VerdictCode.CHANGE_WHILE_MOVING, f"scene: {busy}") if busy else position

    def _holder(self, name: str) -> str | None:
        """Return the link that holds an object of the scene in force; None for none."""
        objects = self._world.scene.objects
        return next((each.link for each in objects if each.name == name), None)

    @property
    def _part(self) -> int | None:
        """The input of the selected tool's part sensor."""
        return self._view.frames.grasp.part

    def _missed(self, part: int | None, refused: Refusal, now: int) -> list[Effect]:
        is_miss = refused.code is VerdictCode.NOTHING_GRIPPED
        return self._show(part, False, now) if is_miss else []

    def _show(self, part: int | None, has_part: bool, now: int) -> list[Effect]:
        """Have the part sensor say whether the tool has a part."""
        if part is None or not self._cell.is_known_emulated:
            # A real controller has cabling, which alone says what its inputs are.
            return []

        def told(refused: Refusal | None, _: int) -> list[Effect]:
            return [] if refused is None else [_unset(part, refused)]

        asked = self._signals.set_input(part, has_part, now, told)
        return [_unset(part, asked)] if isinstance(asked, Refusal) else asked


def _unset(part: int, refused: Refusal) -> LogLine:
    return LogLine(f"the part sensor, input {part}, was not set: {refused.sentence}")
