"""Management requests: data without a fixed layout, as JSON objects checked by pydantic models.

Owns the table of operations that are answered at once from the cell's own data. An operation is a
model of its request and a function, in a file of its own, and one line of the table. Requests about
programs are answered later and have their own table (`program_operations`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..robot_cell import RobotCell
from ..settings import CellSettings
from ..why import WhyRequest, why
from .management_bodies import Body

_LONGEST_TEXT = 400
_LONGEST_NAME = 40


class SnapshotRequest(Body):
    """Asks for the whole state of the cell."""

    op: Literal["snapshot"]


class JointDescription(Body):
    """One driven joint, controller side; rad, or m for a linear axis."""

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float


class OwnerDescription(Body):
    """Who holds the motion authority."""

    session: int
    client: str


class StopDescription(Body):
    """The latched software stop."""

    session: int
    client: str
    reason: str


class Snapshot(Body):
    """The cell as it is now."""

    cell: str
    robot: str
    joints: tuple[JointDescription, ...]
    frames: tuple[str, ...]
    activity: str
    link: str
    mode: str
    owner: OwnerDescription | None
    stop: StopDescription | None
    obstacle: str


class Failure(Body):
    """A refused management request."""

    code: int
    text: str


@dataclass(frozen=True, slots=True)
class Answer:
    """The reply's body.

    Attributes:
        text: one JSON object, UTF-8.
        ok: whether the request was carried out.
    """

    text: bytes
    ok: bool


@dataclass(frozen=True, slots=True)
class Asked:
    """What an operation may look at.

    Attributes:
        cell: the cell that the request is about.
        settings: its configuration.
        session: who asks.
        now: monotonic time, ns.
    """

    cell: RobotCell
    settings: CellSettings
    session: int
    now: int


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation.

    Attributes:
        request: the model of its request.
        answer: carries out a request of this model.
    """

    request: type[BaseModel]
    answer: Callable[[Any, Asked], BaseModel]


OPERATIONS: Mapping[str, Operation] = {
    "snapshot": Operation(
        SnapshotRequest, lambda _, asked: snapshot(asked.cell, asked.settings, asked.now)
    ),
    "why": Operation(
        WhyRequest,
        lambda request, asked: why(
            asked.cell, asked.settings.name, request, asked.session, asked.now
        ),
    ),
}
"""Every operation by the value of `op`."""


class _AnyRequest(BaseModel):
    """What all requests have, to find the operation by."""

    model_config = ConfigDict(frozen=True)

    op: str


def answer_management(
    body: bytes, cell: RobotCell, settings: CellSettings, now: int, session: int = 0
) -> Answer:
    """Carry out one management request.

    Args:
        body: its JSON object.
        cell: the cell it is about.
        settings: the cell's configuration.
        now: monotonic time, ns.
        session: who asks; 0 for nobody in particular.
    """
    try:
        named = _AnyRequest.model_validate_json(body).op
        operation = OPERATIONS.get(named)
        if operation is None:
            text = f"op: {named[:_LONGEST_NAME]!r}; accepted: {', '.join(OPERATIONS)}"
            return _failure(VerdictCode.BAD_ARGUMENT, text)
        request = operation.request.model_validate_json(body)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        text = f"{where}: {first['msg']}" if where else first["msg"]
        # A place may be as long as the request, and the answer has to fit a frame.
        return _failure(VerdictCode.BAD_ARGUMENT, text[-_LONGEST_TEXT:])
    answer = operation.answer(request, Asked(cell, settings, session, now))
    return Answer(answer.model_dump_json().encode(), ok=True)


def _failure(code: VerdictCode, text: str) -> Answer:
    return Answer(json.dumps(Failure(code=code, text=text).model_dump()).encode(), ok=False)


def snapshot(cell: RobotCell, settings: CellSettings, now: int) -> Snapshot:
    """Return the cell as it is now."""
    limits = cell.limits
    holder, stop, obstacle = cell.authority.holder, cell.stop, cell.obstacle(now)
    return Snapshot(
        cell=settings.name,
        robot=settings.robot,
        joints=tuple(
            JointDescription(
                name=limits.names[index],
                unit="m" if limits.prismatic[index] else "rad",
                lower=limits.lower[index],
                upper=limits.upper[index],
                velocity=limits.velocity[index],
                acceleration=limits.acceleration[index],
            )
            for index in range(limits.dof)
        ),
        frames=("base", "root"),
        activity=cell.activity.name.lower(),
        link=cell.link_state(now).name.lower(),
        mode=cell.mode.name.lower(),
        owner=None
        if holder is None
        else OwnerDescription(session=holder.session, client=holder.client),
        stop=None
        if stop is None
        else StopDescription(session=stop.by.session, client=stop.by.client, reason=stop.reason),
        obstacle="" if obstacle is None else obstacle.sentence,
    )
