"""What single faults of a server do to its reports, its motion and its links.

`server_faults.toml` names them, and the checks that must find each.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import TypeGuard

from rigs.faults.faulty_servers import (
    BytesChange,
    FaultyLink,
    FaultyService,
    MessageIn,
    StateOut,
    count,
    disobeying,
    each,
    each_frame,
    each_point,
    feedback,
    frame,
    header,
    ignoring,
    is_request,
    is_stop,
    patched,
)

from openpendant.controller_emulator.core.controller import EmulatedController, Outgoing
from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.controller_emulator.interpolation.segment import State
from openpendant.controller_emulator.shell.links import EmulatorLink
from openpendant.simplemsg import (
    CommType,
    JointFeedback,
    JointPosition,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Malformed,
    Message,
    Received,
    Status,
    accepted,
)


def status(**values: int) -> StateOut:
    return each(
        lambda _, told: dataclasses.replace(told, **values) if isinstance(told, Status) else told
    )


def _joints(change: Callable[[tuple[float, ...]], tuple[float, ...]]) -> StateOut:
    def apply(_: FaultyService, message: Message) -> Message:
        if isinstance(message, JointPosition):
            return dataclasses.replace(message, joints=change(message.joints))
        if isinstance(message, JointFeedback):
            return dataclasses.replace(message, positions=change(message.positions))
        return message

    return each(apply)


def pauses(while_moving: bool) -> StateOut:
    def apply(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
        moving = service.is_moving
        silent = service.loop_time % 2.0 < 0.8
        return [] if silent and (moving or not while_moving) else list(messages)

    return apply


@each
def status_now_and_then(service: FaultyService, message: Message) -> Message | None:
    return None if isinstance(message, Status) and service.loop_time % 3.0 > 0.1 else message


def status_first(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return sorted(messages, key=lambda message: not isinstance(message, Status))


def counting(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    number = count(service.memory, "rounds")
    return [
        dataclasses.replace(told, sequence=number) if isinstance(told, JointPosition) else told
        for told in messages
    ]


@each_frame
def longer_status(data: bytes) -> bytes:
    return patched(data, 0, len(data)) + bytes(4) if header(data)[1] == 13 else data


def noise(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    off = 0.01 * math.sin(service.loop_time * 20)
    return _joints(lambda joints: (joints[0] + off, *joints[1:]))(service, messages)


class FirstListenersOnly(FaultyLink):
    def send_state(self, frames: bytes, now: int) -> None:
        if self.number < 5:
            super().send_state(frames, now)


def jumping(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    moving = service.is_moving
    off = 0.04 if count(service.memory, "rounds") % 20 == 0 and moving else 0.0
    return _joints(lambda joints: (joints[0], joints[1] + off, *joints[2:]))(service, messages)


def flickering(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return status(drives_powered=count(service.memory, "rounds") // 50 % 2)(service, messages)


class LaggingStatus(EmulatedController):
    """Says that it moves for two seconds after it stood."""

    _stood = -(10**18)

    def status(self, now: int) -> Status:
        status = super().status(now)
        if status.in_motion:
            self._stood = now
        status.in_motion = int(now - self._stood < 2_000_000_000)
        return status


class HastyStatus(EmulatedController):
    """Says that it stands while it is on its last segment."""

    def status(self, now: int) -> Status:
        status = super().status(now)
        if len(self._servo.buffer) <= 1:
            status.in_motion = 0
        return status


class ErrorOnStop(EmulatedController):
    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        out = super().handle(link, message, now)
        if is_stop(message) and not isinstance(message, Malformed):
            self._error = ErrorCode.LINK_LOST
        return out


class StickyError(EmulatedController):
    _worst = ErrorCode.NONE

    def status(self, now: int) -> Status:
        status = super().status(now)
        self._worst = max(self._worst, self._error)
        status.error_code, status.in_error = int(self._worst), int(self._worst > 0)
        return status


class CarelessInEmergency(EmulatedController):
    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if self._e_stopped and isinstance(message, JointTrajPt) and is_request(message):
            return [(link, accepted(message))]
        return super().handle(link, message, now)


class Frozen(EmulatedController):
    def motion(self, now: int) -> State:
        return (0.3, 0.4), (0.0, 0.0), (0.0, 0.0)

    def state_messages(self, now: int) -> list[Message]:
        return self._reports.round(self.motion(now), self.status(now), 0.0)


def scaled(part: float) -> MessageIn:
    return each_point(lambda point: _joint(point, 0.4 + part * (point.joints[1] - 0.4)))


def timed(factor: float) -> MessageIn:
    return each_point(lambda point: dataclasses.replace(point, duration=point.duration * factor))


class OneTrajectoryALink(EmulatedController):
    def __init__(self, *args: object, **named: object) -> None:
        super().__init__(*args, **named)  # type: ignore[arg-type]  # passed on as it came
        self._moved: set[int] = set()

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        is_end = isinstance(message, JointTrajPt) and message.sequence == 1
        if isinstance(message, JointTrajPt) and link in self._moved and not is_stop(message):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        if is_end:
            self._moved.add(link)
        return super().handle(link, message, now)


def duplicates_are_new(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and received.sequence >= 0:
        last = link.memory.get("last", -1)
        shift = link.memory.get("shift", 0) if received.sequence else 0
        shift += received.sequence == last and last > 0
        link.memory.update(last=received.sequence, shift=shift)
        received = dataclasses.replace(received, sequence=received.sequence + shift)
    return (received,)


def answers_downloads(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and received.comm_type == CommType.TOPIC:
        link.write(frame(11, 3, 1))
    return (received,)


def second_point_unanswered(link: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[1] == 11 and count(link.memory, "points") == 2 else data


def _begins(message: object) -> TypeGuard[JointTrajPt]:
    return isinstance(message, JointTrajPt) and message.sequence == 0


def _stands(controller: EmulatedController, now: int) -> bool:
    controller.advance(now)
    return not any(controller._servo.sample(now)[1])


def late_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    if not (is_stop(received) and isinstance(received, Message)):
        return (received,)
    topic = dataclasses.replace(received, comm_type=CommType.TOPIC)
    link.later(1.0, lambda: link.service.obey(link, topic))
    if is_request(received):
        link.write(frame(11, 3, 1))
    return ()


def silent_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and is_stop(received):
        moving = link.service.is_moving
        return (dataclasses.replace(received, comm_type=CommType.TOPIC),) if moving else (received,)
    return (received,)


def resuming(sequence: int, duration: float, after: float) -> MessageIn:
    """Go by itself to one of the points, so long after a stop."""

    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, JointTrajPt) and received.sequence == sequence:
            link.memory["goal"] = received
        if is_stop(received) and "goal" in link.memory:
            goal = _again(link.memory.pop("goal"), duration)
            link.later(after, lambda: link.service.obey(link, goal))
        return (received,)

    return change


def _again(point: JointTrajPt, duration: float) -> JointTrajPt:
    return dataclasses.replace(point, sequence=0, duration=duration, comm_type=CommType.TOPIC)


class DeadAfterStop(EmulatedController):
    _stopped = False

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if is_stop(message) and self._servo.in_motion:
            self._stopped = True
        elif self._stopped and isinstance(message, JointTrajPt):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        return super().handle(link, message, now)


def second_stop_unheard(link: FaultyLink, received: Received) -> Iterable[Received]:
    is_point = isinstance(received, JointTrajPt) and is_stop(received)
    return () if is_point and count(link.memory, "stops") == 2 else (received,)


@disobeying
def stop_in_download(controller: EmulatedController, _: int, message: Message, now: int) -> bool:
    """Answer STOP amid a download and go on as soon as points are forgotten."""
    if is_stop(message) and controller._taking.is_download:
        controller._servo.go(now)
        return True
    return False


def _joint(point: JointTrajPt, value: float) -> JointTrajPt:
    return dataclasses.replace(point, joints=(point.joints[0], value, *point.joints[2:]))


@each_point
def finite_points(point: JointTrajPt) -> JointTrajPt:
    return point if math.isfinite(point.joints[1]) else _joint(point, 0.5)


@each_point
def clipped_points(point: JointTrajPt) -> JointTrajPt:
    value = min(max(point.joints[1], -2.0), 2.0)
    return _joint(point, value) if value != point.joints[1] else point


def no_ping(link: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[1] == 1 else data


SilentlyDrops = disobeying(
    lambda c, link, message, now: isinstance(message, JointTrajPt) and abs(message.joints[1]) > 2.0
)
SilentlyDropsNan = disobeying(
    lambda c, link, message, now: (
        isinstance(message, JointTrajPt)
        and not math.isfinite(message.joints[1] + message.velocity + message.duration)
    )
)


@each_point
def rest_is_new(point: JointTrajPt) -> JointTrajPt:
    """Take what follows a refused point for a new trajectory."""
    return dataclasses.replace(point, sequence=0) if point.sequence > 1 else point


def any_full_point(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPtFull) and not is_stop(received):
        received = dataclasses.replace(received, robot_id=0, valid_fields=7)
    return (received,)


class Teleports(EmulatedController):
    """Is at once where a point without a duration says."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt) and message.duration == 0.0 and not is_stop(message):
            self._servo._state = (message.joints[:2], (0.0, 0.0), (0.0, 0.0))
            return [(link, accepted(message))]
        return super().handle(link, message, now)


class TooFast(EmulatedController):
    """Is at once at the end of a segment that is too fast."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt) and 0 < message.duration < 0.02:
            self.advance(now)
            self._servo.stop(now)
            self._servo._state = (message.joints[:2], (0.0, 0.0), (0.0, 0.0))
            self._servo._segment = None
            return [(link, accepted(message))]
        return super().handle(link, message, now)


def not_a_number_is_nothing(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPtFull):
        reals = (received.time, *received.positions, *received.velocities, *received.accelerations)
        if not all(map(math.isfinite, reals)):
            link.answer(accepted(received))
            return ()
    return (received,)


class DiesAfterFive(FaultyService):
    def _motion_opened(self, link: EmulatorLink) -> bool:
        if link.number > 8:
            self.stop_listening()
        return super()._motion_opened(link)


class OneMotionClient(FaultyService):
    def _motion_opened(self, link: EmulatorLink) -> bool:
        return count(self.memory, "clients") <= 4 and super()._motion_opened(link)


class ImpatientLink(FaultyLink):
    def connection_made(self, transport: object) -> None:
        super().connection_made(transport)  # type: ignore[arg-type]  # as the loop gave it
        if self.is_motion:
            self.later(1.0, self.abort)


class NeverForgets(FaultyService):
    """Counts the clients that ever were against the cap."""

    def _motion_opened(self, link: EmulatorLink) -> bool:
        return count(self.memory, "clients") < 16 and super()._motion_opened(link)


class ConfusesClients(FaultyService):
    """Answers whoever came last."""

    def _dispatch(self, outgoing: Outgoing) -> None:
        for _, message in outgoing:
            newest = list(self._motion_links.values())[-1]
            if isinstance(newest, FaultyLink):
                newest.write(self._codec.encode(message))


class StateNeedsMotion(FaultyService):
    def _motion_closed(self, link: EmulatorLink) -> None:
        super()._motion_closed(link)
        for listener in list(self._state_links.values()):
            listener.abort()


class AnybodyCommands(EmulatedController):
    """Takes points of whoever sends them, and then as if he had commanded all along."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt | JointTrajPtFull):
            self._taking.owner = link
        return super().handle(link, message, now)


class CarriesOn(AnybodyCommands):
    """Does not mind that its client is gone."""

    def disconnected(self, link: int, now: int) -> Outgoing:
        return []


class CarriesOnAfterClose(FaultyService):
    """Stops when a link is reset, not when it is closed."""

    def _motion_closed(self, link: EmulatorLink) -> None:
        if self.memory.pop("reset", False):
            super()._motion_closed(link)
            return
        del self._motion_links[link.number]


class ResumesOnConnect(FaultyService):
    """Goes on with the last target as soon as somebody connects."""

    def _motion_received(self, link: EmulatorLink, message: Received) -> None:
        if isinstance(message, JointTrajPt) and message.sequence == 1:
            self.memory["goal"] = message
        super()._motion_received(link, message)

    def _motion_closed(self, link: EmulatorLink) -> None:
        if self.is_moving:
            self.memory["resume"] = self.memory.get("goal")
        super()._motion_closed(link)

    def _motion_opened(self, link: EmulatorLink) -> bool:
        opened = super()._motion_opened(link)
        goal = self.memory.pop("resume", None)
        if goal is not None and isinstance(link, FaultyLink):
            link.later(0.05, lambda: self.obey(link, _again(goal, 0.5)))
        return opened


class DeadAfterLoss(EmulatedController):
    _was_lost = False

    def disconnected(self, link: int, now: int) -> Outgoing:
        self._was_lost = self._was_lost or self._servo.in_motion
        return super().disconnected(link, now)

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if self._was_lost and isinstance(message, JointTrajPt) and not is_stop(message):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        return super().handle(link, message, now)


def answers_repeated_twice(link: FaultyLink, received: Received) -> Iterable[Received]:
    first = "points" not in link.memory
    if isinstance(received, JointTrajPt):
        link.memory["points"] = True
        if first and received.sequence == 1:
            link.write(frame(11, 3, 1))
    return (received,)


def old_reports(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    waiting = service.memory.setdefault("waiting", [])
    waiting.append(messages)
    return list(waiting.pop(0)) if len(waiting) > 6 else []


class WrongErrorNumber(EmulatedController):
    def status(self, now: int) -> Status:
        status = super().status(now)
        status.error_code = 4711 if status.in_error else 0
        return status


def answer_of(kind: int, size: int) -> BytesChange:
    return lambda _, data: frame(kind, 3, 1, bytes(size)) if header(data)[1] == kind else data


def nothing(_service: FaultyService, _messages: list[Message]) -> list[Message | bytes]:
    return []


def no_second_listener(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return [] if len(service.state_links) > 1 else list(messages)


def stop_behind_point(_: FaultyLink, data: bytes) -> bytes:
    return data[:68] if len(data) == 136 else data


def stop_in_two_pieces(_: FaultyLink, data: bytes) -> bytes:
    return b"" if len(data) in (37, 31) else data


def sixty_four_answers(link: FaultyLink, data: bytes) -> bytes:
    return data if count(link.memory, "replies") <= 64 else b""


# What is told.

no_positions = each(lambda _, m: None if isinstance(m, JointPosition) else m)
value_without_joint = _joints(lambda joints: (*joints[:9], 0.5))
degrees = _joints(lambda joints: tuple(map(math.degrees, joints)))
joint_along = _joints(lambda joints: (joints[0] + (joints[1] - 0.4), *joints[1:]))
other_feedback = feedback(positions=lambda told: tuple(v + 0.1 for v in told.positions))
velocities_backwards = feedback(velocities=lambda told: tuple(-v for v in told.velocities))

# Which points are changed.


# What is taken and not obeyed.

SinglePoint = ignoring(lambda m: _begins(m) and m.duration > 0.3)
PointsFrom7 = ignoring(lambda m: isinstance(m, JointTrajPt) and m.sequence > 6)
PointsFrom50 = ignoring(lambda m: isinstance(m, JointTrajPt) and m.sequence >= 50)
NextTrajectory = disobeying(lambda c, link, m, now: _begins(m) and c._servo.in_motion)
FullPoint = ignoring(lambda m: isinstance(m, JointTrajPtFull) and m.sequence >= 0)
WholeTrajectory = ignoring(lambda m: isinstance(m, JointTraj))
Impossible = ignoring(lambda m: isinstance(m, JointTrajPt) and (m.duration < 0 or m.velocity > 1))
Stop = ignoring(is_stop)
StopAtRest = disobeying(lambda c, link, m, now: _stands(c, now) and is_stop(m))
StopWithManyPoints = disobeying(lambda c, link, m, now: is_stop(m) and len(c._servo.buffer) > 3)
StopOfAnother = disobeying(
    lambda c, link, m, now: is_stop(m) and c._taking.owner not in (None, link)
)
StopAsTopic = ignoring(lambda m: is_stop(m) and not is_request(m))
StopInFullPoint = ignoring(lambda m: is_stop(m) and isinstance(m, JointTrajPtFull))
