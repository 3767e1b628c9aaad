"""Changes of kept programs: each from the revision that it names, and undone on demand.

Owns the undo of each program's edits, and that a change is acknowledged after the store has it.
Here a program is a string of JSON, never parsed but for the head that a point is taught in.

Owns the conditions for teaching a point, which has joints, pose, frame, tool and configuration: a
fresh report, the robot at rest, also in a pause. Its frame and tool are the program's own for a new
point, those of the point for one that is touched up.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias, cast

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import BASE, TOOL, FrameTree
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.pendant.management.program_values import (
    ArmConfiguration,
    BadValue,
    PointPose,
    ProgramError,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import (
    DescribeProgram,
    Edit,
    Move,
    RecordPoint,
    TouchUp,
)

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...cell.standing import standing_at
from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...events.pending import AskStore, Steps
from ...refusal import Refusal, refusal_of
from ...store.documents import DocumentKind, Heading
from ...store.requests import Answer, Delete, Save
from ...store.store_errors import Conflict, StoreError
from ..editing.edit_history import EditStep, History, Renumbering, Splice
from ..editing.program_tasks import BodyEdited, Done, EditBody, HeadTaken, TakeHead
from ..language.program import OwnRobot, Program, check_robot
from ..language.program_json import program_from_json
from ..language.taught_numbers import taught_joints, taught_position
from .kept_breakpoints import KeptBreakpoints, KeptFields
from .program_loader import ProgramLoader, ProgramWork


@dataclass(frozen=True, slots=True)
class Standing:
    """Position of a robot at the time of a request, with the frames and tools of that time.

    The point is made later, when its program has been read; a motion of the robot, a frame or a
    tool in the meantime does not move the point.

    Attributes:
        joints: (n,) joint positions, controller side [rad or m].
        tool: the centre point of the tool that was selected, in the base frame [m].
    """

    joints: tuple[float, ...]
    tool: Pose
    frames: FrameTree


def standing_now(
    cell: RobotCell, robot: RobotModel, limits: JointLimits, now: int
) -> Standing | Refusal:
    """Return where the robot stands, as people read it, or why no point can be taught now."""
    reported = standing_at(cell, "a point", now)
    if isinstance(reported, Refusal):
        return reported
    joints = taught_joints(reported, limits)
    return Standing(joints, Pose.from_values(*robot.tool_pose(joints)), robot.frames)


def _pose(at: Standing, frame: str, tool: str) -> PointPose:
    # The point's own tool, which may differ from the selected one.
    tip = at.frames.transform(tool, TOOL)
    pose = at.frames.transform(BASE, frame).compose(at.tool).compose(tip)
    qx, qy, qz, qw = pose.quaternion.tolist()
    return PointPose(taught_position(pose.position.tolist()), (qx, qy, qz, qw), frame, tool)


def _configuration(robot: RobotModel, joints: tuple[float, ...]) -> ArmConfiguration | None:
    found = robot.configuration(joints)
    if found is None:
        return None
    return ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns)


MOST_HISTORIES = 50
"""Greatest number of programs with an undo history; the one edited longest ago is dropped."""

_KIND = DocumentKind.PROGRAM

Change = op.EditProgram | op.UndoEdit | op.RedoEdit | op.RenameProgram
Teaching = op.RecordPoint | op.TouchUpPoint
_Reply: TypeAlias = ReplyTo[op.SavedProgram]


def saved(found: Answer, reply: _Reply, about: KeptFields | None = None) -> list[Effect]:
    """Answer after the store has a change: the point that is acknowledged is on the disk."""
    if isinstance(found, StoreError):
        return reply.refuse(found.refusal())
    assert isinstance(found, Heading)
    return reply.answer({"name": found.name, "revision": found.revision, **(about or {})})


class ProgramChanges:
    """Changes of one cell's programs."""

    def __init__(
        self,
        ask: AskStore,
        loader: ProgramLoader,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        cell: RobotCell,
        robot: RobotModel,
        own: OwnRobot,
    ) -> None:
        self._ask = ask
        self._loader = loader
        self._work = work
        self._breakpoints = breakpoints
        self._cell = cell
        self._robot = robot
        self._own = own
        self._histories: OrderedDict[str, tuple[int, History]] = OrderedDict()

    def save(
        self,
        name: str,
        body: str,
        history: History,
        expected: int,
        reply_to: _Reply,
        renumbering: Renumbering | None = None,
    ) -> list[Effect]:
        """Save the result of a history; the history is kept once the store has acknowledged it.

        Args:
            expected: the revision that the change was made from.
            renumbering: where the change leaves the statements; None to find them by comparing.
        """

        def kept(found: Answer, now: int) -> list[Effect]:
            if not isinstance(found, Heading):
                return saved(found, reply_to)
            heading, revision = found, found.revision
            self._remember(name, revision, history)
            if renumbering is not None:
                self._breakpoints.move(name, expected, revision, renumbering)

            def followed(_: object, now: int) -> list[Effect]:
                return saved(heading, reply_to, self._breakpoints.fields(name, revision))

            places = self._breakpoints.places(name, revision, body)
            return self._work.run(places, followed, now)

        return self._ask(Save(_KIND, name, body, expected, reply_to.name, reply_to.session), kept)

    def _history(self, name: str, revision: int) -> History:
        """Return the history of a revision, as far as it is known."""
        known, history = self._histories.get(name, (0, History()))
        return history if known == revision else History()

    def _remember(self, name: str, revision: int, history: History) -> None:
        self._histories[name] = (revision, history)
        self._histories.move_to_end(name)
        while len(self._histories) > MOST_HISTORIES:
            self._histories.popitem(last=False)

    def replace(self, asked: op.SaveProgram, body: str, reply_to: _Reply, now: int) -> list[Effect]:
        """Save a program in the place of the one that is kept, so that this can be undone."""
        name, expected = asked.name, asked.expected_revision
        if self._histories.get(name, (0, None))[0] != expected or expected == 0:
            return self.save(name, body, History(), expected, reply_to)

        def loaded(found: str | Refusal, now: int) -> list[Effect]:
            if isinstance(found, Refusal):
                return reply_to.refuse(found)
            history = self._history(name, expected).edited(EditStep(Splice(0, found, body)))
            return self.save(name, body, history, expected, reply_to)

        return self._work.run(self._kept(name, expected), loaded, now)

    def _kept(self, name: str, expected: int) -> Steps[str | Refusal]:
        """Load the JSON of the revision that a change is made from, or why it is not that one."""
        found = yield from self._loader.document(name)
        if isinstance(found, Refusal):
            return found
        kept = found.heading
        if kept.revision == expected:
            return found.body
        by, at = kept.saved_by, kept.saved_at
        return Conflict(_KIND, name, expected, kept.revision, by, at).refusal()

    def _of_kept(
        self,
        asked: Change | Teaching,
        reply_to: _Reply,
        then: Callable[[str, int], list[Effect]],
        now: int,
    ) -> list[Effect]:
        """Load the revision that a request names; `then` takes its JSON and the time."""
        name, expected = asked.name, asked.expected_revision

        def followed() -> Steps[str | Refusal]:
            body = yield from self._kept(name, expected)
            if isinstance(body, str):
                yield from self._breakpoints.places(name, expected, body)
            return body

        def loaded(body: str | Refusal, now: int) -> list[Effect]:
            if isinstance(body, Refusal):
                return reply_to.refuse(body)
            try:
                return then(body, now)
            except ProgramError as error:
                return reply_to.refuse_program(error)

        return self._work.run(followed(), loaded, now)

    @handles(op.EditProgram)
    def _ask_edit(self, asked: op.EditProgram, reply_to: _Reply, now: int) -> list[Effect]:
        edit = cast(Edit, asked.edit)
        if isinstance(edit, DescribeProgram) and edit.name is not None:
            raise BadValue("the edit", "names the program; accepted: programs.rename for that")
        return self._of_kept(
            asked, reply_to, lambda body, at: self._edit(asked, body, edit, reply_to, at), now
        )

    def _edit(
        self,
        asked: op.EditProgram | Teaching,
        body: str,
        edit: Edit,
        reply_to: _Reply,
        now: int,
    ) -> list[Effect]:
        name, expected = asked.name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, BodyEdited)
            history = self._history(name, expected).edited(EditStep(done.splice, done.renumbering))
            after = done.splice.applied(body)
            return self.save(name, after, history, expected, reply_to, done.renumbering)

        return self._work.have(EditBody(body, name, edit, self._own), edited, reply_to, now)

    @handles(op.UndoEdit)
    def _undo(self, asked: op.UndoEdit, reply_to: _Reply, now: int) -> list[Effect]:
        return self._go(asked, History.undone, reply_to, now)

    @handles(op.RedoEdit)
    def _redo(self, asked: op.RedoEdit, reply_to: _Reply, now: int) -> list[Effect]:
        return self._go(asked, History.redone, reply_to, now)

    def _go(
        self,
        asked: op.UndoEdit | op.RedoEdit,
        way: Callable[[History], tuple[History, EditStep]],
        reply_to: _Reply,
        now: int,
    ) -> list[Effect]:
        """Undo or redo one edit; this works on the JSON and needs no parsing."""
        name, expected = asked.name, asked.expected_revision

        def loaded(body: str, now: int) -> list[Effect]:
            history, step = way(self._history(name, expected))
            after = step.splice.applied(body)
            return self.save(name, after, history, expected, reply_to, step.renumbering)

        return self._of_kept(asked, reply_to, loaded, now)

    @handles(op.RecordPoint)
    def _record(self, asked: op.RecordPoint, reply_to: _Reply, now: int) -> list[Effect]:
        return self._teach(asked, reply_to, now)

    @handles(op.TouchUpPoint)
    def _touch_up(self, asked: op.TouchUpPoint, reply_to: _Reply, now: int) -> list[Effect]:
        return self._teach(asked, reply_to, now)

    def _teach(self, asked: Teaching, reply_to: _Reply, now: int) -> list[Effect]:
        """Teach a point of a stored program at the robot's position at the time of the request.

        The position is taken now: while the program is being loaded, the robot may move away.
        """
        standing = standing_now(self._cell, self._robot, self._own.limits, now)
        if isinstance(standing, Refusal):
            return reply_to.refuse(standing)
        point = asked.point if isinstance(asked, op.TouchUpPoint) else None

        def loaded(body: str, now: int) -> list[Effect]:
            def taken(done: Done, now: int) -> list[Effect]:
                assert isinstance(done, HeadTaken)
                edit = self._taught(program_from_json(done.head), asked, standing)
                if isinstance(edit, Refusal):
                    return reply_to.refuse(edit)
                return self._edit(asked, body, edit, reply_to, now)

            return self._work.have(TakeHead(body, asked.name, point), taken, reply_to, now)

        return self._of_kept(asked, reply_to, loaded, now)

    def _taught(
        self, head: Program, asked: Teaching, at: Standing
    ) -> RecordPoint | TouchUp | Refusal:
        """Return the edit that puts a point where the robot stood, or why it has no such pose.

        Args:
            head: the program; of its points the one in question is enough, of its statements none.

        Raises:
            ProgramError: the program is of another robot, or the name is refused or unknown.
        """
        before = head.point(asked.point).pose if isinstance(asked, op.TouchUpPoint) else None
        check_robot(head, self._own.name, self._own.limits)
        frame, tool = (head.frame, head.tool) if before is None else (before.frame, before.tool)
        try:
            pose = _pose(at, frame, tool)
        except MotionError as error:
            return refusal_of(error)
        configuration = _configuration(self._robot, at.joints)
        point = TeachPoint(asked.point, at.joints, pose, configuration)
        if isinstance(asked, op.RecordPoint):
            point = replace(point, comment=asked.comment)
            return RecordPoint(point, cast(Move | None, asked.move), asked.at)
        return TouchUp(point.name, point.joints, point.pose, point.configuration)

    @handles(op.RenameProgram)
    def _rename(self, asked: op.RenameProgram, reply_to: _Reply, now: int) -> list[Effect]:
        """Save under the new name, then delete the old one: a crash between loses nothing."""
        old, new, expected = asked.name, asked.new_name, asked.expected_revision

        def loaded(body: str, now: int) -> list[Effect]:
            def edited(done: Done, now: int) -> list[Effect]:
                assert isinstance(done, BodyEdited)
                after, by = done.splice.applied(body), reply_to
                copy = Save(_KIND, new, after, 0, by.name, by.session, renames=old)
                return self._ask(copy, copied)

            task = EditBody(body, old, DescribeProgram(name=new))
            return self._work.have(task, edited, reply_to, now)

        def copied(found: Answer, now: int) -> list[Effect]:
            if not isinstance(found, Heading):
                return saved(found, reply_to)
            copy = found

            def deleted(gone: Answer, now: int) -> list[Effect]:
                if isinstance(gone, StoreError):
                    refusal = gone.refusal()
                    left = "was saved, but the old name is still there"
                    text = f"{copy.name!r} {left}: {refusal.sentence}"
                    return reply_to.refuse(replace(refusal, text=text))
                self._breakpoints.rename(old, new, copy.revision)
                return saved(copy, reply_to, self._breakpoints.fields(new, copy.revision))

            delete = Delete(_KIND, old, expected, reply_to.name, reply_to.session, copy)
            return self._ask(delete, deleted)

        return self._of_kept(asked, reply_to, loaded, now)
