"""What a recording is in the store: the description in its document and the columns of its rows.

Owns the columns, what counts as a gap between two reports, and how a description is read. A gap is
marked in the row that ends it and never filled; the samples of a file without that column may have
gaps, too, which their times then tell. Knows no robot and no clock.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..field_fault import field_fault
from ..refusal import Refusal

TIME, GAP = "t", "gap"

GAP_PERIODS = 2.5
"""Reports further apart than so many of their periods have a gap between them."""


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
    """What is wrong with the columns of a recording.

    Attributes:
        place: of the column at fault, from 0; None where one is missing.
        problem: what is wrong and what would be accepted.
    """

    place: int | None
    problem: str


def column_fault(columns: Sequence[str], joints: int | None = None) -> ColumnFault | None:
    """Return what is wrong with the columns of a row; None where each is there that has to be.

    Its name alone tells what is in a column, so their order is free and any other name is refused.

    Args:
        columns: their names.
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
    """Return the description of a recording that begins."""
    return RecordingDocument(
        columns=(TIME, *_joint_columns(len(joints)), GAP),
        robot=robot,
        joints=tuple(joints),
        period=period,
        finished=False,
    )


def read_document(name: str, body: str) -> RecordingDocument | Refusal:
    """Return a recording's description.

    Args:
        name: of the recording, for the refusal.
        body: of its document.
    """
    try:
        return RecordingDocument.model_validate_json(body)
    except ValidationError as error:
        text = f"recording {name!r}: {field_fault(error)}"
        return Refusal(VerdictCode.BAD_DOCUMENT, text[:400])


def write_document(document: RecordingDocument) -> str:
    """Return the body of a recording's document."""
    return json.dumps(document.model_dump(), ensure_ascii=False)


def extract_for(name: str, document: RecordingDocument, robot: str, dof: int) -> Extract | Refusal:
    """Return where the joints are in the rows, if the recording is one of this robot.

    Args:
        name: of the recording, for the refusal.
        document: its description.
        robot: name of the robot that is to play it.
        dof: number of its joints.
    """
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
