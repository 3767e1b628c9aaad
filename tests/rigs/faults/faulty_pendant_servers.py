"""Pendant servers that break one rule each, with the number of the check that has to find it.

Each is our own server with one method of its core replaced for the time of the test.
"""

import asyncio
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from openpendant.server.cell.execution.trajectory_execution import TrajectoryExecution
from openpendant.server.cell.robot_cell import RobotCell
from openpendant.server.cell.state_report import state_message
from openpendant.server.control import AuthorityChange, Holder, MotionAuthority
from openpendant.server.endpoints.pendant.management import ManagementRequests
from openpendant.server.endpoints.pendant.motion_requests import PendantMotions
from openpendant.server.endpoints.pendant.notifications import Listeners, Notifications
from openpendant.server.endpoints.pendant.pendant_endpoint import PendantEndpoint
from openpendant.server.events.cell_events import AuthorityTransferred, CellEvent, MotionEnded
from openpendant.server.events.effects import Effect, LogLine, Send
from openpendant.server.refusal import Refusal
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.simplemsg import CommType, Message, Received
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode

Plant = Callable[[pytest.MonkeyPatch], None]
Alter = Callable[[Any], None]
Change = Callable[..., Any]
"""A method that a fault is put round."""


@dataclass(frozen=True)
class PendantFault:
    """One rule that a pendant server breaks."""

    name: str
    check: str
    plant: Plant


def _around(owner: type, name: str, changed: Change) -> Plant:
    def plant(patch: pytest.MonkeyPatch) -> None:
        method = getattr(owner, name)
        patch.setattr(owner, name, lambda *given, **named: changed(method, *given, **named))

    return plant


def _instead(owner: type, name: str, other: Change) -> Plant:
    return lambda patch: patch.setattr(owner, name, other, raising=False)


def _saying(kind: type[Message], change: Alter) -> Plant:
    """Return a plant that changes each message of a kind before it is sent to a pendant."""

    def changed(send: Change, connection: ClientConnection, message: Message) -> None:
        if isinstance(message, kind):
            message = dataclasses.replace(message)
            change(message)
        send(connection, message)

    return _around(ClientConnection, "send", changed)


def _showing(**values: Any) -> Plant:
    return _shown_as(lambda state: values)


def _shown_as(values: Callable[[messages.State], dict[str, Any]]) -> Plant:
    def changed(*arguments: Any) -> messages.State:
        state = state_message(*arguments)
        return dataclasses.replace(state, **values(state))

    place = "openpendant.server.endpoints.pendant.notifications.state_message"
    return lambda patch: patch.setattr(place, changed)


def _field(name: str, value: Any) -> Alter:
    return lambda message: setattr(message, name, value)


def _swapped(state: messages.State) -> dict[str, Any]:
    first, second, *rest = state.positions
    return {"positions": (second, first, *rest)}


def _expired_goes_on(
    gone: Change, cell: RobotCell, change: AuthorityChange | None, now: int
) -> Any:
    if change is not None and change.reason is messages.AuthorityReason.EXPIRED:
        return cell._publish(AuthorityTransferred(change), now)
    return gone(cell, change, now)


def _reset_by_nobody(reset: Change, cell: RobotCell, by: Holder, now: int) -> Any:
    if cell.authority.holder is not None:
        return reset(cell, by, now)
    cell.authority.holder = by
    try:
        return reset(cell, by, now)
    finally:
        cell.authority.holder = None


def _second_outcome(send: Change, connection: ClientConnection, message: Message) -> None:
    send(connection, message)
    if isinstance(message, messages.Outcome):
        asyncio.get_running_loop().call_later(0.6, send, connection, message)


def _told_to_holder_only(
    tell: Change, told: Notifications, news: CellEvent, now: int
) -> list[Effect]:
    holder = told._cell.authority.holder
    return [
        item
        for item in tell(told, news, now)
        if not (isinstance(item, Send) and isinstance(item.message, messages.StopChanged))
        or (holder is not None and item.session == holder.session)
    ]


def _ten_times_as_fast(
    move: Change,
    motions: PendantMotions,
    session: int,
    asked: int,
    goal: Any,
    speed: float,
    now: int,
) -> Any:
    return move(motions, session, asked, goal, min(1.0, 10 * speed), now)


_FAST = _around(PendantMotions, "_move_joints", _ten_times_as_fast)


def _fast_and_says_slow(patch: pytest.MonkeyPatch) -> None:
    _FAST(patch)
    _saying(messages.Outcome, _field("motion_time", 2.0))(patch)


_FIN_IGNORED = _instead(ClientConnection, "eof_received", lambda self: True)


def _anybody_beats(authority: MotionAuthority, session: int, now: int) -> None:
    if authority._deadline is not None:
        authority._deadline = now + authority._timeout_ns


def _rate_capped(take: Change, listeners: Listeners, session: int, rate: float, now: int) -> None:
    take(listeners, session, min(rate, 25.0), now)


def _accepts(kind: type[Message]) -> Plant:
    """Return a plant that accepts one kind of motion from anybody, and does nothing."""

    def changed(
        receive: Change, endpoint: PendantEndpoint, session: int, received: Received, now: int
    ) -> Any:
        if isinstance(received, kind) and not endpoint._cell.authority.is_held_by(session):
            asked = getattr(received, "request_id", 0)
            return [Send(session, messages.Verdict(asked, 0, -1, 0.0, 0.0, ""))]
        return receive(endpoint, session, received, now)

    return _around(PendantEndpoint, "receive", changed)


def _snapshot_fails(
    answer: Change,
    requests: ManagementRequests,
    session: int,
    message: messages.Management,
    *asked: Any,
) -> Any:
    if asked[0] == "snapshot":
        return requests.reply_to(session, message).refuse(Refusal(VerdictCode.BAD_ARGUMENT))
    return answer(requests, session, message, *asked)


def _topic_ignored(
    receive: Change, endpoint: PendantEndpoint, session: int, received: Received, now: int
) -> Any:
    if isinstance(received, messages.SoftwareStop) and received.comm_type == CommType.TOPIC:
        return []
    return receive(endpoint, session, received, now)


def _clipped(
    receive: Change, endpoint: PendantEndpoint, session: int, received: Received, now: int
) -> Any:
    if isinstance(received, messages.JointMove):
        limits = endpoint._cell.limits
        ranges = zip(received.joints, limits.lower, limits.upper, strict=False)
        near = [
            max(lower, min(upper, value)) if abs(value) < 100 else value
            for value, lower, upper in ranges
        ]
        received.joints = (*near, *received.joints[len(near) :])
    return receive(endpoint, session, received, now)


def _wrong_reason(change: messages.AuthorityChanged) -> None:
    if change.reason == messages.AuthorityReason.CONNECTION_LOST:
        change.reason = messages.AuthorityReason.EXPIRED


def _lease_announced(change: messages.HelloReply) -> None:
    change.authority_timeout *= 3


def _motion_survives_its_pendant(endpoint: PendantEndpoint, session: int, now: int) -> list[Effect]:
    endpoint._listeners.closed(session)
    change = endpoint._cell.authority.release(session, messages.AuthorityReason.CONNECTION_LOST)
    return [] if change is None else endpoint._cell._publish(AuthorityTransferred(change), now)


def _end_untold(tell: Change, told: Notifications, news: CellEvent, now: int) -> Any:
    return [] if isinstance(news, MotionEnded) else tell(told, news, now)


_ROWS: tuple[tuple[str, str, Plant], ...] = (
    ("goes on after its lease", "PS43", _around(RobotCell, "authority_gone", _expired_goes_on)),
    ("resets a stop for nobody", "PS41", _around(RobotCell, "reset_stop", _reset_by_nobody)),
    ("swaps joints 1 and 2", "PS22", _shown_as(_swapped)),
    ("has no age", "PS17", _showing(age=0.0)),
    ("shows velocities at rest", "PS23", _showing(velocities=(9.0,) * 10)),
    (
        "doubles velocities in motion",
        "PS36",
        _shown_as(lambda state: {"velocities": tuple(2 * value for value in state.velocities)}),
    ),
    ("shows a holder where there is none", "PS23", _showing(holder=77)),
    ("shows another holder", "PS31", _showing(holder=77)),
    ("shows another request", "PS36", _showing(request_id=5)),
    ("took -3 s", "PS36", _saying(messages.Outcome, _field("motion_time", -3.0))),
    ("tells an outcome twice", "PS36", _around(ClientConnection, "send", _second_outcome)),
    ("tells no outcome", "PS36", _around(Notifications, "on_cell_event", _end_untold)),
    (
        "tells a stop to the holder only",
        "PS37",
        _around(Notifications, "on_cell_event", _told_to_holder_only),
    ),
    ("moves ten times as fast", "PS36", _FAST),
    ("moves fast and says slowly", "PS36", _fast_and_says_slow),
    ("announces three leases", "PS33", _saying(messages.HelloReply, _lease_announced)),
    ("ignores beats", "PS33", _instead(MotionAuthority, "beat", lambda *_: None)),
    ("keeps the authority after FIN", "PS34", _FIN_IGNORED),
    ("goes on after FIN", "PS42", _FIN_IGNORED),
    (
        "goes on after a lost link",
        "PS38",
        _instead(PendantEndpoint, "closed", _motion_survives_its_pendant),
    ),
    ("takes anybody's beats", "PS44", _instead(MotionAuthority, "beat", _anybody_beats)),
    ("sends state at 25 Hz at most", "PS16", _around(Listeners, "set_rate", _rate_capped)),
    *(
        (f"takes {kind.__name__} of anybody", "PS30", _accepts(kind))
        for kind in (messages.JointMove, messages.JointPath, messages.PoseMove, messages.PosePath)
    ),
    ("fails a snapshot", "PS24", _around(ManagementRequests, "answer", _snapshot_fails)),
    ("ignores a stop by topic", "PS40", _around(PendantEndpoint, "receive", _topic_ignored)),
    ("clips a target to its range", "PS35", _around(PendantEndpoint, "receive", _clipped)),
    (
        "sends the controller no STOP",
        "PS37",
        _instead(TrajectoryExecution, "stop", lambda *_: LogLine("no STOP")),
    ),
    ("names a wrong reason", "PS34", _saying(messages.AuthorityChanged, _wrong_reason)),
)

PENDANT_FAULTS = [PendantFault(*row) for row in _ROWS]
