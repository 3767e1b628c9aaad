"""What the operations on stored programs are answered with."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

Format = Literal["text", "json"]


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


class DryRunProgress(TypedDict):
    """Whether a dry run is under way, and how many blocks of motion were looked at.

    Attributes:
        running: whether a dry run is under way.
        blocks: blocks of motion that were looked at.
    """

    running: bool
    blocks: int
