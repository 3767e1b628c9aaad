"""Every management operation: its request, its reply, who may ask for it, and the client's call.

Joins what four parts say: the server's models have the request, the client's calls the reply and
what each field means, the permissions the role. An operation without a call is an error here, so
that none is left out of the reference.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel

from openpendant.server.access.operations import AccessOperation
from openpendant.server.access.permissions import FREE_OPERATIONS, OF_OPERATION
from openpendant.server.access.roles import LEAST_ROLE, Permission, Role
from openpendant.server.jog.retreat_desk import RetreatReply, RetreatRequest
from openpendant.server.pendant.management import OPERATIONS
from openpendant.server.pendant.served_cells import ServedCells
from openpendant.server.pendant.snapshot import Snapshot
from openpendant.server.playback.operations import Operation as ProgramOperation
from openpendant.server.recording.operations import RecordingOperation
from openpendant.server.why import WhyReply
from openpendant.server.world.operations import WorldOperation

from ..pendants.management.access import AccessCalls, UserCalls
from ..pendants.management.calls import call
from ..pendants.management.cell import CellCalls
from ..pendants.management.devices import RobotCalls, SignalCalls, TraceCalls
from ..pendants.management.frames import FrameCalls
from ..pendants.management.programs import ProgramCalls
from ..pendants.management.recordings import RecordingCalls, play
from ..pendants.management.scene import SceneCalls
from ..pendants.management.tools import ToolCalls
from .docstrings import Docstring
from .typed_data import closed_model, with_models

GROUPS: Mapping[str, type] = {
    "": CellCalls,
    "programs": ProgramCalls,
    "recordings": RecordingCalls,
    "frames": FrameCalls,
    "tools": ToolCalls,
    "scene": SceneCalls,
    "signals": SignalCalls,
    "robots": RobotCalls,
    "trace": TraceCalls,
    "access": AccessCalls,
    "users": UserCalls,
}
"""Where a client has its calls, and what they are; the nameless group is the client itself."""

_OWN_REPLIES: Mapping[str, type[BaseModel]] = {
    "snapshot": Snapshot,
    "cells": ServedCells,
    "why": WhyReply,
    "jog.retreat": RetreatReply,
}
"""Replies for which the server has a model; of the others the client's types are published."""


@dataclass(frozen=True, slots=True)
class PublishedOperation:
    """One operation.

    Attributes:
        name: value of `op`.
        group: where the client has its call; empty for the client itself.
        make: the client's function that makes the request.
        request: the server's model of it.
        reply: model of what answers it.
        returned: what the client's call says of that, as a model.
        told: what the client's call says of itself.
    """

    name: str
    group: str
    make: Callable[..., Any]
    request: type[BaseModel]
    reply: Any
    returned: Any
    told: Docstring

    @property
    def permission(self) -> Permission | None:
        """What whoever asks needs; None for nothing."""
        return None if self.name in FREE_OPERATIONS else OF_OPERATION[self.name]

    @property
    def role(self) -> Role | None:
        """The least role that may ask; None for anybody that said hello."""
        return None if self.permission is None else LEAST_ROLE[self.permission]

    @property
    def arguments(self) -> tuple[inspect.Parameter, ...]:
        """What the client's call takes."""
        parameters = inspect.signature(self.make).parameters
        return tuple(each for name, each in parameters.items() if name != "self")

    @property
    def usage(self) -> str:
        """How the client's call is written."""
        takes = [
            each.name if each.default is each.empty else f"{each.name}=" for each in self.arguments
        ]
        path = ".".join(part for part in (self.group, self.make.__name__) if part)
        return f"{path}({', '.join(takes)})"


def request_models() -> dict[str, type[BaseModel]]:
    """Return the server's model of every request, by the value of `op`."""
    unions = (AccessOperation, ProgramOperation, RecordingOperation, WorldOperation)
    models = [model for union in unions for model in get_args(union)]
    found = {
        op: model
        for model in [*models, RetreatRequest]
        for op in get_args(model.model_fields["op"].annotation)
    }
    return {name: each.request for name, each in OPERATIONS.items()} | found


def _calls() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Return every call of the client with the group that has it."""
    for group, kind in GROUPS.items():
        for member in vars(kind).values():
            if isinstance(member, call):
                yield group, member.request
        if kind is RecordingCalls:
            yield group, play


def made_by(make: Callable[..., Any], **fields: Any) -> Any:
    """Return the request that a call makes of some fields, and of None for others it needs."""
    parameters = inspect.signature(make).parameters
    needed = {
        name: None
        for name, each in parameters.items()
        if each.default is each.empty and name not in fields
    }
    return make(**needed, **fields)


@cache
def published_operations() -> dict[str, PublishedOperation]:
    """Return every operation of the server, by name, in the order of the client's groups.

    Raises:
        LookupError: an operation has no call, or a call no operation.
    """
    models = request_models()
    found = {}
    for group, make in _calls():
        asked = made_by(make)
        (kind,) = get_args(get_type_hints(make)["return"])
        returned = with_models(kind)
        if asked.part:
            returned = closed_model("Reply", {asked.part: (returned, ...)})
        reply = _OWN_REPLIES.get(asked.op, returned)
        told = Docstring.of(make)
        found[asked.op] = PublishedOperation(
            asked.op, group, make, models[asked.op], reply, returned, told
        )
    missing = models.keys() - found.keys()
    if missing:
        raise LookupError(f"the client has no call for {', '.join(sorted(missing))}")
    return found
