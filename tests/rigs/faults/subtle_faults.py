"""What single faults of a server do now and then: in motion, or in one field of many.

`server_faults.toml` names them, and the checks that must find each.
"""

import asyncio
import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping

from rigs.faults.faulty_servers import (
    FaultyLink,
    FaultyService,
    MessageIn,
    StateOut,
    count,
    each,
    each_frame,
    each_point,
    feedback,
    frame,
    header,
    is_request,
    is_stop,
    patched,
)

from openpendant import simplemsg as wire
from openpendant.controller_emulator.core.controller import EmulatedController, Outgoing
from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.simplemsg.pendant import OperatorAction

_END = 2.0
"""Either end of the range of both joints [rad]."""


def _takes(link: FaultyLink, message: wire.Message) -> tuple[wire.Received, ...]:
    """Say that a message is taken, and do nothing."""
    if is_request(message):
        link.answer(wire.accepted(message))
    return ()


# What is told.


def _status(change: Callable[[FaultyService, wire.Status], Mapping[str, int]]) -> StateOut:
    return each(
        lambda service, message: (
            dataclasses.replace(message, **change(service, message))
            if isinstance(message, wire.Status)
            else message
        )
    )


def in_motion(**values: int) -> StateOut:
    return _status(lambda _, message: values if message.in_motion == 1 else {})


@_status
def flickering(service: FaultyService, message: wire.Status) -> Mapping[str, int]:
    is_fifth = message.in_motion == 1 and count(service.memory, "told") % 5 == 0
    return {"in_motion": 0} if is_fifth else {}


@_status
def hasty(service: FaultyService, message: wire.Status) -> Mapping[str, int]:
    """Say that the robot stands for its last two thousandths."""
    goal = service.memory.get("goal")
    if message.in_motion != 1 or goal is None:
        return {}
    off = abs(service.controller.motion(service.now)[0][1] - goal)
    return {"in_motion": 0} if 1e-9 < off < 0.0018 else {}


def remembers_goal(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
    if isinstance(received, wire.JointTrajPt) and not is_stop(received):
        link.service.memory["goal"] = received.joints[1]
    return (received,)


@each
def numbered_in_motion(service: FaultyService, message: wire.Message) -> wire.Message:
    if isinstance(message, wire.JointPosition) and service.is_moving:
        return dataclasses.replace(message, sequence=7)
    return message


def bursts(pause: float) -> StateOut:
    def apply(service: FaultyService, messages: list[wire.Message]) -> list[wire.Message | bytes]:
        return list(messages) if service.loop_time % (pause + 0.04) < 0.04 else []

    return apply


class _AgeingLink(FaultyLink):
    """Knows how old it is, and how long nothing came."""

    _opened = 0.0
    _heard = 0.0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._opened = self._heard = self.service.loop_time
        super().connection_made(transport)

    def data_received(self, data: bytes) -> None:
        self._heard = self.service.loop_time
        super().data_received(data)

    @property
    def age(self) -> float:
        return self.service.loop_time - self._opened

    @property
    def idle(self) -> float:
        return self.service.loop_time - self._heard


class LateLink(_AgeingLink):
    def send_state(self, frames: bytes, now: int) -> None:
        if self.age > 2.0:
            super().send_state(frames, now)


class TiringLink(_AgeingLink):
    def send_state(self, frames: bytes, now: int) -> None:
        if self.age < 6.0:
            super().send_state(frames, now)


class ImpatientLink(_AgeingLink):
    def check_deadlines(self, now: int) -> None:
        if self.is_motion and self.idle > 3.0:
            self.abort()
            return
        super().check_deadlines(now)


# What is answered.


def talkative_refusals(link: FaultyLink, data: bytes) -> bytes:
    _, kind, comm, code = header(data)
    return frame(kind, comm, code, b"\x2a" * 40) if code == 2 else data


def busy(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
    return () if isinstance(received, wire.Ping) and link.service.is_moving else (received,)


def marks_stop(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
    link.memory["late"] = is_stop(received) and link.service.is_moving
    return (received,)


def late_stop_reply(link: FaultyLink, data: bytes) -> bytes:
    if header(data)[1] != 11 or not link.memory.pop("late", False):
        return data
    link.later(0.9, lambda: link.write(data))
    return b""


def swallows_large_frames(link: FaultyLink, data: bytes) -> bytes:
    size = 4 + int.from_bytes(data[:4], "little") if len(data) >= 4 else 0
    return b"" if 1024 <= size <= 3000 and len(data) == size else data


def floods(link: FaultyLink, data: bytes) -> bytes:
    """Send a topic before each reply, as a controller of one port for everything would."""
    return frame(10, 1, 0, bytes(44)) + data


@each_frame
def topics_as_requests(data: bytes) -> bytes:
    return patched(data, 8, wire.CommType.REQUEST) if header(data)[1] == 10 else data


# What is done.


class BrakesAtRestOnly(EmulatedController):
    """Shows an emergency stop, and goes on with the motion."""

    def _break_off(self, code: ErrorCode | None, now: int) -> None:
        if not self._e_stopped or self._servo.at_rest:
            super()._break_off(code, now)


class ResumesAfterReset(EmulatedController):
    """Goes on to the last target when an emergency stop is reset."""

    _last: wire.JointTrajPt | None = None

    def handle(self, link: int, message: wire.Received, now: int) -> Outgoing:
        out = super().handle(link, message, now)
        if isinstance(message, wire.JointTrajPt) and message.sequence == 1:
            self._last = message
        return out

    def _operate_by(self, action: int, now: int) -> bool:
        done = super()._operate_by(action, now)
        if done and action == OperatorAction.RESET and self._last is not None:
            again = dataclasses.replace(
                self._last, sequence=0, duration=0.5, comm_type=wire.CommType.TOPIC
            )
            self._handle_points(0, again, now)
        return done


class StaysPowered(EmulatedController):
    def status(self, now: int) -> wire.Status:
        return dataclasses.replace(super().status(now), drives_powered=1)


class MindsNoEarlyLoss(EmulatedController):
    """Begins although its client left between the last point and the first motion."""

    def disconnected(self, link: int, now: int) -> Outgoing:
        self._run(now)
        speeds = self._servo.sample(now)[1]
        if link == self._taking.owner and not self._servo.at_rest and not any(speeds):
            return []
        return super().disconnected(link, now)


def _unchecked(applies: Callable[[wire.JointTrajPt], bool]) -> MessageIn:
    """Take some points without a look at them; they move nothing."""

    def change(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
        if isinstance(received, wire.JointTrajPt) and not is_stop(received) and applies(received):
            return _takes(link, received)
        return (received,)

    return change


def _is_out(value: float) -> bool:
    return math.isfinite(value) and abs(value) > _END


def _is_none(value: float) -> bool:
    return not math.isfinite(value)


@each_point
def ends_short(point: wire.JointTrajPt) -> wire.JointTrajPt:
    way = point.joints[1] - 0.4
    if point.sequence < 1 or abs(way) <= 0.02:
        return point
    joint = point.joints[1] - math.copysign(0.004, way)
    return dataclasses.replace(point, joints=(point.joints[0], joint, *point.joints[2:]))


def refuses_dwells(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
    if not isinstance(received, wire.JointTrajPt) or is_stop(received):
        return (received,)
    before, link.memory["last"] = link.memory.get("last"), received
    is_dwell = before is not None and before.joints == received.joints
    if is_dwell and received.sequence > 1:
        link.answer(dataclasses.replace(wire.accepted(received), reply_code=2))
        return ()
    return (received,)


def no_look_at(*fields: str) -> MessageIn:
    def change(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
        if isinstance(received, wire.JointTrajPtFull):
            values = [getattr(received, name) for name in fields]
            reals = [
                v for value in values for v in (value if isinstance(value, tuple) else (value,))
            ]
            if not all(map(math.isfinite, reals)):
                return _takes(link, received)
        return (received,)

    return change


def pushes_on(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
    """Go on by 45 % of the way, faster than before, when told to stop."""
    if isinstance(received, wire.JointTrajPt) and not is_stop(received):
        link.memory.setdefault("points", {})[received.sequence] = received.joints
    points = link.memory.get("points", {})
    if is_stop(received) and link.service.is_moving and {0, 1} <= set(points):
        at = link.service.controller.motion(link.service.now)[0]
        goal = at[1] + 0.45 * (points[1][1] - points[0][1])
        point = wire.JointTrajPt(
            0, (at[0], goal, *[0.0] * 8), 0.1, 0.3, comm_type=wire.CommType.TOPIC
        )
        link.later(0.05, lambda: link.service.obey(link, point))
    return (received,)


slower = each_point(lambda point: dataclasses.replace(point, duration=1.8 * point.duration))


# What is told.

stale_accelerations = feedback(
    accelerations=lambda _: (9.9,) * 10, valid_fields=lambda told: told.valid_fields & ~8
)
fast_velocities = feedback(velocities=lambda told: tuple(1.4 * v for v in told.velocities))

# Which points are changed, or taken without a look.

range_of_first_points = _unchecked(lambda p: p.sequence > 0 and any(map(_is_out, p.joints)))
range_of_joint_2 = _unchecked(lambda p: _is_out(p.joints[0]))
numbers_of_first_points = _unchecked(lambda p: p.sequence > 0 and any(map(_is_none, p.joints)))
numbers_of_joint_2 = _unchecked(lambda p: _is_none(p.joints[0]))
