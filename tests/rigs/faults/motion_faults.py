"""Single faults of a server in what it reports and in what it does: topics, STATUS, motion, links.

Each entry breaks one rule of an otherwise correct emulator and names the checks that must find it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable

from rigs.faults.faulty_servers import (
    AT_USUAL_RATE,
    Fault,
    FaultyLink,
    FaultyService,
    frame,
    header,
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
from openpendant.tools.packets.conformance.findings import CheckVerdict

DEVIATES = CheckVerdict.DEVIATES

StateOut = Callable[[FaultyService, list[Message]], list[Message | bytes]]
MessageIn = Callable[[FaultyLink, Received], Iterable[Received]]


def _each(change: Callable[[Message], Message | bytes | None]) -> StateOut:
    def apply(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
        return [told for message in messages if (told := change(message)) is not None]

    return apply


def _status(**values: int) -> StateOut:
    def change(message: Message) -> Message:
        return dataclasses.replace(message, **values) if isinstance(message, Status) else message

    return _each(change)


def _joints(change: Callable[[tuple[float, ...]], tuple[float, ...]]) -> StateOut:
    """Change joint values wherever they are told."""

    def apply(message: Message) -> Message:
        if isinstance(message, JointPosition):
            return dataclasses.replace(message, joints=change(message.joints))
        if isinstance(message, JointFeedback):
            return dataclasses.replace(message, positions=change(message.positions))
        return message

    return _each(apply)


def _motion_at_rest(service: FaultyService, message: Message) -> bool:
    return not service.controller.status(service.now).in_motion


def _pauses(while_moving: bool) -> StateOut:
    def apply(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
        moving = bool(service.controller.status(service.now).in_motion)
        silent = service.loop_time % 2.0 < 0.8
        return [] if silent and (moving or not while_moving) else list(messages)

    return apply


def _status_once(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    service.memory["told"] = service.memory.get("told", 0)
    out: list[Message | bytes] = []
    for message in messages:
        if isinstance(message, Status):
            service.memory["told"] += 1
            if service.loop_time % 3.0 > 0.1:
                continue
        out.append(message)
    return out


def _status_first(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return sorted(messages, key=lambda message: not isinstance(message, Status))


def _counting(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    service.memory["count"] = service.memory.get("count", 0) + 1
    return [
        dataclasses.replace(m, sequence=service.memory["count"])
        if isinstance(m, JointPosition)
        else m
        for m in messages
    ]


def _four_bytes_more(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    out: list[Message | bytes] = []
    for message in messages:
        data = service._codec.encode(message)
        longer = header(data)[1] == 13
        out.append(patched(data, 0, len(data)) + bytes(4) if longer else data)
    return out


def _noise(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    off = 0.01 * math.sin(service.loop_time * 20)
    return _joints(lambda joints: (joints[0] + off, *joints[1:]))(service, messages)


def _nothing_for_many(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return [] if len(service.state_links) > 1 else list(messages)


class _FirstListenersOnly(FaultyLink):
    def send_state(self, frames: bytes) -> None:
        if self.number < 5:
            super().send_state(frames)


def _jumping(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    moving = bool(service.controller.status(service.now).in_motion)
    service.memory["n"] = service.memory.get("n", 0) + 1
    off = 0.04 if moving and service.memory["n"] % 20 == 0 else 0.0
    return _joints(lambda joints: (joints[0], joints[1] + off, *joints[2:]))(service, messages)


def _velocity_reversed(message: Message) -> Message:
    if not isinstance(message, JointFeedback):
        return message
    return dataclasses.replace(message, velocities=tuple(-v for v in message.velocities))


def _feedback_off(message: Message) -> Message:
    if not isinstance(message, JointFeedback):
        return message
    return dataclasses.replace(message, positions=tuple(v + 0.1 for v in message.positions))


TOPICS = (
    Fault("tells nothing", ("TS01", "TS02"), state_out=lambda _s, _m: []),
    Fault("reports twice a second", ("TS02",), settings={"rate": 2}),
    Fault("pauses for 0.8 s now and then", ("TS03",), state_out=_pauses(while_moving=False)),
    Fault("tells STATUS every three seconds", ("TS04",), state_out=_status_once),
    Fault("tells STATUS before the joints", ("TS05",), state_out=_status_first),
    Fault("leaves values in slots without a joint", ("TS06",),
        state_out=_joints(lambda joints: (*joints[:9], 0.5))),
    Fault("counts its reports", ("TS07",), state_out=_counting),
    Fault("has a STATUS of eight integers", ("TS08",), state_out=_four_bytes_more),
    Fault("reports type 15 only", ("TS09",), DEVIATES,
        state_out=_each(lambda m: None if isinstance(m, JointPosition) else m)),
    Fault("reports noise of 0.01 rad", ("TS10",), state_out=_noise),
    Fault("reports degrees", ("TS11",),
        state_out=_joints(lambda joints: tuple(map(math.degrees, joints)))),
    Fault("says something else in type 15", ("TS12",), state_out=_each(_feedback_off)),
    Fault("serves no listener when there are two", ("TS13",), state_out=_nothing_for_many),
    Fault("forgets listeners that come again", ("TS14",), link=_FirstListenersOnly),
    Fault("pauses for 0.8 s in motion", ("TS16",), settings=AT_USUAL_RATE,
        state_out=_pauses(while_moving=True)),
    Fault("reports jumps in motion", ("TS17",), state_out=_jumping),
    Fault("moves another joint along", ("TS18",),
        state_out=_joints(lambda joints: (joints[0] + (joints[1] - 0.4), *joints[1:]))),
    Fault("reports velocities backwards", ("TS19",), state_out=_each(_velocity_reversed)),
)  # fmt: skip


def _flickering(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    service.memory["n"] = service.memory.get("n", 0) + 1
    return _status(drives_powered=service.memory["n"] // 50 % 2)(service, messages)


class _LaggingStatus(EmulatedController):
    """Says that it moves for two seconds after it stood."""

    _stood = -(10**18)

    def status(self, now: int) -> Status:
        status = super().status(now)
        if status.in_motion:
            self._stood = now
        status.in_motion = int(now - self._stood < 2_000_000_000)
        return status


class _HastyStatus(EmulatedController):
    """Says that it stands while it is on its last segment."""

    def status(self, now: int) -> Status:
        status = super().status(now)
        if len(self._servo.buffer) <= 1:
            status.in_motion = 0
        return status


class _ErrorOnStop(EmulatedController):
    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        out = super().handle(link, message, now)
        if is_stop(message) and not isinstance(message, Malformed):
            self._error = ErrorCode.LINK_LOST
        return out


class _StickyError(EmulatedController):
    _worst = ErrorCode.NONE

    def status(self, now: int) -> Status:
        status = super().status(now)
        self._worst = max(self._worst, self._error)
        status.error_code, status.in_error = int(self._worst), int(self._worst > 0)
        return status


class _CarelessInEmergency(EmulatedController):
    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if self._e_stopped and isinstance(message, JointTrajPt) and is_request(message):
            return [(link, accepted(message))]
        return super().handle(link, message, now)


STATUS = (
    Fault("says 2 for true", ("QS01",), state_out=_status(drives_powered=2)),
    Fault("has a mode 0", ("QS02",), state_out=_status(mode=0)),
    Fault("has errors without a number", ("QS03",), state_out=_status(in_error=1)),
    Fault("keeps the number of an error", ("QS03",), DEVIATES, state_out=_status(error_code=7)),
    Fault("is always in motion", ("QS04",), state_out=_status(in_motion=1)),
    Fault("can move in emergency stop", ("QS05",), state_out=_status(e_stopped=1)),
    Fault("can move without power", ("QS05",), state_out=_status(drives_powered=0)),
    Fault("does not know its emergency stop", ("QS06",), DEVIATES, state_out=_status(e_stopped=-1)),
    Fault("flickers", ("QS07",), state_out=_flickering),
    Fault("is never in motion", ("QS08",), state_out=_status(in_motion=0)),
    Fault("says that it stands on the last segment", ("QS09",), controller=_HastyStatus),
    Fault("says that it moves for two seconds more", ("QS10",), controller=_LaggingStatus),
    Fault("moves by remote in manual mode", ("QS11",), state_out=_status(mode=1)),
    Fault("takes STOP for an error", ("QS12",), controller=_ErrorOnStop),
    Fault("never clears an error", ("QS13",), controller=_StickyError),
    Fault("takes points in emergency stop", ("QS14",), controller=_CarelessInEmergency),
)


class _Answers(EmulatedController):
    """Answers what it does not obey; `disobeys` says what that is."""

    def disobeys(self, link: int, message: Received, now: int) -> bool:
        raise NotImplementedError

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, Malformed) or not self.disobeys(link, message, now):
            return super().handle(link, message, now)
        assert isinstance(message, Message)
        return [(link, accepted(message))] if is_request(message) else []


class _Frozen(EmulatedController):
    def motion(self, now: int) -> State:
        return (0.3, 0.4), (0.0, 0.0), (0.0, 0.0)

    def state_messages(self, now: int) -> list[Message]:
        return self._reports.round(self.motion(now), self.status(now), 0.0)


def _scaled(part: float) -> MessageIn:
    """Move only a part of the way."""

    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, JointTrajPt) and not is_stop(received):
            way = tuple(0.4 + part * (v - 0.4) for v in received.joints[1:2])
            joints = (received.joints[0], *way, *received.joints[2:])
            received = dataclasses.replace(received, joints=joints)
        return (received,)

    return change


def _timed(factor: float) -> MessageIn:
    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, JointTrajPt):
            received = dataclasses.replace(received, duration=received.duration * factor)
        return (received,)

    return change


class _NoSinglePoints(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and message.sequence == 0 and message.duration > 0.3


class _SmallBuffer(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and message.sequence > 6


class _OneTrajectoryALink(EmulatedController):
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


def _duplicates_are_new(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and received.sequence >= 0:
        last = link.memory.get("last", -1)
        shift = link.memory.get("shift", 0) if received.sequence else 0
        shift += received.sequence == last and last > 0
        link.memory.update(last=received.sequence, shift=shift)
        received = dataclasses.replace(received, sequence=received.sequence + shift)
    return (received,)


class _ForgetsReplacement(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        is_new = isinstance(message, JointTrajPt) and message.sequence == 0
        return is_new and self._servo.in_motion


def _answers_downloads(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and received.comm_type == CommType.TOPIC:
        link.write(frame(11, 3, 1))
    return (received,)


class _NoFullPoints(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPtFull) and message.sequence >= 0


class _NoWholeTrajectories(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTraj)


def _second_point_unanswered(link: FaultyLink, data: bytes) -> bytes:
    link.memory["points"] = link.memory.get("points", 0) + (header(data)[1] == 11)
    return b"" if link.memory["points"] == 2 else data


MOTION = (
    Fault("reports positions that never change", ("MS02",), controller=_Frozen),
    Fault("goes half of the way", ("MS02",), message_in=_scaled(0.5)),
    Fault("goes the other way", ("MS02", "MS08"), message_in=_scaled(-1.0)),
    Fault("goes too far and stays there", ("MS02", "MS08"), message_in=_scaled(1.3)),
    Fault("does not answer the second point", ("MS02",), frame_out=_second_point_unanswered),
    Fault("answers points with nine bytes", ("MS03",),
        frame_out=lambda _, f: frame(11, 3, 1, bytes(9)) if header(f)[1] == 11 else f),
    Fault("answers points with whole points", ("MS03", "RS12"), DEVIATES,
        frame_out=lambda _, f: frame(11, 3, 1, bytes(52)) if header(f)[1] == 11 else f),
    Fault("moves more than twice as fast", ("MS06",), DEVIATES, message_in=_timed(0.38)),
    Fault("moves six times as slowly", ("MS07",), message_in=_timed(6.0)),
    Fault("does not move to single points", ("MS09",), controller=_NoSinglePoints),
    Fault("takes seven points and forgets the rest", ("MS10",), controller=_SmallBuffer),
    Fault("takes one trajectory a connection", ("MS11",), controller=_OneTrajectoryALink),
    Fault("moves a repeated point twice", ("MS12",), message_in=_duplicates_are_new),
    Fault("takes gaps in the sequence", ("MS13",), DEVIATES, settings={"strict_sequence": False}),
    Fault("begins anywhere", ("MS14",), DEVIATES, settings={"strict_sequence": False}),
    Fault("forgets a trajectory that replaces one", ("MS15",), controller=_ForgetsReplacement),
    Fault("answers downloads", ("MS16",), message_in=_answers_downloads),
    Fault("takes full points and does not move", ("MS17",), controller=_NoFullPoints),
    Fault("takes whole trajectories and does not move", ("MS18",), controller=_NoWholeTrajectories),
)  # fmt: skip


class _IgnoresStop(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return is_stop(message)


class _IgnoresStopAtRest(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        self.advance(now)
        return is_stop(message) and not any(self._servo.sample(now)[1])


class _IgnoresStopAtSpeed(_Answers):
    """Obeys STOP on its first points only."""

    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return is_stop(message) and len(self._servo.buffer) > 3


class _IgnoresFullStop(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return is_stop(message) and isinstance(message, JointTrajPtFull)


class _IgnoresTopicStop(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return is_stop(message) and not is_request(message)


class _IgnoresStrangersStop(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return is_stop(message) and self._taking.owner not in (None, link)


def _late_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    if not (is_stop(received) and isinstance(received, Message)):
        return (received,)
    topic = dataclasses.replace(received, comm_type=CommType.TOPIC)
    link.later(1.0, lambda: link.service.obey(link, topic))
    if is_request(received):
        link.write(frame(11, 3, 1))
    return ()


def _silent_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and is_stop(received):
        moving = link.service.controller.status(link.service.now).in_motion
        return (dataclasses.replace(received, comm_type=CommType.TOPIC),) if moving else (received,)
    return (received,)


def _returns_after_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    """Go on to the end by itself half a second after a stop."""
    if isinstance(received, JointTrajPt) and received.sequence == 1:
        link.memory["goal"] = received
    if is_stop(received) and "goal" in link.memory:
        goal = dataclasses.replace(
            link.memory.pop("goal"), sequence=0, duration=0.5, comm_type=CommType.TOPIC
        )
        link.later(0.6, lambda: link.service.obey(link, goal))
    return (received,)


def _home_after_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    """Go back to the start by itself as soon as it is stopped."""
    if isinstance(received, JointTrajPt) and received.sequence == 0:
        link.memory["home"] = received
    if is_stop(received) and "home" in link.memory:
        home = dataclasses.replace(
            link.memory.pop("home"), sequence=0, duration=0.2, comm_type=CommType.TOPIC
        )
        link.later(0.1, lambda: link.service.obey(link, home))
    return (received,)


class _DeadAfterStop(EmulatedController):
    _stopped = False

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if is_stop(message) and self._servo.in_motion:
            self._stopped = True
        elif self._stopped and isinstance(message, JointTrajPt):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        return super().handle(link, message, now)


def _last_stop_only(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and is_stop(received):
        link.memory["stops"] = link.memory.get("stops", 0) + 1
        if link.memory["stops"] == 2:
            return ()
    return (received,)


def _loses_second_of_segment(link: FaultyLink, data: bytes) -> bytes:
    return data[:68] if len(data) == 136 else data


def _needs_whole_stop(link: FaultyLink, data: bytes) -> bytes:
    return b"" if len(data) in (37, 31) else data


class _StopKeepsDownload(_Answers):
    """Answers STOP amid a download and goes on as soon as points are forgotten."""

    def disobeys(self, link: int, message: Received, now: int) -> bool:
        if is_stop(message) and self._taking.is_download:
            self._servo.go(now)
            return True
        return False


STOP = (
    Fault("answers STOP and moves on", ("SS02", "SS03"), controller=_IgnoresStop),
    Fault("does not answer STOP in motion", ("SS01",), message_in=_silent_stop),
    Fault("stops a second late", ("SS02",), message_in=_late_stop),
    Fault("goes on by itself after STOP", ("SS03",), message_in=_returns_after_stop),
    Fault("goes home by itself after STOP", ("SS04",), message_in=_home_after_stop),
    Fault("takes nothing after STOP", ("SS05",), controller=_DeadAfterStop),
    Fault("ignores STOP before it moves", ("SS06",), controller=_IgnoresStopAtRest),
    Fault("ignores STOP while many points are left", ("SS07",), controller=_IgnoresStopAtSpeed),
    Fault("does not answer a second STOP", ("SS08",), message_in=_last_stop_only),
    Fault("takes left-over points", ("SS09",), DEVIATES, settings={"strict_sequence": False}),
    Fault("ignores STOP of another client", ("SS10",), controller=_IgnoresStrangersStop),
    Fault("ignores STOP as a topic", ("SS11",), controller=_IgnoresTopicStop),
    Fault("loses a STOP behind a point", ("SS12",), bytes_in=_loses_second_of_segment),
    Fault("loses a STOP in two pieces", ("SS13",), bytes_in=_needs_whole_stop),
    Fault("moves a download that was stopped", ("SS14",), controller=_StopKeepsDownload),
    Fault("ignores STOP in a full point", ("SS15",), controller=_IgnoresFullStop),
)


def _repaired(**bounds: Callable[[JointTrajPt], JointTrajPt]) -> MessageIn:
    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, JointTrajPt) and not is_stop(received):
            for repair in bounds.values():
                received = repair(received)
        return (received,)

    return change


def _joint(point: JointTrajPt, value: float) -> JointTrajPt:
    return dataclasses.replace(point, joints=(point.joints[0], value, *point.joints[2:]))


def _finite(point: JointTrajPt) -> JointTrajPt:
    return point if math.isfinite(point.joints[1]) else _joint(point, 0.5)


def _clipped(point: JointTrajPt) -> JointTrajPt:
    value = min(max(point.joints[1], -2.0), 2.0)
    return _joint(point, value) if value != point.joints[1] else point


def _no_ping(link: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[1] == 1 else data


class _SilentlyDrops(_Answers):
    """Takes a point that is out of range and does nothing."""

    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and abs(message.joints[1]) > 2.0


class _SilentlyDropsNan(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and not math.isfinite(
            message.joints[1] + message.velocity + message.duration
        )


class _SilentlyDropsOdd(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and (message.duration < 0 or message.velocity > 1)


def _rest_is_new(link: FaultyLink, received: Received) -> Iterable[Received]:
    """Take what follows a refused point for a new trajectory."""
    if isinstance(received, JointTrajPt) and received.sequence > 1:
        received = dataclasses.replace(received, sequence=0)
    return (received,)


def _any_full_point(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPtFull) and not is_stop(received):
        received = dataclasses.replace(received, robot_id=0, valid_fields=7)
    return (received,)


class _Teleports(EmulatedController):
    """Is at once where a point without a duration says."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt) and message.duration == 0.0 and not is_stop(message):
            self._servo._state = (message.joints[:2], (0.0, 0.0), (0.0, 0.0))
            return [(link, accepted(message))]
        return super().handle(link, message, now)


class _TooFast(EmulatedController):
    """Is at once at the end of a segment that is too fast."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt) and 0 < message.duration < 0.02:
            self.advance(now)
            self._servo.stop(now)
            self._servo._state = (message.joints[:2], (0.0, 0.0), (0.0, 0.0))
            self._servo._segment = None
            return [(link, accepted(message))]
        return super().handle(link, message, now)


def _not_a_number_is_nothing(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPtFull):
        reals = (received.time, *received.positions, *received.velocities, *received.accelerations)
        if not all(map(math.isfinite, reals)):
            link.answer(accepted(received))
            return ()
    return (received,)


LIMITS = (
    Fault("takes what is no number for 0.5", ("LS01", "LS02"), message_in=_repaired(a=_finite)),
    Fault("drops what is no number silently", ("LS01",), DEVIATES, controller=_SilentlyDropsNan),
    Fault("drops a velocity that is no number", ("LS03", "LS04"), DEVIATES,
        controller=_SilentlyDropsNan),
    Fault("drops what cannot be silently", ("LS05", "LS06"), DEVIATES,
        controller=_SilentlyDropsOdd),
    Fault("clips targets to the range", ("LS07",), message_in=_repaired(a=_clipped)),
    Fault("takes targets out of range and stays", ("LS07", "LS08"), controller=_SilentlyDrops),
    Fault("does not check the range, as ABB's does not", ("LS07", "LS08"), DEVIATES,
        controller=_SilentlyDrops, frame_out=_no_ping),
    Fault("moves faster than the joint may", ("LS09",), controller=_TooFast),
    Fault("moves what follows a refused point", ("LS10",), message_in=_rest_is_new),
    Fault("takes full points without a position", ("LS11",), message_in=_any_full_point),
    Fault("takes full points that are no numbers", ("LS12",), DEVIATES,
        message_in=_not_a_number_is_nothing),
    Fault("takes points for other robots", ("LS13",), message_in=_any_full_point),
    Fault("jumps to a point without a duration", ("LS15",), controller=_Teleports),
)  # fmt: skip


class _DiesAfterFive(FaultyService):
    def _motion_opened(self, link: EmulatorLink) -> bool:
        if link.number > 8:
            self.stop_listening()
        return super()._motion_opened(link)


class _OneMotionClient(FaultyService):
    """Takes one motion client in its life."""

    def _motion_opened(self, link: EmulatorLink) -> bool:
        self.memory["clients"] = self.memory.get("clients", 0) + 1
        return self.memory["clients"] <= 4 and super()._motion_opened(link)


class _ImpatientLink(FaultyLink):
    def connection_made(self, transport: object) -> None:
        super().connection_made(transport)  # type: ignore[arg-type]  # as the loop gave it
        if self.is_motion:
            self.later(1.0, self.abort)


class _NeverForgets(FaultyService):
    """Counts the clients that ever were against the cap."""

    def _motion_opened(self, link: EmulatorLink) -> bool:
        self.memory["clients"] = self.memory.get("clients", 0) + 1
        return self.memory["clients"] < 16 and super()._motion_opened(link)


class _ConfusesClients(FaultyService):
    """Answers whoever came last."""

    def _dispatch(self, outgoing: Outgoing) -> None:
        for _, message in outgoing:
            newest = list(self._motion_links.values())[-1]
            if isinstance(newest, FaultyLink):
                newest.write(self._codec.encode(message))


class _StateNeedsMotion(FaultyService):
    def _motion_closed(self, link: EmulatorLink) -> None:
        super()._motion_closed(link)
        for listener in list(self._state_links.values()):
            listener.abort()


class _AnybodyCommands(EmulatedController):
    """Takes points of whoever sends them, and then as if he had commanded all along."""

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if isinstance(message, JointTrajPt | JointTrajPtFull):
            self._taking.owner = link
        return super().handle(link, message, now)


class _CarriesOn(_AnybodyCommands):
    """Does not mind that its client is gone."""

    def disconnected(self, link: int, now: int) -> Outgoing:
        return []


class _CarriesOnAfterClose(FaultyService):
    """Stops when a link is reset, not when it is closed."""

    def _motion_closed(self, link: EmulatorLink) -> None:
        if self.memory.pop("reset", False):
            super()._motion_closed(link)
            return
        del self._motion_links[link.number]


class _ResumesOnConnect(FaultyService):
    """Goes on with the last target as soon as somebody connects."""

    def _motion_received(self, link: EmulatorLink, message: Received) -> None:
        if isinstance(message, JointTrajPt) and message.sequence == 1:
            self.memory["goal"] = message
        super()._motion_received(link, message)

    def _motion_closed(self, link: EmulatorLink) -> None:
        if self.controller.status(self.now).in_motion:
            self.memory["resume"] = self.memory.get("goal")
        super()._motion_closed(link)

    def _motion_opened(self, link: EmulatorLink) -> bool:
        opened = super()._motion_opened(link)
        goal = self.memory.pop("resume", None)
        if goal is not None and isinstance(link, FaultyLink):
            again = dataclasses.replace(goal, sequence=0, duration=0.5, comm_type=CommType.TOPIC)
            link.later(0.05, lambda: self.obey(link, again))
        return opened


class _DeadAfterLoss(EmulatedController):
    _was_lost = False

    def disconnected(self, link: int, now: int) -> Outgoing:
        self._was_lost = self._was_lost or self._servo.in_motion
        return super().disconnected(link, now)

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if self._was_lost and isinstance(message, JointTrajPt) and not is_stop(message):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        return super().handle(link, message, now)


def _sixty_four_pings(link: FaultyLink, data: bytes) -> bytes:
    link.memory["replies"] = link.memory.get("replies", 0) + 1
    return data if link.memory["replies"] <= 64 else b""


def _answers_repeated_twice(link: FaultyLink, received: Received) -> Iterable[Received]:
    first = "points" not in link.memory
    if isinstance(received, JointTrajPt):
        link.memory["points"] = True
        if first and received.sequence == 1:
            link.write(frame(11, 3, 1))
    return (received,)


LINK = (
    Fault("idles for a second at most", ("KS01",), link=_ImpatientLink),
    Fault("stops listening after some clients", ("KS02",), service=_DiesAfterFive),
    Fault("takes four clients in its life", ("KS03",), service=_OneMotionClient),
    Fault("never forgets a client", ("KS04",), service=_NeverForgets),
    Fault("answers the newest client", ("KS05",), service=_ConfusesClients),
    Fault("ends state links with motion links", ("KS07",), service=_StateNeedsMotion),
    Fault("answers sixty-four PINGs", ("KS08",), frame_out=_sixty_four_pings),
    Fault("carries on without its client", ("KS10", "KS11"), controller=_CarriesOn),
    Fault("carries on without its client, as ABB's does", ("KS10", "KS11"), DEVIATES,
        controller=_CarriesOn, frame_out=_no_ping),
    Fault("carries on when its client leaves politely", ("KS10",), service=_CarriesOnAfterClose),
    Fault("resumes when somebody connects", ("KS12",), service=_ResumesOnConnect),
    Fault("takes nothing after a lost link", ("KS13",), controller=_DeadAfterLoss),
    Fault("answers a repeated point twice", ("KS14",), message_in=_answers_repeated_twice),
    Fault("obeys two clients at once", ("KS15",), controller=_AnybodyCommands),
)  # fmt: skip


def _old_reports(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    waiting = service.memory.setdefault("waiting", [])
    waiting.append(messages)
    return list(waiting.pop(0)) if len(waiting) > 6 else []


class _ForgetsTheFiftieth(_Answers):
    def disobeys(self, link: int, message: Received, now: int) -> bool:
        return isinstance(message, JointTrajPt) and message.sequence >= 50


class _WrongErrorNumber(EmulatedController):
    def status(self, now: int) -> Status:
        status = super().status(now)
        status.error_code = 4711 if status.in_error else 0
        return status


UNFOUND = (
    (Fault("reports what was 60 ms ago", (), settings=AT_USUAL_RATE, state_out=_old_reports),
        "the protocol carries no clock, and a stop is granted 0.5 s"),
    (Fault("forgets points from the fiftieth", (), controller=_ForgetsTheFiftieth),
        "the tester sends ten: a robot is not to be moved through hundreds"),
    (Fault("gives its errors another number", (), controller=_WrongErrorNumber),
        "vendors number their errors as they like"),
)  # fmt: skip
"""Faults that no check finds, with the reason."""

MOTION_FAULTS = (*TOPICS, *STATUS, *MOTION, *STOP, *LIMITS, *LINK)
