"""Management requests: data without a fixed layout, as JSON objects checked by pydantic models.

Owns the table of operations that are answered at once from the cell's own data. An operation is a
model of its request and a function, in a file of its own, and one line of the table. Requests about
programs, recordings and the world have tables of their own, found by how their names begin.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..robot_cell import RobotCell
from ..settings import CellSettings
from ..why import RoleFault, WhyRequest, why
from ..world.cell_surroundings import CellSurroundings
from .management_bodies import Body, body_fault
from .served_cells import CellsRequest, ServedCells
from .snapshot import SnapshotRequest, snapshot

_LONGEST_NAME = 40


class Failure(Body):
    """A refused management request."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    code: int
    """Entry of the catalogue."""
    text: str
    """One sentence with the numbers."""
    joint: int = -1
    """Index of the joint at fault, -1 for none."""
    value: float = 0.0
    """The value at fault, SI."""
    limit: float = 0.0
    """The limit that it breaks, SI."""
    line: int | None = None
    """Where a program's text is wrong, from 1; left out where none is."""
    column: int | None = None
    """Likewise."""


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
        around: what surrounds the robot; None in a cell without.
        served: all cells of the server.
        role: tells whose role is too low to move the robot; None where everybody may.
    """

    cell: RobotCell
    settings: CellSettings
    session: int
    now: int
    around: CellSurroundings | None
    served: ServedCells
    role: RoleFault | None


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
        SnapshotRequest,
        lambda _, asked: snapshot(asked.cell, asked.settings, asked.now, asked.around),
    ),
    "cells": Operation(CellsRequest, lambda _, asked: asked.served),
    "why": Operation(
        WhyRequest,
        lambda request, asked: why(
            asked.cell,
            asked.settings.name,
            request,
            asked.session,
            asked.now,
            None if asked.around is None else asked.around.contact,
            asked.role,
        ),
    ),
}
"""Every operation by the value of `op`."""


class _AnyRequest(BaseModel):
    """What all requests have, to find the operation by."""

    model_config = ConfigDict(frozen=True)

    op: str


def answer_management(
    body: bytes,
    cell: RobotCell,
    settings: CellSettings,
    now: int,
    session: int = 0,
    around: CellSurroundings | None = None,
    served: ServedCells | None = None,
    role: RoleFault | None = None,
) -> Answer:
    """Carry out one management request.

    Args:
        body: its JSON object.
        cell: the cell it is about.
        settings: the cell's configuration.
        now: monotonic time, ns.
        session: who asks; 0 for nobody in particular.
        around: what surrounds the robot; None in a cell without.
        served: all cells of the server; None for this one alone.
        role: tells whose role is too low to move the robot; None where everybody may.
    """
    try:
        named = _AnyRequest.model_validate_json(body).op
        operation = OPERATIONS.get(named)
        if operation is None:
            text = f"op: {named[:_LONGEST_NAME]!r}; accepted: {', '.join(OPERATIONS)}"
            return _failure(VerdictCode.BAD_ARGUMENT, text)
        request = operation.request.model_validate_json(body)
    except ValidationError as error:
        fault = body_fault(error)
        return _failure(fault.code, fault.text)
    served = served or ServedCells.of([(settings.name, settings.robot)])
    answer = operation.answer(request, Asked(cell, settings, session, now, around, served, role))
    return Answer(answer.model_dump_json().encode(), ok=True)


def _failure(code: VerdictCode, text: str) -> Answer:
    failure = Failure(code=code, text=text).model_dump(exclude_none=True)
    return Answer(json.dumps(failure).encode(), ok=False)
