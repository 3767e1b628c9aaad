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
    MessageIn,
    StateOut,
    count,
    disobeying,
    each,
    each_frame,
    each_point,
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
from openpendant.tools.packets.conformance.check import CheckVerdict

DEVIATES = CheckVerdict.DEVIATES


def _status(**values: int) -> StateOut:
    return each(
        lambda _, told: dataclasses.replace(told, **values) if isinstance(told, Status) else told
    )


def _joints(change: Callable[[tuple[float, ...]], tuple[float, ...]]) -> StateOut:
    """Change joint values wherever they are told."""

    def apply(_: FaultyService, message: Message) -> Message:
        if isinstance(message, JointPosition):
            return dataclasses.replace(message, joints=change(message.joints))
        if isinstance(message, JointFeedback):
            return dataclasses.replace(message, positions=change(message.positions))
        return message

    return each(apply)


def _pauses(while_moving: bool) -> StateOut:
    def apply(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
        moving = bool(service.controller.status(service.now).in_motion)
        silent = service.loop_time % 2.0 < 0.8
        return [] if silent and (moving or not while_moving) else list(messages)

    return apply


def _status_now_and_then(service: FaultyService, message: Message) -> Message | None:
    return None if isinstance(message, Status) and service.loop_time % 3.0 > 0.1 else message


def _status_first(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return sorted(messages, key=lambda message: not isinstance(message, Status))


def _counting(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    number = count(service.memory, "rounds")
    return [
        dataclasses.replace(told, sequence=number) if isinstance(told, JointPosition) else told
        for told in messages
    ]


def _four_bytes_more(data: bytes) -> bytes:
    return patched(data, 0, len(data)) + bytes(4) if header(data)[1] == 13 else data


def _noise(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    off = 0.01 * math.sin(service.loop_time * 20)
    return _joints(lambda joints: (joints[0] + off, *joints[1:]))(service, messages)


class _FirstListenersOnly(FaultyLink):
    def send_state(self, frames: bytes) -> None:
        if self.number < 5:
            super().send_state(frames)


def _jumping(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    moving = bool(service.controller.status(service.now).in_motion)
    off = 0.04 if count(service.memory, "rounds") % 20 == 0 and moving else 0.0
    return _joints(lambda joints: (joints[0], joints[1] + off, *joints[2:]))(service, messages)


def _feedback(change: Callable[[JointFeedback], JointFeedback]) -> StateOut:
    return each(lambda _, told: change(told) if isinstance(told, JointFeedback) else told)


TOPICS = (
    Fault("tells nothing", ("TS01", "TS02"), state_out=lambda _s, _m: []),
    Fault("reports twice a second", ("TS02",), settings={"rate": 2}),
    Fault("pauses for 0.8 s now and then", ("TS03",), state_out=_pauses(while_moving=False)),
    Fault("tells STATUS every three seconds", ("TS04",), state_out=each(_status_now_and_then)),
    Fault("tells STATUS before the joints", ("TS05",), state_out=_status_first),
    Fault(
        "leaves values in slots without a joint",
        ("TS06",),
        state_out=_joints(lambda joints: (*joints[:9], 0.5)),
    ),
    Fault("counts its reports", ("TS07",), state_out=_counting),
    Fault("has a STATUS of eight integers", ("TS08",), state_out=each_frame(_four_bytes_more)),
    Fault(
        "reports type 15 only",
        ("TS09",),
        DEVIATES,
        state_out=each(lambda _, m: None if isinstance(m, JointPosition) else m),
    ),
    Fault("reports noise of 0.01 rad", ("TS10",), state_out=_noise),
    Fault(
        "reports degrees",
        ("TS11",),
        state_out=_joints(lambda joints: tuple(map(math.degrees, joints))),
    ),
    Fault(
        "says something else in type 15",
        ("TS12",),
        state_out=_feedback(
            lambda told: dataclasses.replace(told, positions=tuple(v + 0.1 for v in told.positions))
        ),
    ),
    Fault(
        "serves no listener when there are two",
        ("TS13",),
        state_out=lambda service, messages: [] if len(service.state_links) > 1 else list(messages),
    ),
    Fault("forgets listeners that come again", ("TS14",), link=_FirstListenersOnly),
    Fault(
        "pauses for 0.8 s in motion",
        ("TS16",),
        settings=AT_USUAL_RATE,
        state_out=_pauses(while_moving=True),
    ),
    Fault("reports jumps in motion", ("TS17",), state_out=_jumping),
    Fault(
        "moves another joint along",
        ("TS18",),
        state_out=_joints(lambda joints: (joints[0] + (joints[1] - 0.4), *joints[1:])),
    ),
    Fault(
        "reports velocities backwards",
        ("TS19",),
        state_out=_feedback(
            lambda told: dataclasses.replace(told, velocities=tuple(-v for v in told.velocities))
        ),
    ),
)


def _flickering(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    return _status(drives_powered=count(service.memory, "rounds") // 50 % 2)(service, messages)


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


class _Frozen(EmulatedController):
    def motion(self, now: int) -> State:
        return (0.3, 0.4), (0.0, 0.0), (0.0, 0.0)

    def state_messages(self, now: int) -> list[Message]:
        return self._reports.round(self.motion(now), self.status(now), 0.0)


def _scaled(part: float) -> MessageIn:
    """Move only a part of the way."""
    return each_point(lambda point: _joint(point, 0.4 + part * (point.joints[1] - 0.4)))


def _timed(factor: float) -> MessageIn:
    return each_point(lambda point: dataclasses.replace(point, duration=point.duration * factor))


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


def _answers_downloads(link: FaultyLink, received: Received) -> Iterable[Received]:
    if isinstance(received, JointTrajPt) and received.comm_type == CommType.TOPIC:
        link.write(frame(11, 3, 1))
    return (received,)


def _second_point_unanswered(link: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[1] == 11 and count(link.memory, "points") == 2 else data


MOTION = (
    Fault("reports positions that never change", ("MS02",), controller=_Frozen),
    Fault("goes half of the way", ("MS02",), message_in=_scaled(0.5)),
    Fault("goes the other way", ("MS02", "MS08"), message_in=_scaled(-1.0)),
    Fault("goes too far and stays there", ("MS02", "MS08"), message_in=_scaled(1.3)),
    Fault("does not answer the second point", ("MS02",), frame_out=_second_point_unanswered),
    Fault(
        "answers points with nine bytes",
        ("MS03",),
        frame_out=lambda _, f: frame(11, 3, 1, bytes(9)) if header(f)[1] == 11 else f,
    ),
    Fault(
        "answers points with whole points",
        ("MS03", "RS12"),
        DEVIATES,
        frame_out=lambda _, f: frame(11, 3, 1, bytes(52)) if header(f)[1] == 11 else f,
    ),
    Fault("moves more than twice as fast", ("MS06",), DEVIATES, message_in=_timed(0.38)),
    Fault("moves six times as slowly", ("MS07",), message_in=_timed(6.0)),
    Fault(
        "does not move to single points",
        ("MS09",),
        controller=disobeying(
            lambda c, link, m, now: (
                isinstance(m, JointTrajPt) and m.sequence == 0 and m.duration > 0.3
            )
        ),
    ),
    Fault(
        "takes seven points and forgets the rest",
        ("MS10",),
        controller=disobeying(
            lambda c, link, m, now: isinstance(m, JointTrajPt) and m.sequence > 6
        ),
    ),
    Fault("takes one trajectory a connection", ("MS11",), controller=_OneTrajectoryALink),
    Fault("moves a repeated point twice", ("MS12",), message_in=_duplicates_are_new),
    Fault("takes gaps in the sequence", ("MS13",), DEVIATES, settings={"strict_sequence": False}),
    Fault("begins anywhere", ("MS14",), DEVIATES, settings={"strict_sequence": False}),
    Fault(
        "forgets a trajectory that replaces one",
        ("MS15",),
        controller=disobeying(
            lambda c, link, m, now: (
                isinstance(m, JointTrajPt) and m.sequence == 0 and c._servo.in_motion
            )
        ),
    ),
    Fault("answers downloads", ("MS16",), message_in=_answers_downloads),
    Fault(
        "takes full points and does not move",
        ("MS17",),
        controller=disobeying(
            lambda c, link, m, now: isinstance(m, JointTrajPtFull) and m.sequence >= 0
        ),
    ),
    Fault(
        "takes whole trajectories and does not move",
        ("MS18",),
        controller=disobeying(lambda c, link, m, now: isinstance(m, JointTraj)),
    ),
)


def _stands(controller: EmulatedController, now: int) -> bool:
    controller.advance(now)
    return not any(controller._servo.sample(now)[1])


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


def _resuming(sequence: int, duration: float, after: float) -> MessageIn:
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


class _DeadAfterStop(EmulatedController):
    _stopped = False

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        if is_stop(message) and self._servo.in_motion:
            self._stopped = True
        elif self._stopped and isinstance(message, JointTrajPt):
            return [(link, dataclasses.replace(accepted(message), reply_code=2))]
        return super().handle(link, message, now)


def _second_stop_unheard(link: FaultyLink, received: Received) -> Iterable[Received]:
    is_point = isinstance(received, JointTrajPt) and is_stop(received)
    return () if is_point and count(link.memory, "stops") == 2 else (received,)


def _keeps_download(controller: EmulatedController, _: int, message: Message, now: int) -> bool:
    """Answer STOP amid a download and go on as soon as points are forgotten."""
    if is_stop(message) and controller._taking.is_download:
        controller._servo.go(now)
        return True
    return False


STOP = (
    Fault(
        "answers STOP and moves on",
        ("SS02", "SS03"),
        controller=disobeying(lambda c, link, m, now: is_stop(m)),
    ),
    Fault("does not answer STOP in motion", ("SS01",), message_in=_silent_stop),
    Fault("stops a second late", ("SS02",), message_in=_late_stop),
    Fault("goes on by itself after STOP", ("SS03",), message_in=_resuming(1, 0.5, 0.6)),
    Fault("goes home by itself after STOP", ("SS04",), message_in=_resuming(0, 0.2, 0.1)),
    Fault("takes nothing after STOP", ("SS05",), controller=_DeadAfterStop),
    Fault(
        "ignores STOP before it moves",
        ("SS06",),
        controller=disobeying(lambda c, link, m, now: _stands(c, now) and is_stop(m)),
    ),
    Fault(
        "ignores STOP while many points are left",
        ("SS07",),
        controller=disobeying(lambda c, link, m, now: is_stop(m) and len(c._servo.buffer) > 3),
    ),
    Fault("does not answer a second STOP", ("SS08",), message_in=_second_stop_unheard),
    Fault("takes left-over points", ("SS09",), DEVIATES, settings={"strict_sequence": False}),
    Fault(
        "ignores STOP of another client",
        ("SS10",),
        controller=disobeying(
            lambda c, link, m, now: is_stop(m) and c._taking.owner not in (None, link)
        ),
    ),
    Fault(
        "ignores STOP as a topic",
        ("SS11",),
        controller=disobeying(lambda c, link, m, now: is_stop(m) and not is_request(m)),
    ),
    Fault(
        "loses a STOP behind a point",
        ("SS12",),
        bytes_in=lambda _, data: data[:68] if len(data) == 136 else data,
    ),
    Fault(
        "loses a STOP in two pieces",
        ("SS13",),
        bytes_in=lambda _, data: b"" if len(data) in (37, 31) else data,
    ),
    Fault("moves a download that was stopped", ("SS14",), controller=disobeying(_keeps_download)),
    Fault(
        "ignores STOP in a full point",
        ("SS15",),
        controller=disobeying(
            lambda c, link, m, now: is_stop(m) and isinstance(m, JointTrajPtFull)
        ),
    ),
)


def _joint(point: JointTrajPt, value: float) -> JointTrajPt:
    return dataclasses.replace(point, joints=(point.joints[0], value, *point.joints[2:]))


def _finite(point: JointTrajPt) -> JointTrajPt:
    return point if math.isfinite(point.joints[1]) else _joint(point, 0.5)


def _clipped(point: JointTrajPt) -> JointTrajPt:
    value = min(max(point.joints[1], -2.0), 2.0)
    return _joint(point, value) if value != point.joints[1] else point


def _no_ping(link: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[1] == 1 else data


_SilentlyDrops = disobeying(
    lambda c, link, message, now: isinstance(message, JointTrajPt) and abs(message.joints[1]) > 2.0
)
_SilentlyDropsNan = disobeying(
    lambda c, link, message, now: (
        isinstance(message, JointTrajPt)
        and not math.isfinite(message.joints[1] + message.velocity + message.duration)
    )
)


def _rest_is_new(point: JointTrajPt) -> JointTrajPt:
    """Take what follows a refused point for a new trajectory."""
    return dataclasses.replace(point, sequence=0) if point.sequence > 1 else point


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
    Fault("takes what is no number for 0.5", ("LS01", "LS02"), message_in=each_point(_finite)),
    Fault("drops what is no number silently", ("LS01",), DEVIATES, controller=_SilentlyDropsNan),
    Fault(
        "drops a velocity that is no number",
        ("LS03", "LS04"),
        DEVIATES,
        controller=_SilentlyDropsNan,
    ),
    Fault(
        "drops what cannot be silently",
        ("LS05", "LS06"),
        DEVIATES,
        controller=disobeying(
            lambda c, link, m, now: (
                isinstance(m, JointTrajPt) and (m.duration < 0 or m.velocity > 1)
            )
        ),
    ),
    Fault("clips targets to the range", ("LS07",), message_in=each_point(_clipped)),
    Fault("takes targets out of range and stays", ("LS07", "LS08"), controller=_SilentlyDrops),
    Fault(
        "does not check the range, as ABB's does not",
        ("LS07", "LS08"),
        DEVIATES,
        controller=_SilentlyDrops,
        frame_out=_no_ping,
    ),
    Fault("moves faster than the joint may", ("LS09",), controller=_TooFast),
    Fault("moves what follows a refused point", ("LS10",), message_in=each_point(_rest_is_new)),
    Fault("takes full points without a position", ("LS11",), message_in=_any_full_point),
    Fault(
        "takes full points that are no numbers",
        ("LS12",),
        DEVIATES,
        message_in=_not_a_number_is_nothing,
    ),
    Fault("takes points for other robots", ("LS13",), message_in=_any_full_point),
    Fault("jumps to a point without a duration", ("LS15",), controller=_Teleports),
)


class _DiesAfterFive(FaultyService):
    def _motion_opened(self, link: EmulatorLink) -> bool:
        if link.number > 8:
            self.stop_listening()
        return super()._motion_opened(link)


class _OneMotionClient(FaultyService):
    """Takes one motion client in its life."""

    def _motion_opened(self, link: EmulatorLink) -> bool:
        return count(self.memory, "clients") <= 4 and super()._motion_opened(link)


class _ImpatientLink(FaultyLink):
    def connection_made(self, transport: object) -> None:
        super().connection_made(transport)  # type: ignore[arg-type]  # as the loop gave it
        if self.is_motion:
            self.later(1.0, self.abort)


class _NeverForgets(FaultyService):
    """Counts the clients that ever were against the cap."""

    def _motion_opened(self, link: EmulatorLink) -> bool:
        return count(self.memory, "clients") < 16 and super()._motion_opened(link)


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
            link.later(0.05, lambda: self.obey(link, _again(goal, 0.5)))
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
    Fault(
        "answers sixty-four PINGs",
        ("KS08",),
        frame_out=lambda link, data: data if count(link.memory, "replies") <= 64 else b"",
    ),
    Fault("carries on without its client", ("KS10", "KS11"), controller=_CarriesOn),
    Fault(
        "carries on without its client, as ABB's does",
        ("KS10", "KS11"),
        DEVIATES,
        controller=_CarriesOn,
        frame_out=_no_ping,
    ),
    Fault("carries on when its client leaves politely", ("KS10",), service=_CarriesOnAfterClose),
    Fault("resumes when somebody connects", ("KS12",), service=_ResumesOnConnect),
    Fault("takes nothing after a lost link", ("KS13",), controller=_DeadAfterLoss),
    Fault("answers a repeated point twice", ("KS14",), message_in=_answers_repeated_twice),
    Fault("obeys two clients at once", ("KS15",), controller=_AnybodyCommands),
)


def _old_reports(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    waiting = service.memory.setdefault("waiting", [])
    waiting.append(messages)
    return list(waiting.pop(0)) if len(waiting) > 6 else []


class _WrongErrorNumber(EmulatedController):
    def status(self, now: int) -> Status:
        status = super().status(now)
        status.error_code = 4711 if status.in_error else 0
        return status


UNFOUND = (
    (
        Fault("reports what was 60 ms ago", (), settings=AT_USUAL_RATE, state_out=_old_reports),
        "the protocol carries no clock, and a stop is granted 0.5 s",
    ),
    (
        Fault(
            "forgets points from the fiftieth",
            (),
            controller=disobeying(
                lambda c, link, m, now: isinstance(m, JointTrajPt) and m.sequence >= 50
            ),
        ),
        "the tester sends ten: a robot is not to be moved through hundreds",
    ),
    (
        Fault("gives its errors another number", (), controller=_WrongErrorNumber),
        "vendors number their errors as they like",
    ),
)
"""Faults that no check finds, with the reason."""

MOTION_FAULTS = (*TOPICS, *STATUS, *MOTION, *STOP, *LIMITS, *LINK)
