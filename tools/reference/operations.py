"""Every management operation: its request, its reply, who may ask for it, and the client's call.

Joins what four parts say: the server's models have the request, the client's calls the reply and
what each field means, the permissions the role. An operation without a call is an error here, so
that none is left out of the reference.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from pydantic import BaseModel

from openpendant.server.cell.why import WhyReply
from openpendant.server.endpoints.pendant.jog_requests import RetreatReply
from openpendant.server.endpoints.pendant.management import Snapshot
from openpendant.simplemsg.pendant.management import OPERATIONS as DECLARED
from openpendant.simplemsg.pendant.management.declaration import NeedsAuthority, Request
from openpendant.simplemsg.pendant.roles import LEAST_ROLE, Permission, Role

from ..pendants.management.calls import call, function_of
from ..pendants.management.groups import (
    AccessCalls,
    CellCalls,
    ControllerCalls,
    FrameCalls,
    KinematicsCalls,
    PlanCalls,
    PositionCalls,
    ProgramCalls,
    RecordingCalls,
    RobotCalls,
    SceneCalls,
    ShapeCalls,
    SignalCalls,
    ToolCalls,
    TraceCalls,
    UserCalls,
)
from .docstrings import Docstring, told_of, with_models


class CallSection(NamedTuple):
    """A group of the client's calls, and its heading."""

    calls: type
    title: str


GROUPS: Mapping[str, CallSection] = {
    "": CallSection(CellCalls, "The cell"),
    "programs": CallSection(ProgramCalls, "Programs"),
    "plans": CallSection(PlanCalls, "Plans"),
    "recordings": CallSection(RecordingCalls, "Recordings"),
    "frames": CallSection(FrameCalls, "User frames"),
    "positions": CallSection(PositionCalls, "Named positions"),
    "tools": CallSection(ToolCalls, "Tools"),
    "scene": CallSection(SceneCalls, "The scene"),
    "signals": CallSection(SignalCalls, "Signals"),
    "robots": CallSection(RobotCalls, "The robot itself"),
    "controller": CallSection(ControllerCalls, "The controller"),
    "kinematics": CallSection(KinematicsCalls, "Kinematics"),
    "shapes": CallSection(ShapeCalls, "Shapes and meshes"),
    "trace": CallSection(TraceCalls, "The trace of the tool"),
    "access": CallSection(AccessCalls, "Connections"),
    "users": CallSection(UserCalls, "Accounts"),
}
"""Where a client has its calls, and what they are; the nameless group is the client itself."""

_OWN_REPLIES: Mapping[str, type[BaseModel]] = {
    "snapshot": Snapshot,
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
        call: name of the client's call in it.
        reply: model of what answers it.
        returned: what the client's call says of that, as a model.
    """

    name: str
    group: str
    call: str
    request: type[Request[Any]]
    reply: Any
    returned: Any
    told: Docstring

    @property
    def permission(self) -> Permission | None:
        """What whoever asks needs; None for nothing."""
        return self.request.NEEDS

    @property
    def authority(self) -> NeedsAuthority:
        """When whoever asks must hold the motion authority."""
        return self.request.AUTHORITY

    @property
    def role(self) -> Role | None:
        """The least role that may ask; None for anybody that said hello."""
        return None if self.permission is None else LEAST_ROLE[self.permission]

    @property
    def arguments(self) -> tuple[inspect.Parameter, ...]:
        """What the client's call takes."""
        parameters = inspect.signature(function_of(self.request)).parameters
        return tuple(each for name, each in parameters.items() if name != "self")

    @property
    def usage(self) -> str:
        """How the client's call is written."""
        takes = [
            each.name if each.default is each.empty else f"{each.name}=" for each in self.arguments
        ]
        path = ".".join(part for part in (self.group, self.call) if part)
        return f"{path}({', '.join(takes)})"


def _calls() -> Iterator[tuple[str, str, Any]]:
    """Return every call of the client: the group that has it, its name, and the request."""
    for group, (kind, _) in GROUPS.items():
        for name, member in vars(kind).items():
            if isinstance(member, call):
                yield group, name, member.kind


@cache
def published_operations() -> dict[str, PublishedOperation]:
    """Return every operation of the server, by name, in the order of the client's groups.

    Raises:
        LookupError: an operation has no call, or a call no operation.
    """
    found = {}
    names = {kind: op for op, kind in DECLARED.items()}
    for group, name, request in _calls():
        op = names[request]
        returned = with_models(request.reply())
        reply = _OWN_REPLIES.get(op, returned)
        found[op] = PublishedOperation(op, group, name, request, reply, returned, told_of(request))
    missing = DECLARED.keys() - found.keys()
    if missing:
        raise LookupError(f"the client has no call for {', '.join(sorted(missing))}")
    return found
