"""Operations on stored programs: taught, edited, taken back, tried without moving.

Every change names the revision that it was made from and is answered by the new one, once that is
on the disk. Two apps that edit one program never overwrite each other: the later one is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Literal, NotRequired, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import (
    Count,
    Length,
    NeedsAuthority,
    ReadAs,
    ReadAsFrom,
    Request,
    Revision,
    Strictly,
    operation,
)
from .edits import Edit, Move

MOST_PARTS = 1_000
"""Parts in which a program may be saved."""

MOST_STATEMENTS = 4_000
"""Statements of one program; a longer one calls others."""

Format: TypeAlias = Literal["text", "json"]

StatementNumber: TypeAlias = Annotated[int, Count(0, below=MOST_STATEMENTS)]
"""Number of a statement, from 0."""


class ProgramHeading(TypedDict):
    """A revision of a program without its text.

    Attributes:
        name: name of the program.
        revision: counts its changes, from 1; goes on after a deletion.
        size: size of what is kept [bytes].
        saved_by: who saved it.
        saved_at: wall-clock time in UTC, ISO 8601; for display only.
        deleted: whether this revision is its deletion.
    """

    name: str
    revision: int
    size: int
    saved_by: str
    saved_at: str
    deleted: bool


class ProgramHeadings(TypedDict):
    """Some headings; `next` is the `first` to ask for the rest with, None at the end.

    Attributes:
        programs: up to 150 of them.
        next: the `first` to ask for the rest with; None at the end.
    """

    programs: list[ProgramHeading]
    next: int | None


class SavedProgram(TypedDict):
    """What is kept now: make the next change from this revision.

    Attributes:
        name: name of the program.
        revision: the one that is kept now: make the next change from it.
        breakpoints: the statements to pause before, from 0, where it has any.
        dropped_breakpoints: how many are gone with their statements since they were set.
    """

    name: str
    revision: int
    breakpoints: NotRequired[list[int]]
    dropped_breakpoints: NotRequired[int]


class ProgramSaved(TypedDict):
    """The revision that is kept, after the last part; before it, which part has come.

    Attributes:
        name: name of the program, after the last part.
        revision: the one that is kept now, after the last part.
        part: which part has come, where more are expected.
        parts: how many are expected.
        breakpoints: the statements to pause before, from 0, where it has any.
        dropped_breakpoints: how many are gone with their statements since they were set.
    """

    name: NotRequired[str]
    revision: NotRequired[int]
    part: NotRequired[int]
    parts: NotRequired[int]
    breakpoints: NotRequired[list[int]]
    dropped_breakpoints: NotRequired[int]


class ProgramText(TypedDict):
    """A program, or a part of it.

    Attributes:
        name: name of the program.
        revision: the one that this is.
        saved_by: who saved it.
        saved_at: wall-clock time in UTC, ISO 8601; for display only.
        format: how the body is written.
        body: the text, or the JSON as a text.
        next: the offset to ask for the rest with; None at the end.
        breakpoints: the statements to pause before, from 0, where the newest revision has any.
        dropped_breakpoints: how many are gone with their statements since they were set.
    """

    name: str
    revision: int
    saved_by: str
    saved_at: str
    format: Format
    body: str
    next: int | None
    breakpoints: NotRequired[list[int]]
    dropped_breakpoints: NotRequired[int]


class CheckedProgram(TypedDict):
    """What a text is: a program with so many points and statements.

    Attributes:
        name: name of the program.
        points: how many.
        statements: how many.
        first_line: line of its first statement in the text that `load` gives, from 1.
    """

    name: str
    points: int
    statements: int
    first_line: int


class BreakpointsSet(TypedDict):
    """The statements to pause before from now on, from 0.

    Attributes:
        name: name of the program.
        statements: their numbers, from 0.
        revision: the one that they are of; missing where there are none.
        next_run: those that the run under way, of another revision, does not pause before.
    """

    name: str
    statements: list[int]
    revision: NotRequired[int]
    next_run: NotRequired[list[int]]


class MoveVerdict(TypedDict):
    """What would become of one move.

    Attributes:
        program: the program that it is in.
        line: its line in the text, from 1.
        point: the point that it goes to.
        zone_used: whether its zone joins it with the next move, without a stop.
        reachable: whether it can be done.
        code: why not; entry of the catalogue.
        text: the same, as a sentence with its numbers.
    """

    program: str
    line: int
    point: str
    zone_used: bool
    reachable: bool
    code: NotRequired[int]
    text: NotRequired[str]


class HandOverVerdict(TypedDict):
    """What would become of one `attach` or `detach`; as of a move.

    Attributes:
        program: the program that it is in.
        line: its line in the text, from 1.
        does: `attach` or `detach`.
        object: the object of the scene.
        reachable: whether it can be done.
        code: why not; entry of the catalogue.
        text: the same, as a sentence with its numbers.
    """

    program: str
    line: int
    does: str
    object: str
    reachable: bool
    code: NotRequired[int]
    text: NotRequired[str]


class StatementVerdict(TypedDict):
    """What would become of a statement with signals or flags, or of a loop; as of a move.

    Attributes:
        program: the program that it is in.
        line: its line in the text, from 1.
        does: such as `wait-input`, `set-output`, `if-flag` or `loop`.
        reachable: whether a run goes on there.
        code: why not; entry of the catalogue.
        text: the same, as a sentence with its numbers.
    """

    program: str
    line: int
    does: str
    reachable: bool
    code: NotRequired[int]
    text: NotRequired[str]


class PointVerdict(TypedDict):
    """Whether the robot can stand at a point; as of a move.

    Attributes:
        point: name of the point.
        reachable: whether the robot can stand there.
        code: why not; entry of the catalogue.
        text: the same, as a sentence with its numbers.
    """

    point: str
    reachable: bool
    code: NotRequired[int]
    text: NotRequired[str]


class NotWalked(TypedDict):
    """A statement that the dry run did not come to, or could not check: its line in the text.

    Attributes:
        program: the program that it is in.
        line: its line in the text, from 1.
    """

    program: str
    line: int


class DryRun(TypedDict):
    """What would happen if the program ran now.

    Attributes:
        program: its name.
        revision: the one that was walked through, which a run can be asked for.
        duration: how long it would take, one pass where it is endless [s].
        endless: whether it would never end by itself.
        complete: whether all of it was looked at.
        refused: how many statements and points cannot be done, those included that are not told.
        moves: the first 100 moves, or as many as fit, those that cannot be done first.
        scene: likewise, where it takes or leaves objects.
        statements: likewise, those with signals or flags, and loops.
        unchecked: statements with signals, where the controller has not said which it has.
        points: likewise, the points that are named.
        not_walked: statements in branches that are not taken.
        path: the way of the tool: time [s], then x, y, z in base [m].
        plan: where samples were asked for, the plan that `plans.samples` shows its motions by, one
            behind the other without waits, and that is never executed; None where there is none.
    """

    program: str
    revision: int
    duration: float
    endless: bool
    complete: bool
    refused: int
    moves: list[MoveVerdict]
    scene: list[HandOverVerdict]
    statements: list[StatementVerdict]
    unchecked: list[NotWalked]
    points: list[PointVerdict]
    not_walked: list[NotWalked]
    path: list[list[float]]
    plan: NotRequired[int | None]


class DryRunProgress(TypedDict):
    """Whether a dry run is under way, and how many blocks of motion were looked at.

    Attributes:
        running: whether a dry run is under way.
        blocks: blocks of motion that were looked at.
    """

    running: bool
    blocks: int


@operation("programs.list", needs=Permission.OBSERVE)
class ListPrograms(Request[ProgramHeadings]):
    """Return which programs there are, by name."""

    first: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """how many to leave out at the beginning."""


@operation("programs.create", needs=Permission.EDIT_PROGRAM)
class CreateProgram(Request[SavedProgram]):
    """Make an empty program of this robot.

    Raises:
        Refused: BAD_NAME, REVISION_CONFLICT: there is one of this name.
    """

    name: str
    """name of the program."""
    frame: str = field(default="base", kw_only=True)
    """the frame that its points are taught in."""
    tool: str = field(default="flange", kw_only=True)
    """the tool that they are taught with."""


@operation("programs.load", needs=Permission.OBSERVE)
class LoadProgram(Request[ProgramText]):
    """Return a program, or a part of it where it is long.

    Raises:
        Refused: NOT_FOUND.
    """

    name: str
    """name of the program."""
    format: Format = field(default="text", kw_only=True)
    """as a text for people, or as JSON."""
    revision: int | None = field(default=None, kw_only=True)
    """an older one, where it is still kept; None for the newest."""
    offset: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """characters to leave out at the beginning."""


@operation("programs.history", needs=Permission.OBSERVE)
class ProgramHistory(Request[ProgramHeadings]):
    """Return which revisions of a program are kept.

    Raises:
        Refused: NOT_FOUND.
    """

    name: str
    """name of the program."""


@operation("programs.save", needs=Permission.EDIT_PROGRAM)
class SaveProgram(Request[ProgramSaved]):
    """Save a whole program; one that is too long for a frame goes in parts, in order.

    Raises:
        Refused: PROGRAM_SYNTAX with line and column, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT,
            PROGRAM_TOO_LARGE, REVISION_CONFLICT.
    """

    name: str
    """name of the program; the text says the same."""
    format: Format = field(default="text", kw_only=True)
    """how the body is written."""
    body: str
    """its text, or a part of it."""
    expected_revision: Revision
    """the one that the change was made from; 0 for a new program."""
    part: Annotated[int, Count(1, MOST_PARTS)] = field(default=1, kw_only=True)
    """which part this is, from 1."""
    parts: Annotated[int, Count(1, MOST_PARTS)] = field(default=1, kw_only=True)
    """how many there are."""


@operation("programs.check", needs=Permission.OBSERVE)
class CheckProgram(Request[CheckedProgram]):
    """Tell whether a text is a program of this robot; saves nothing.

    Raises:
        Refused: PROGRAM_SYNTAX with line and column, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT.
    """

    body: str
    """the text."""
    format: Format = field(default="text", kw_only=True)
    """how the body is written."""


@operation("programs.delete", needs=Permission.EDIT_PROGRAM)
class DeleteProgram(Request[SavedProgram]):
    """Delete a program; its revisions stay in its history.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("programs.rename", needs=Permission.EDIT_PROGRAM)
class RenameProgram(Request[SavedProgram]):
    """Give a program another name; calls in other programs are not changed.

    Raises:
        Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT: of this one, or the new name is taken.
    """

    name: str
    """name of the program."""
    new_name: str
    """the name that it has afterwards."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("programs.edit", needs=Permission.EDIT_PROGRAM)
class EditProgram(Request[SavedProgram]):
    """Edit a program.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT, POINT_UNKNOWN,
            POINT_EXISTS, POINT_IN_USE.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""
    edit: Annotated[Edit, ReadAsFrom("statements", "AnyEdit")]
    """what to change: points or statements added, removed, moved, described."""


@operation("programs.record", needs=Permission.EDIT_PROGRAM)
class RecordPoint(Request[SavedProgram]):
    """Add a point where the robot stands, and the move to it.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, POINT_EXISTS, BAD_NAME, MOVING, FEEDBACK_STALE.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""
    point: str
    """name of the new point."""
    move: Annotated[Move, ReadAsFrom("statements", "Move")] | None = field(
        default=None, kw_only=True
    )
    """a move that names it; None for the point alone."""
    at: int | None = field(default=None, kw_only=True)
    """the statement that the move is put before, from 0; None to append it."""
    comment: str = field(default="", kw_only=True)
    """about the point."""


@operation("programs.touch_up", needs=Permission.EDIT_PROGRAM)
class TouchUpPoint(Request[SavedProgram]):
    """Put a point where the robot stands now; its name and its statements stay.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, POINT_UNKNOWN, MOVING, FEEDBACK_STALE.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""
    point: str
    """name of the point."""


@operation("programs.undo", needs=Permission.EDIT_PROGRAM)
class UndoEdit(Request[SavedProgram]):
    """Take the last edit back; that is a new revision.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, NOTHING_TO_UNDO.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("programs.redo", needs=Permission.EDIT_PROGRAM)
class RedoEdit(Request[SavedProgram]):
    """Make the edit again that was taken back last.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, NOTHING_TO_UNDO.
    """

    name: str
    """name of the program."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation(
    "programs.breakpoints",
    needs=Permission.RUN_PROGRAM,
    authority=NeedsAuthority.PROGRAM_UNDER_WAY,
    overtaken=False,
)
class SetBreakpoints(Request[BreakpointsSet]):
    """Name the statements of a program to pause before; they follow its edits.

    Raises:
        Refused: NOT_FOUND, PROGRAM_WRONG_ROBOT; BAD_ARGUMENT: it has no such statement;
            NOT_IN_CONTROL, HELD_BY_OTHER: the program is under way.
    """

    name: str
    """name of the program."""
    statements: Annotated[
        Sequence[int], ReadAs(Annotated[tuple[StatementNumber, ...], Length(None, 1_000)])
    ]
    """their numbers, from 0; none to run through."""


@operation("programs.dry_run", needs=Permission.RUN_PROGRAM, overtaken=False)
class StartDryRun(Request[DryRun]):
    """Return what would happen if a program ran; nothing moves.

    Raises:
        Refused: PROGRAM_UNKNOWN, CALL_TOO_DEEP, FEEDBACK_STALE; PROGRAM_RUNNING: another dry run is
            under way; with samples PLANNING, TOO_MANY_PLANS.
    """

    name: str
    """name of the program."""
    samples: Annotated[bool, Strictly()] = field(default=False, kw_only=True, metadata={"since": 3})
    """whether its motions are kept as a plan to be looked at; from version 3 of the protocol."""


@operation("programs.dry_run_progress", needs=Permission.OBSERVE)
class AskDryRunProgress(Request[DryRunProgress]):
    """Return how far the dry run is that is under way."""
