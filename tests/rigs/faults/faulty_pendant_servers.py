"""Pendant servers that break one rule each, with the number of the check that has to find it.

Each is our own server with one method of its core replaced for the time of the test.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from openpendant.server.cell.execution.trajectory_execution import TrajectoryExecution
from openpendant.server.cell.robot_cell import RobotCell
from openpendant.server.cell.state_report import state_message
from openpendant.server.control.authority import AuthorityChange, Holder, MotionAuthority
from openpendant.server.endpoints.pendant.listeners import Listeners
from openpendant.server.endpoints.pendant.management import ManagementRequests
from openpendant.server.endpoints.pendant.motion_requests import PendantMotions
from openpendant.server.endpoints.pendant.notifications import Notifications
from openpendant.server.endpoints.pendant.pendant_endpoint import PendantEndpoint
from openpendant.server.events.cell_events import AuthorityTransferred, CellEvent, MotionEnded
from openpendant.server.events.effects import Effect, Send
from openpendant.server.refusal import Refusal
from openpendant.server.shell import client_connection
from openpendant.simplemsg import CommType, Message, Received
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityReason,
    HelloReply,
    JointMove,
    JointPath,
    Management,
    Outcome,
    PoseMove,
    PosePath,
    SoftwareStop,
    State,
    StopChanged,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

Plant = Callable[[pytest.MonkeyPatch], None]
Alter = Callable[[Any], None]


@dataclass(frozen=True)
class PendantFault:
    """One rule that a pendant server breaks."""

    name: str
    check: str
    plant: Plant


def _saying(kind: type[Message], change: Alter) -> Plant:
    """Return a plant that changes each message of a kind before it is sent to a pendant."""

    def plant(patch: pytest.MonkeyPatch) -> None:
        send = client_connection.ClientConnection.send

        def changed(self: client_connection.ClientConnection, message: Message) -> None:
            if isinstance(message, kind):
                message = dataclasses.replace(message)
                change(message)
            send(self, message)

        patch.setattr(client_connection.ClientConnection, "send", changed)

    return plant


def _showing(**values: Any) -> Plant:
    """Return a plant that shows other values in each state."""
    return _shown_as(lambda state: values)


def _shown_as(values: Callable[[State], dict[str, Any]]) -> Plant:
    def plant(patch: pytest.MonkeyPatch) -> None:
        make = state_message

        def changed(*arguments: Any) -> State:
            state = make(*arguments)
            return dataclasses.replace(state, **values(state))

        patch.setattr("openpendant.server.endpoints.pendant.notifications.state_message", changed)

    return plant


def _field(name: str, value: Any) -> Alter:
    return lambda message: setattr(message, name, value)


def _swapped(state: State) -> dict[str, Any]:
    first, second, *rest = state.positions
    return {"positions": (second, first, *rest)}


def _expired_goes_on(patch: pytest.MonkeyPatch) -> None:
    gone = RobotCell.authority_gone

    def changed(self: RobotCell, change: AuthorityChange | None, now: int) -> list[Effect]:
        if change is not None and change.reason is AuthorityReason.EXPIRED:
            return self._publish(AuthorityTransferred(change), now)
        return gone(self, change, now)

    patch.setattr(RobotCell, "authority_gone", changed)


def _reset_by_nobody(patch: pytest.MonkeyPatch) -> None:
    reset = RobotCell.reset_stop

    def changed(self: RobotCell, by: Holder, now: int) -> Any:
        if self.authority.holder is not None:
            return reset(self, by, now)
        self.authority.holder = by
        try:
            return reset(self, by, now)
        finally:
            self.authority.holder = None

    patch.setattr(RobotCell, "reset_stop", changed)


def _second_outcome(patch: pytest.MonkeyPatch) -> None:
    send = client_connection.ClientConnection.send

    def changed(self: client_connection.ClientConnection, message: Message) -> None:
        send(self, message)
        if isinstance(message, Outcome):
            asyncio.get_running_loop().call_later(0.6, send, self, message)

    patch.setattr(client_connection.ClientConnection, "send", changed)


def _told_to_holder_only(patch: pytest.MonkeyPatch) -> None:
    tell = Notifications.on_cell_event

    def changed(self: Notifications, news: CellEvent, now: int) -> list[Effect]:
        holder = self._cell.authority.holder
        return [
            item
            for item in tell(self, news, now)
            if not (isinstance(item, Send) and isinstance(item.message, StopChanged))
            or (holder is not None and item.session == holder.session)
        ]

    patch.setattr(Notifications, "on_cell_event", changed)


def _ten_times_as_fast(patch: pytest.MonkeyPatch) -> None:
    move = PendantMotions._move_joints

    def changed(
        self: PendantMotions, session: int, request_id: int, goal: Any, speed: float, now: int
    ) -> Any:
        return move(self, session, request_id, goal, min(1.0, 10 * speed), now)

    patch.setattr(PendantMotions, "_move_joints", changed)


def _fast_and_says_slow(patch: pytest.MonkeyPatch) -> None:
    _ten_times_as_fast(patch)
    _saying(Outcome, lambda outcome: setattr(outcome, "motion_time", 2.0))(patch)


def _end_of_stream_is_none(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(
        client_connection.ClientConnection, "eof_received", lambda self: True, raising=False
    )


def _anybody_beats(patch: pytest.MonkeyPatch) -> None:
    def beat(self: MotionAuthority, session: int, now: int) -> None:
        if self._deadline is not None:
            self._deadline = now + self._timeout_ns

    patch.setattr(MotionAuthority, "beat", beat)


def _beats_ignored(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(MotionAuthority, "beat", lambda self, session, now: None)


def _rate_capped(patch: pytest.MonkeyPatch) -> None:
    take = Listeners.set_rate

    def changed(self: Listeners, session: int, rate: float, now: int) -> None:
        take(self, session, min(rate, 25.0), now)

    patch.setattr(Listeners, "set_rate", changed)


def _accepts(kind: type[Message]) -> Plant:
    """Return a plant that accepts one kind of motion from anybody, and does nothing."""

    def plant(patch: pytest.MonkeyPatch) -> None:
        receive = PendantEndpoint.receive

        def changed(self: PendantEndpoint, session: int, received: Received, now: int) -> Any:
            if isinstance(received, kind) and not self._cell.authority.is_held_by(session):
                asked = getattr(received, "request_id", 0)
                return [Send(session, Verdict(asked, 0, -1, 0.0, 0.0, ""))]
            return receive(self, session, received, now)

        patch.setattr(PendantEndpoint, "receive", changed)

    return plant


def _snapshot_fails(patch: pytest.MonkeyPatch) -> None:
    answer = ManagementRequests.answer

    def changed(self: ManagementRequests, session: int, message: Management, *asked: Any) -> Any:
        if asked[0] == "snapshot":
            return self.reply_to(session, message).refuse(Refusal(VerdictCode.BAD_ARGUMENT))
        return answer(self, session, message, *asked)

    patch.setattr(ManagementRequests, "answer", changed)


def _topic_ignored(patch: pytest.MonkeyPatch) -> None:
    receive = PendantEndpoint.receive

    def changed(self: PendantEndpoint, session: int, received: Received, now: int) -> Any:
        if isinstance(received, SoftwareStop) and received.comm_type == CommType.TOPIC:
            return []
        return receive(self, session, received, now)

    patch.setattr(PendantEndpoint, "receive", changed)


def _clipped(patch: pytest.MonkeyPatch) -> None:
    receive = PendantEndpoint.receive

    def changed(self: PendantEndpoint, session: int, received: Received, now: int) -> Any:
        if isinstance(received, JointMove):
            limits = self._cell.limits
            ranges = zip(received.joints, limits.lower, limits.upper, strict=False)
            near = [
                max(lower, min(upper, value)) if abs(value) < 100 else value
                for value, lower, upper in ranges
            ]
            received.joints = (*near, *received.joints[len(near) :])
        return receive(self, session, received, now)

    patch.setattr(PendantEndpoint, "receive", changed)


def _no_stop_sent(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(TrajectoryExecution, "_halt", lambda self, now: [])


def _wrong_reason(change: AuthorityChanged) -> None:
    if change.reason == AuthorityReason.CONNECTION_LOST:
        change.reason = AuthorityReason.EXPIRED


def _lease_announced(change: HelloReply) -> None:
    change.authority_timeout *= 3


def _motion_survives_its_pendant(patch: pytest.MonkeyPatch) -> None:
    def closed(self: PendantEndpoint, session: int, now: int) -> list[Effect]:
        self._listeners.closed(session)
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        return [] if change is None else self._cell._publish(AuthorityTransferred(change), now)

    patch.setattr(PendantEndpoint, "closed", closed)


def _end_untold(patch: pytest.MonkeyPatch) -> None:
    tell = Notifications.on_cell_event

    def changed(self: Notifications, news: CellEvent, now: int) -> list[Effect]:
        return [] if isinstance(news, MotionEnded) else tell(self, news, now)

    patch.setattr(Notifications, "on_cell_event", changed)


PENDANT_FAULTS = (
    PendantFault("goes on after its lease", "PS43", _expired_goes_on),
    PendantFault("resets a stop for nobody", "PS41", _reset_by_nobody),
    PendantFault("swaps joints 1 and 2", "PS22", _shown_as(_swapped)),
    PendantFault("has no age", "PS17", _showing(age=0.0)),
    PendantFault("shows velocities at rest", "PS23", _showing(velocities=(9.0,) * 10)),
    PendantFault("doubles velocities in motion", "PS36",
        _shown_as(lambda state: {"velocities": tuple(2 * value for value in state.velocities)})),
    PendantFault("shows a holder where there is none", "PS23", _showing(holder=77)),
    PendantFault("shows another holder", "PS31", _showing(holder=77)),
    PendantFault("shows another request", "PS36", _showing(request_id=5)),
    PendantFault("took -3 s", "PS36", _saying(Outcome, _field("motion_time", -3.0))),
    PendantFault("tells an outcome twice", "PS36", _second_outcome),
    PendantFault("tells no outcome", "PS36", _end_untold),
    PendantFault("tells a stop to the holder only", "PS37", _told_to_holder_only),
    PendantFault("moves ten times as fast", "PS36", _ten_times_as_fast),
    PendantFault("moves fast and says slowly", "PS36", _fast_and_says_slow),
    PendantFault("announces three leases", "PS33", _saying(HelloReply, _lease_announced)),
    PendantFault("ignores beats", "PS33", _beats_ignored),
    PendantFault("keeps the authority after FIN", "PS34", _end_of_stream_is_none),
    PendantFault("goes on after FIN", "PS42", _end_of_stream_is_none),
    PendantFault("goes on after a lost link", "PS38", _motion_survives_its_pendant),
    PendantFault("takes anybody's beats", "PS44", _anybody_beats),
    PendantFault("sends state at 25 Hz at most", "PS16", _rate_capped),
    *(
        PendantFault(f"takes {kind.__name__} of anybody", "PS30", _accepts(kind))
        for kind in (JointMove, JointPath, PoseMove, PosePath)
    ),
    PendantFault("fails a snapshot", "PS24", _snapshot_fails),
    PendantFault("ignores a stop by topic", "PS40", _topic_ignored),
    PendantFault("clips a target to its range", "PS35", _clipped),
    PendantFault("sends the controller no STOP", "PS37", _no_stop_sent),
    PendantFault("names a wrong reason", "PS34", _saying(AuthorityChanged, _wrong_reason)),
)  # fmt: skip
