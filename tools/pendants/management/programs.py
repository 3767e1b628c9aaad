"""Stored programs: taught, edited, taken back, tried without moving, and run.

Every change names the revision that it was made from and is answered by the new one, once that is
on the disk. Two apps that edit one program never overwrite each other: the later one is refused.
"""

from __future__ import annotations

from collections.abc import Sequence

from .calls import Request, asks, call
from .edits import Edit
from .program_replies import (
    BreakpointsSet,
    CheckedProgram,
    DryRun,
    DryRunProgress,
    Format,
    ProgramHeadings,
    ProgramSaved,
    ProgramText,
    SavedProgram,
)
from .statements import Move


class ProgramCalls:
    """The operations on stored programs."""

    @call
    def list(self, *, first: int = 0) -> Request[ProgramHeadings]:
        """Return which programs there are, by name.

        Args:
            first: how many to leave out at the beginning.
        """
        return asks("programs.list", first=first)

    @call
    def create(
        self, name: str, *, frame: str = "base", tool: str = "flange"
    ) -> Request[SavedProgram]:
        """Make an empty program of this robot.

        Args:
            name: name of the program.
            frame: the frame that its points are taught in.
            tool: the tool that they are taught with.

        Raises:
            Refused: BAD_NAME, REVISION_CONFLICT: there is one of this name.
        """
        return asks("programs.create", name=name, frame=frame, tool=tool)

    @call
    def load(
        self, name: str, *, format: Format = "text", revision: int | None = None, offset: int = 0
    ) -> Request[ProgramText]:
        """Return a program, or a part of it where it is long.

        Args:
            name: name of the program.
            format: as a text for people, or as JSON.
            revision: an older one, where it is still kept; None for the newest.
            offset: characters to leave out at the beginning.

        Raises:
            Refused: NOT_FOUND.
        """
        return asks("programs.load", name=name, format=format, revision=revision, offset=offset)

    @call
    def history(self, name: str) -> Request[ProgramHeadings]:
        """Return which revisions of a program are kept.

        Args:
            name: name of the program.

        Raises:
            Refused: NOT_FOUND.
        """
        return asks("programs.history", name=name)

    @call
    def save(
        self,
        name: str,
        body: str,
        expected_revision: int,
        *,
        format: Format = "text",
        part: int = 1,
        parts: int = 1,
    ) -> Request[ProgramSaved]:
        """Save a whole program; one that is too long for a frame goes in parts, in order.

        Args:
            name: name of the program; the text says the same.
            body: its text, or a part of it.
            expected_revision: the one that the change was made from; 0 for a new program.
            format: how the body is written.
            part: which part this is, from 1.
            parts: how many there are.

        Raises:
            Refused: PROGRAM_SYNTAX with line and column, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT,
                PROGRAM_TOO_LARGE, REVISION_CONFLICT.
        """
        return asks(
            "programs.save",
            name=name,
            body=body,
            expected_revision=expected_revision,
            format=format,
            part=part,
            parts=parts,
        )

    @call
    def check(self, body: str, *, format: Format = "text") -> Request[CheckedProgram]:
        """Tell whether a text is a program of this robot; saves nothing.

        Args:
            body: the text.
            format: how the body is written.

        Raises:
            Refused: PROGRAM_SYNTAX with line and column, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT.
        """
        return asks("programs.check", body=body, format=format)

    @call
    def delete(self, name: str, expected_revision: int) -> Request[SavedProgram]:
        """Delete a program; its revisions stay in its history.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT.
        """
        return asks("programs.delete", name=name, expected_revision=expected_revision)

    @call
    def rename(self, name: str, new_name: str, expected_revision: int) -> Request[SavedProgram]:
        """Give a program another name; calls in other programs are not changed.

        Args:
            name: name of the program.
            new_name: the name that it has afterwards.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT: of this one, or the new name is taken.
        """
        return asks(
            "programs.rename", name=name, new_name=new_name, expected_revision=expected_revision
        )

    @call
    def edit(self, name: str, expected_revision: int, edit: Edit) -> Request[SavedProgram]:
        """Edit a program.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.
            edit: what to change: points or statements added, removed, moved, described.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, PROGRAM_INVALID, PROGRAM_WRONG_ROBOT,
                POINT_UNKNOWN, POINT_EXISTS, POINT_IN_USE.
        """
        return asks("programs.edit", name=name, expected_revision=expected_revision, edit=edit)

    @call
    def record(
        self,
        name: str,
        expected_revision: int,
        point: str,
        *,
        move: Move | None = None,
        at: int | None = None,
        comment: str = "",
    ) -> Request[SavedProgram]:
        """Add a point where the robot stands, and the move to it.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.
            point: name of the new point.
            move: a move that names it; None for the point alone.
            at: the statement that the move is put before, from 0; None to append it.
            comment: about the point.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, POINT_EXISTS, BAD_NAME, MOVING, FEEDBACK_STALE.
        """
        return asks(
            "programs.record",
            name=name,
            expected_revision=expected_revision,
            point=point,
            move=move,
            at=at,
            comment=comment,
        )

    @call
    def touch_up(self, name: str, expected_revision: int, point: str) -> Request[SavedProgram]:
        """Put a point where the robot stands now; its name and its statements stay.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.
            point: name of the point.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, POINT_UNKNOWN, MOVING, FEEDBACK_STALE.
        """
        return asks(
            "programs.touch_up", name=name, expected_revision=expected_revision, point=point
        )

    @call
    def undo(self, name: str, expected_revision: int) -> Request[SavedProgram]:
        """Take the last edit back; that is a new revision.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, NOTHING_TO_UNDO.
        """
        return asks("programs.undo", name=name, expected_revision=expected_revision)

    @call
    def redo(self, name: str, expected_revision: int) -> Request[SavedProgram]:
        """Make the edit again that was taken back last.

        Args:
            name: name of the program.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, NOTHING_TO_UNDO.
        """
        return asks("programs.redo", name=name, expected_revision=expected_revision)

    @call
    def breakpoints(self, name: str, statements: Sequence[int]) -> Request[BreakpointsSet]:
        """Name the statements of a program to pause before; they follow its edits.

        Args:
            name: name of the program.
            statements: their numbers, from 0; none to run through.

        Raises:
            Refused: NOT_FOUND, PROGRAM_WRONG_ROBOT; BAD_ARGUMENT: it has no such statement;
                NOT_IN_CONTROL, HELD_BY_OTHER: the program is under way.
        """
        return asks("programs.breakpoints", name=name, statements=statements)

    @call
    def dry_run(self, name: str) -> Request[DryRun]:
        """Return what would happen if a program ran; nothing moves.

        Args:
            name: name of the program.

        Raises:
            Refused: PROGRAM_UNKNOWN, CALL_TOO_DEEP, FEEDBACK_STALE; PROGRAM_RUNNING: another dry
                run is under way.
        """
        return asks("programs.dry_run", name=name)

    @call
    def dry_run_progress(self) -> Request[DryRunProgress]:
        """Return how far the dry run is that is under way."""
        return asks("programs.dry_run_progress")
