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

from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import BASE, TOOL, FrameTree
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...events.effects import Effect
from ...events.pending import AskStore
from ...events.reply_to import ReplyTo
from ...refusal import Refusal, refusal_of
from ...store.documents import Document, DocumentKind, Heading
from ...store.requests import Answer, Delete, Save
from ..editing.edit_history import EditStep, History, Renumbering, Splice
from ..editing.edits import DescribeProgram, Edit, RecordPoint, TouchUp
from ..editing.program_tasks import BodyEdited, Done, EditBody, HeadTaken, TakeHead
from ..language.points import ArmConfiguration, PointPose, TeachPoint
from ..language.program import OwnRobot, Program, check_robot
from ..language.program_errors import BadValue, ProgramError
from ..language.program_json import program_from_json
from ..language.statements import Move
from .kept_breakpoints import KeptBreakpoints
from .program_loader import ProgramLoader, ProgramWork
from .program_replies import conflict, renamed, saved


@dataclass(frozen=True, slots=True)
class Standing:
    """Position of a robot at the time of a request, with the frames and tools of that time.

    The point is made later, when its program has been read; a motion of the robot, a frame or a
    tool in the meantime does not move the point.

    Attributes:
        joints: (n,) joint positions, controller side [rad or m].
        tool: the centre point of the tool that was selected, in the base frame [m].
        frames: the frames and tools that were in force.
    """

    joints: tuple[float, ...]
    tool: Pose
    frames: FrameTree


def standing_now(cell: RobotCell, robot: RobotModel, now: int) -> Standing | Refusal:
    """Return where the robot stands, or why no point can be taught now."""
    feedback = cell.feedback
    if feedback.position is None or not feedback.is_fresh(now):
        return Refusal(VerdictCode.FEEDBACK_STALE)
    if not _stands(cell):
        return Refusal(VerdictCode.MOVING, "a point is taught while the robot stands")
    joints = tuple(feedback.position)
    return Standing(joints, Pose.from_values(*robot.tool_pose(joints)), robot.frames)


def taught_point(
    at: Standing, robot: RobotModel, name: str, frame: str, tool: str
) -> TeachPoint | Refusal:
    """Return the point where the robot stood, or why it has no such pose.

    Raises:
        ProgramError: the name cannot be that of a point.
    """
    try:
        pose = _pose(at, frame, tool)
    except MotionError as error:
        return refusal_of(error)
    return TeachPoint(name, at.joints, pose, _configuration(robot, at.joints))


def _stands(cell: RobotCell) -> bool:
    if cell.driving.activity is Activity.PAUSED:
        # Some controllers report a motion as long as they are sent points, even equal ones.
        return cell.feedback.joints_rest
    return cell.feedback.is_standing and not cell.is_busy


def _pose(at: Standing, frame: str, tool: str) -> PointPose:
    # The point's own tool, which may differ from the selected one.
    tip = at.frames.transform(tool, TOOL)
    pose = at.frames.transform(BASE, frame).compose(at.tool).compose(tip)
    x, y, z = pose.position.tolist()
    qx, qy, qz, qw = pose.quaternion.tolist()
    return PointPose((x, y, z), (qx, qy, qz, qw), frame, tool)


def _configuration(robot: RobotModel, joints: tuple[float, ...]) -> ArmConfiguration | None:
    found = robot.configuration(joints)
    if found is None:
        return None
    return ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns)


class NotTaught(Exception):
    """A point cannot be taught; the refusal says why."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


class PointTeaching:
    """Teaches points of one robot."""

    def __init__(self, cell: RobotCell, robot: RobotModel, robot_name: str) -> None:
        self._cell = cell
        self._robot = robot
        self._robot_name = robot_name

    def standing(self, now: int) -> Standing | Refusal:
        """Return where the robot stands for a point asked for now, or why there is none."""
        return standing_now(self._cell, self._robot, now)

    def record(self, head: Program, asked: op.RecordPoint, at: Standing) -> RecordPoint:
        """Return the edit that adds a point where the robot stood.

        Args:
            head: the program; of its points one is enough, of its statements none.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: the program is of another robot, or the name is refused.
        """
        point = replace(self._taught(head, asked.point, at), comment=asked.comment)
        return RecordPoint(point, cast(Move | None, asked.move), asked.at)

    def touch_up(self, head: Program, asked: op.TouchUpPoint, at: Standing) -> TouchUp:
        """Return the edit that puts a point where the robot stood.

        Args:
            head: the program; of its points the one in question is enough.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: as of `record`, or there is no such point.
        """
        before = head.point(asked.point).pose
        point = self._taught(
            head,
            asked.point,
            at,
            frame=None if before is None else before.frame,
            tool=None if before is None else before.tool,
        )
        return TouchUp(point.name, point.joints, point.pose, point.configuration)

    def _taught(
        self,
        program: Program,
        name: str,
        at: Standing,
        frame: str | None = None,
        tool: str | None = None,
    ) -> TeachPoint:
        """Return the point where the robot stood, in the program's own frame if none is named."""
        check_robot(program, self._robot_name, self._cell.limits)
        point = taught_point(at, self._robot, name, frame or program.frame, tool or program.tool)
        if isinstance(point, Refusal):
            raise NotTaught(point)
        return point


MOST_HISTORIES = 50
"""Greatest number of programs with an undo history; the one edited longest ago is dropped."""

_KIND = DocumentKind.PROGRAM

Change = op.EditProgram | op.UndoEdit | op.RedoEdit | op.RenameProgram
Teaching = op.RecordPoint | op.TouchUpPoint
_Reply: TypeAlias = ReplyTo[op.SavedProgram]


class ProgramChanges:
    """Changes of one cell's programs."""

    def __init__(
        self,
        ask: AskStore,
        program_loader: ProgramLoader,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        point_teaching: PointTeaching,
        own: OwnRobot,
    ) -> None:
        self._ask = ask
        self._shelf = program_loader
        self._work = work
        self._breakpoints = breakpoints
        self._teacher = point_teaching
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
            reply_to: gets the answer, with the breakpoints as they are then.
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

            return self._breakpoints.follow(name, revision, body, followed, now)

        return self._ask(Save(_KIND, name, body, expected, reply_to.name), kept)

    def _history(self, name: str, revision: int) -> History:
        """Return the history of a revision, as far as it is known."""
        known, history = self._histories.get(name, (0, History()))
        return history if known == revision else History()

    def _remember(self, name: str, revision: int, history: History) -> None:
        self._histories[name] = (revision, history)
        self._histories.move_to_end(name)
        while len(self._histories) > MOST_HISTORIES:
            self._histories.popitem(last=False)

    def replace(self, asked: op.SaveProgram, body: str, reply_to: _Reply) -> list[Effect]:
        """Save a program in the place of the one that is kept, so that this can be undone."""
        name, expected = asked.name, asked.expected_revision
        if self._histories.get(name, (0, None))[0] != expected or expected == 0:
            return self.save(name, body, History(), expected, reply_to)

        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return reply_to.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            history = self._history(name, expected).edited(EditStep(Splice(0, found.body, body)))
            return self.save(name, body, history, expected, reply_to)

        return self._shelf.load(name, loaded)

    def edit(self, asked: op.EditProgram, edit: Edit, reply: _Reply) -> list[Effect]:
        """Edit a program.

        Raises:
            BadValue: the edit names the program.
        """
        if isinstance(edit, DescribeProgram) and edit.name is not None:
            raise BadValue("the edit", "names the program; accepted: programs.rename for that")
        return self._of_kept(
            asked, reply, lambda body, at: self._edit(asked, body, edit, reply, at)
        )

    def rename(self, asked: op.RenameProgram, reply: _Reply) -> list[Effect]:
        """Give a program another name."""
        return self._of_kept(asked, reply, lambda body, at: self._rename(asked, body, reply, at))

    def undo(self, asked: op.UndoEdit, reply: _Reply) -> list[Effect]:
        """Undo the last edit."""
        return self._of_kept(
            asked, reply, lambda body, at: self._go(asked, body, History.undone, reply)
        )

    def redo(self, asked: op.RedoEdit, reply: _Reply) -> list[Effect]:
        """Redo the edit that was undone last."""
        return self._of_kept(
            asked, reply, lambda body, at: self._go(asked, body, History.redone, reply)
        )

    def teach(self, asked: Teaching, reply_to: _Reply, now: int) -> list[Effect]:
        """Teach a point of a stored program at the robot's position at the time of the request.

        The position is taken now: while the program is being loaded, the robot may move away.
        """
        standing = self._teacher.standing(now)
        if isinstance(standing, Refusal):
            return reply_to.refuse(standing)
        return self._of_kept(
            asked, reply_to, lambda body, at: self._teach(asked, body, standing, reply_to, at)
        )

    def _of_kept(
        self,
        asked: Change | Teaching,
        reply_to: _Reply,
        then: Callable[[str, int], list[Effect]],
    ) -> list[Effect]:
        """Load the revision that a request names; `then` takes its JSON and the time."""
        name, expected = asked.name, asked.expected_revision

        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return reply_to.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            body = found.body

            def followed(_: object, now: int) -> list[Effect]:
                try:
                    return then(body, now)
                except ProgramError as error:
                    return reply_to.refuse_program(error)

            return self._breakpoints.follow(name, expected, body, followed, now)

        return self._shelf.load(name, loaded)

    def _go(
        self,
        asked: op.UndoEdit | op.RedoEdit,
        body: str,
        way: Callable[[History], tuple[History, EditStep]],
        reply_to: _Reply,
    ) -> list[Effect]:
        """Undo or redo one edit; this works on the JSON and needs no parsing."""
        name, expected = asked.name, asked.expected_revision
        history, step = way(self._history(name, expected))
        after = step.splice.applied(body)
        return self.save(name, after, history, expected, reply_to, step.renumbering)

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

    def _teach(
        self,
        asked: Teaching,
        body: str,
        standing: Standing,
        reply_to: _Reply,
        now: int,
    ) -> list[Effect]:
        def taken(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, HeadTaken)
            head = program_from_json(done.head)
            edit: Edit
            try:
                if isinstance(asked, op.RecordPoint):
                    edit = self._teacher.record(head, asked, standing)
                else:
                    edit = self._teacher.touch_up(head, asked, standing)
            except NotTaught as error:
                return reply_to.refuse(error.refusal)
            return self._edit(asked, body, edit, reply_to, now)

        point = asked.point if isinstance(asked, op.TouchUpPoint) else None
        return self._work.have(TakeHead(body, asked.name, point), taken, reply_to, now)

    def _rename(
        self, asked: op.RenameProgram, body: str, reply_to: _Reply, now: int
    ) -> list[Effect]:
        """Save under the new name, then delete the old one: a crash between loses nothing."""
        old, new, expected = asked.name, asked.new_name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, BodyEdited)
            return self._ask(Save(_KIND, new, done.splice.applied(body), 0, reply_to.name), copied)

        def copied(found: Answer, now: int) -> list[Effect]:
            if not isinstance(found, Heading):
                return saved(found, reply_to)
            copy = found

            def deleted(gone: Answer, now: int) -> list[Effect]:
                if isinstance(gone, Heading):
                    self._breakpoints.rename(old, new, copy.revision)
                return renamed(copy, gone, reply_to, self._breakpoints.fields(new, copy.revision))

            return self._ask(Delete(_KIND, old, expected, reply_to.name), deleted)

        task = EditBody(body, old, DescribeProgram(name=new))
        return self._work.have(task, edited, reply_to, now)
