"""Management requests: data without a fixed layout, as JSON objects checked by pydantic models.

So far one operation: `snapshot`, everything a pendant needs to know once, before the deltas.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from .robot_cell import RobotCell
from .settings import CellSettings

_LONGEST_TEXT = 400


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SnapshotRequest(_Body):
    """Asks for the whole state of the cell."""

    op: Literal["snapshot"]


class JointDescription(_Body):
    """One driven joint, controller side; rad, or m for a linear axis."""

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float


class OwnerDescription(_Body):
    """Who holds the motion authority."""

    session: int
    client: str


class StopDescription(_Body):
    """The latched software stop."""

    session: int
    client: str
    reason: str


class Snapshot(_Body):
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


class Failure(_Body):
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


def answer_management(body: bytes, cell: RobotCell, settings: CellSettings, now: int) -> Answer:
    """Carry out one management request.

    Args:
        body: its JSON object.
        cell: the cell it is about.
        settings: the cell's configuration.
        now: monotonic time, ns.
    """
    try:
        SnapshotRequest.model_validate_json(body)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        text = f"{where}: {first['msg']}" if where else first["msg"]
        # A place may be as long as the request, and the answer has to fit a frame.
        return _failure(VerdictCode.BAD_ARGUMENT, text[-_LONGEST_TEXT:])
    return Answer(snapshot(cell, settings, now).model_dump_json().encode(), ok=True)


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
