"""The stored form of a recording: the description in its document and the columns of its rows.

Owns the columns, the definition of a gap between two reports, how a description is read, and the
count of rows (`RowCount`): how many, how long, at which rate, with which gaps. Duration and rate
are defined there; whoever passes rows on, while they are recorded or afterwards, counts by it. A
gap is marked in the row that ends it and never filled. A file without the column of that mark may
have gaps too; there only the times show them. Knows no robot and no clock.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal, field_fault

TIME, GAP = "t", "gap"

GAP_PERIODS = 2.5
"""Number of reporting periods; two reports further apart have a gap between them."""


class RecordingDocument(BaseModel):
    """The body of a recording's document.

    What was counted is of a recording that was stopped; of one that was cut off, and of most that
    come from a file, it is not known before the samples are read.
    """

    model_config = ConfigDict(extra="ignore", frozen=True)

    columns: tuple[str, ...] = Field(min_length=2, max_length=256)
    """Names of the values of a row: the time [s], each joint [rad or m], and the mark of a gap; see
    `column_fault` for which there are."""
    robot: str = ""
    """The robot; empty where a file did not say."""
    joints: tuple[str, ...] = ()
    """Names of the joints."""
    period: float = Field(0.01, gt=0, le=10)
    """How often the controller was expected to report [s]."""
    finished: bool = True
    """It was stopped, not cut off; of a file that does not say so it is believed."""
    problem: str = ""
    """Why it ended by itself, where that could be kept; empty where it was stopped."""
    samples: int = 0
    """Rows."""
    duration: float = 0.0
    """From the first to the last row [s]."""
    rate: float = 0.0
    """Rows a second, gaps left out [Hz]."""
    gaps: int = 0
    """Gaps between rows."""
    longest_gap: float = 0.0
    """The longest of them [s]."""


@dataclass(frozen=True, slots=True)
class Extract:
    """What a recording's description says of its rows.

    Attributes:
        width: values of a row.
        joints: places of the joints in a row, the first joint first.
    """

    width: int
    joints: tuple[int, ...]


def _joint_columns(joints: int) -> tuple[str, ...]:
    return tuple(f"j{number}" for number in range(1, joints + 1))


class ColumnFault(NamedTuple):
    """Fault in the columns of a recording.

    Attributes:
        place: of the column at fault, from 0; None where one is missing.
    """

    place: int | None
    problem: str


def column_fault(columns: Sequence[str], joints: int | None = None) -> ColumnFault | None:
    """Return what is wrong with the columns of a row; None where each is there that has to be.

    The name of a column states its content, so their order is free and any other name is refused.

    Args:
        joints: how many joints the robot has; None for as many as there are columns for.
    """
    if joints is None:
        joints = max(1, len(columns) - (TIME in columns) - (GAP in columns))
    needed = (TIME, *_joint_columns(joints))
    named = f"{TIME}, j1" if joints == 1 else f"{TIME}, j1 to j{joints}"
    accepted = f"accepted: {named}, and {GAP} if you like, each once"
    for place, column in enumerate(columns):
        if column not in needed and column != GAP:
            return ColumnFault(place, f"is {column[:80]!r}; {accepted}")
        if column in columns[:place]:
            return ColumnFault(place, f"is {column!r} once more; {accepted}")
    missing = [name for name in needed if name not in columns]
    return ColumnFault(None, f"no column is {missing[0]!r}; {accepted}") if missing else None


def new_document(robot: str, joints: Sequence[str], period: float) -> RecordingDocument:
    """Return the description of a new recording."""
    return RecordingDocument(
        columns=(TIME, *_joint_columns(len(joints)), GAP),
        robot=robot,
        joints=tuple(joints),
        period=period,
        finished=False,
    )


def read_document(name: str, body: str) -> RecordingDocument | Refusal:
    """Return a recording's description."""
    try:
        return RecordingDocument.model_validate_json(body)
    except ValidationError as error:
        text = f"recording {name!r}: {field_fault(error)}"
        return Refusal(VerdictCode.BAD_DOCUMENT, text[:400])


def write_document(document: RecordingDocument) -> str:
    """Return the body of a recording's document."""
    return json.dumps(document.model_dump(), ensure_ascii=False)


def extract_for(name: str, document: RecordingDocument, robot: str, dof: int) -> Extract | Refusal:
    """Return where the joints are in the rows, if the recording is one of this robot."""
    if not document.robot:
        text = (
            f"recording {name!r} does not say of which robot it is; this robot is {robot!r}: if it"
            f" is of this one, import it again with --robot {robot}"
        )
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text)
    if document.robot != robot:
        text = f"recording {name!r} was made with {document.robot!r}; this robot is {robot!r}"
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text)
    columns = document.columns
    if column_fault(columns) is not None or columns[0] != TIME:
        fault = column_fault(columns, dof)
        place, problem = fault or ColumnFault(0, f"is {columns[0]!r}; accepted: {TIME!r} first")
        where = "columns" if place is None else f"columns[{place}]"
        return Refusal(VerdictCode.BAD_DOCUMENT, f"recording {name!r}: {where}: {problem}")
    joints = tuple(map(columns.index, _joint_columns(len(columns) - 1 - (GAP in columns))))
    if len(joints) != dof:
        text = (
            f"recording {name!r} has the columns {', '.join(columns)[:120]}; accepted:"
            f" {TIME}, then one for each of {dof} joints"
        )
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text, value=len(joints), limit=dof)
    return Extract(len(columns), joints)


@dataclass(slots=True)
class RowCount:
    """Count of the rows so far, taken in order.

    Attributes:
        first: time of the first [s].
        last: time of the last [s].
        gaps: between rows.
        longest_gap: the longest of them [s].
        in_gaps: time spent in them [s].
    """

    rows: int = 0
    first: float = 0.0
    last: float = 0.0
    gaps: int = 0
    longest_gap: float = 0.0
    in_gaps: float = 0.0

    @property
    def duration(self) -> float:
        """From the first to the last row [s]."""
        return self.last - self.first

    @property
    def rate(self) -> float:
        """Rows a second, gaps left out [Hz]; 0 where there are too few rows."""
        steps = self.rows - 1 - self.gaps
        covered = self.duration - self.in_gaps
        return steps / covered if steps > 0 and covered > 0.0 else 0.0

    @property
    def fields(self) -> dict[str, Any]:
        """The fields of a recording's description that say it."""
        return {
            "samples": self.rows,
            "duration": self.duration,
            "rate": self.rate,
            "gaps": self.gaps,
            "longest_gap": self.longest_gap,
        }

    def take(self, time: float, *, after_gap: bool = False) -> None:
        """Count the next row.

        Args:
            time: of the row [s].
            after_gap: True if a gap lies before it; before the first row there is none.
        """
        if not self.rows:
            self.first = time
        elif after_gap:
            gap = time - self.last
            self.gaps += 1
            self.longest_gap = max(self.longest_gap, gap)
            self.in_gaps += gap
        self.rows += 1
        self.last = time

    def take_more(self, rows: int, last: float) -> None:
        """Count rows that follow one that was taken, without a gap.

        Args:
            last: time of the last of them [s]; without meaning where there are none.
        """
        if rows:
            self.rows += rows
            self.last = last
