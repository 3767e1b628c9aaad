"""A client that does everything right, unless it is told what to do wrong, and how it is judged.

A `Fault` changes a message or the bytes of a frame, or makes the client neglect something. No
sockets: client and scripted controller are joined on a hand-driven clock of 5 ms steps.
"""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Protocol

from rigs.faults.faulty_clients import Fault, Form, Neglect

from openpendant import simplemsg as wire
from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.motoman import (
    MotomanGroup,
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanMotionReply,
)
from openpendant.tools.packets.conformance.check import CheckFinding
from openpendant.tools.packets.conformance.client import controller
from openpendant.tools.packets.conformance.client.check import ClientCheck
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario
from openpendant.tools.packets.conformance.client.setup import (
    TRIGGERED,
    Mutation,
    Purpose,
    Scenario,
    Setup,
)
from openpendant.tools.packets.trace import Entry

MS = 1_000_000
BEGIN = 300 * MS

POINTS = 30
PERIOD = 0.1
LEAD = 0.15
"""Points are sent so far ahead [s]."""


class Wire(Protocol):
    """What carries a client's bytes, and what it is told to send."""

    now: int
    form: Form
    setup: Setup

    def connect(self, purpose: Purpose) -> controller.ClientLinkId: ...

    def send(self, link: controller.ClientLinkId, data: bytes) -> None: ...

    def close(self, link: controller.ClientLinkId) -> None: ...

    def point(self, index: int) -> wire.Message: ...


@dataclass
class Client:
    """One client: a motion and a state link, and one trajectory."""

    rig: Wire
    fault: Fault
    motion: controller.ClientLinkId | None = None
    state: controller.ClientLinkId | None = None
    index: int = 0
    awaiting: int | None = None
    due: int = BEGIN
    asked_ready: bool = False
    over: bool = False
    began: bool = False
    status: wire.Status | None = None
    last_report: int | None = None
    reconnect: int | None = None
    restarted: bool = False
    retrying: bool = False
    extras: bool = False
    second: controller.ClientLinkId | None = None
    buffers: dict[controller.ClientLinkId, bytearray] = field(default_factory=dict)

    def neglects(self, what: Neglect) -> bool:
        return self.fault.neglects is what

    def encode(self, message: wire.Message) -> bytes:
        return wire.codec_for(self.rig.setup.dialect, self.fault.order).encode(message)

    # Time.

    def tick(self) -> None:
        now = self.rig.now
        if self.reconnect is not None and now >= self.reconnect:
            self.reconnect = None
            self.motion = self.rig.connect(Purpose.MOTION)
            self.due = now + 50 * MS
            if self.neglects(Neglect.NEW_BEGINNING):
                self.send_stop()
        if self.motion is None or self.over or now < self.due:
            return
        self._look_around(now)
        if self.over or now < self.due:
            return
        if self.awaiting is not None and not self.neglects(Neglect.WAIT_FOR_REPLY):
            if now - self.awaiting > 1_000 * MS and not self.neglects(Neglect.PATIENCE):
                self.abandon()
            return
        if not self.may_begin(now):
            return
        self.advance(now)

    def _look_around(self, now: int) -> None:
        """Abandon the trajectory where the controller is in trouble."""
        if not self.began:
            return
        stopped = self.status is not None and self.status.e_stopped == 1
        if stopped and not self.neglects(Neglect.E_STOP) and not self.retrying:
            self.abandon()
            if self.neglects(Neglect.POWER):
                self.over, self.retrying = False, True
                self.index, self.awaiting, self.due = 0, None, now + 500 * MS
        silent = self.last_report is not None and now - self.last_report > 500 * MS
        if silent and not self.restarted and not self.neglects(Neglect.SILENCE):
            self.abandon()

    def may_begin(self, now: int) -> bool:
        if self.began:
            return True
        if self.neglects(Neglect.FIRST_REPORT):
            return True
        if self.status is None:
            return False
        return self.status.motion_possible == 1 or self.neglects(Neglect.MOTION_POSSIBLE)

    def advance(self, now: int) -> None:
        assert self.motion is not None
        needs_ready = self.rig.form.is_motoman and not self.neglects(Neglect.READY_QUESTION)
        if needs_ready and not self.asked_ready:
            self.asked_ready = True
            self.awaiting = now
            self.write(self.motion, self.command(200101))
            return
        if self.index >= POINTS:
            self.over = True
            return
        if self.fault.stops_at == self.index and self.began:
            self.leave()
            return
        self.began = True
        index = self.index
        if self.rig.form is Form.DOWNLOAD or self.neglects(Neglect.WAIT_FOR_REPLY):
            self.index += 1
            self.due = now + 10 * MS
        else:
            self.awaiting = now
        self.send_point(index)

    # What it sends.

    def command(self, number: int) -> wire.Message:
        return MotomanMotionCtrl(0, 0, number, wire.joint_array(()))

    def send_point(self, index: int) -> None:
        fault = self.fault
        message = self.rig.point(index)
        hit = fault.at is None or fault.at == index
        if hit and fault.point is not None:
            message = fault.point(message)
        link = self.motion
        if self.neglects(Neglect.ONE_LINK) and index % 2:
            if self.second is None:
                self.second = self.rig.connect(Purpose.MOTION)
            link = self.second
        assert link is not None
        data = self.encode(message)
        if hit and self.neglects(Neglect.WHOLE_FRAME):
            self.rig.send(link, data[:40])
            self.rig.close(link)
            self.motion, self.over = None, True
            return
        for piece in fault.cut(data) if hit and fault.cut is not None else [data]:
            self.rig.send(link, piece)
        if index == 3 and not self.extras:
            self.send_extras(link)

    def send_extras(self, link: controller.ClientLinkId) -> None:
        self.extras = True
        for extra, where in ((self.fault.extra, link), (self.fault.extra_state, self.state)):
            if extra is not None and where is not None:
                self.rig.send(where, extra if isinstance(extra, bytes) else self.encode(extra))
        if self.neglects(Neglect.CALM):
            for _ in range(12):
                self.rig.close(self.rig.connect(Purpose.STATE))

    def write(self, link: controller.ClientLinkId, message: wire.Message) -> None:
        self.rig.send(link, self.encode(message))

    def send_stop(self) -> None:
        if self.motion is None:
            return
        message = self.command(200111) if self.rig.form.is_motoman else _stop()
        self.write(self.motion, self.fault.stop(message) if self.fault.stop else message)

    def abandon(self) -> None:
        self.over = True
        self.send_stop()

    def leave(self) -> None:
        """End the trajectory in its middle, as its user wants."""
        assert self.motion is not None
        if not self.neglects(Neglect.STOP_BEFORE_LEAVING):
            self.send_stop()
        if self.neglects(Neglect.STOP_ENDS):
            self.send_point(self.index)
        if self.neglects(Neglect.READY_AFTER_STOP):
            self.send_point(0)
        self.over = True
        self.rig.close(self.motion)
        self.motion = None

    # What it hears.

    def hear(self, link: controller.ClientLinkId, data: bytes) -> None:
        buffer = self.buffers.setdefault(link, bytearray())
        buffer += data
        while len(buffer) >= 4:
            size = int.from_bytes(buffer[:4], "little") + 4
            if len(buffer) < size:
                return
            frame = bytes(buffer[:size])
            del buffer[:size]
            self.take(link, frame)

    def take(self, link: controller.ClientLinkId, frame: bytes) -> None:
        comm_type, code = struct.unpack_from("<2i", frame, 8)
        if comm_type == wire.CommType.REPLY and code == 0:
            self.answered(None)
            return
        message = wire.codec_for(self.rig.setup.dialect).decode(frame)
        if comm_type == wire.CommType.REQUEST:
            self.asked(link, message)
        elif comm_type == wire.CommType.REPLY:
            self.answered(message)
        elif isinstance(message, wire.Status):
            self.status = message
        elif isinstance(message, wire.JointPosition | wire.JointFeedback):
            self.last_report = self.rig.now
        elif self.neglects(Neglect.SURVIVING):
            self.rig.close(link)
            self.over = True

    def asked(self, link: controller.ClientLinkId, message: wire.Message) -> None:
        if self.neglects(Neglect.ANSWERING):
            return
        match wire.message_type(message):
            case wire.MsgType.PING:
                reply: wire.Message = wire.accepted(message)
            case wire.MsgType.STATUS if isinstance(message, wire.Status):
                reply = replace(
                    message, comm_type=wire.CommType.REPLY, reply_code=wire.ReplyCode.SUCCESS
                )
            case _:
                reply = wire.refused(message)
        data = self.encode(self.fault.reply(reply) if self.fault.reply else reply)
        for piece in self.fault.cut_reply(data) if self.fault.cut_reply else [data]:
            self.rig.send(link, piece)

    def answered(self, reply: wire.Message | None) -> None:
        now = self.rig.now
        if self.awaiting is None:
            return
        self.awaiting = None
        if self.over:
            return
        self.due = now + 5 * MS
        if self.asked_ready and not self.began:
            denied = isinstance(reply, MotomanMotionReply) and reply.result != 0
            self.over = denied and not self.neglects(Neglect.READY_ANSWER)
            return
        if isinstance(reply, MotomanMotionReply) and reply.result == 1:
            if self.neglects(Neglect.BUSY_POINT):
                self.index += 1
            if self.neglects(Neglect.BUSY_PAUSE):
                self.awaiting = now
                self.send_point(self.index)
            return
        if self._is_bad(reply):
            self.abandon()
            return
        self.index += 1
        self.due = max(self.due, BEGIN + round((self.index * PERIOD - LEAD) * 1e9))

    def _is_bad(self, reply: wire.Message | None) -> bool:
        if reply is None:
            return not self.neglects(Neglect.REPLY_CODE)
        if isinstance(reply, MotomanMotionReply):
            if reply.reply_code == wire.ReplyCode.FAILURE and not self.neglects(Neglect.HEADER):
                return True
            return reply.result != 0 and not self.neglects(Neglect.REFUSAL)
        sent = (
            wire.MsgType.JOINT_TRAJ_PT_FULL
            if self.rig.form is Form.FULL
            else wire.MsgType.JOINT_TRAJ_PT
        )
        if wire.message_type(reply) != sent:
            return not self.neglects(Neglect.REPLY_TYPE)
        return reply.reply_code != wire.ReplyCode.SUCCESS and not self.neglects(Neglect.REFUSAL)

    def lost(self, link: controller.ClientLinkId) -> None:
        """Take note that the controller closed a connection."""
        self.buffers.pop(link, None)
        if link == self.state:
            self.state = None
            careless = self.neglects(Neglect.RESTART) or self.neglects(Neglect.STATE_LOST)
            self.restarted = careless
            if self.began and not careless:
                self.abandon()
            return
        self.motion = None
        self.over = self.over or self.rig.form is Form.DOWNLOAD
        if self.over:
            return
        unanswered = self.awaiting is not None
        self.awaiting = None
        if unanswered and self.neglects(Neglect.UNANSWERED_POINT):
            self.index += 1
        if self.neglects(Neglect.ORDER_AFTER_RECONNECT):
            self.index += 4
        self.reconnect = self.rig.now + 250 * MS


def _stop() -> wire.Message:
    return wire.JointTrajPt(wire.SpecialSequence.STOP, wire.joint_array(()), 0.0, 0.0)


STEP = 5 * MS
END = 6_000 * MS
"""Three seconds of motion, and what may come of it until the last patience ends."""

PORTS = {Purpose.MOTION: 11000, Purpose.STATE: 11002}

WAY = 0.02
"""Each joint moves so far from point to point [rad]."""

LIMITS = JointLimits(
    names=tuple(f"joint {number}" for number in range(1, 7)),
    lower=(-2.0,) * 6,
    upper=(2.0,) * 6,
    velocity=(2.0,) * 6,
    acceleration=(4.0,) * 6,
    prismatic=(False,) * 6,
)


class Rig:
    """A client and the scripted controller, joined by two lists."""

    def __init__(self, fault: Fault) -> None:
        self.form = fault.form
        self.setup = Setup(
            dialect=wire.MOTOMAN if self.form.is_motoman else wire.STANDARD,
            order=wire.ByteOrder.LITTLE,
            limits=LIMITS,
        )
        self.now = 0
        self.controller = controller.ScriptedController(self.setup, (0.0,) * 6, at_point=5)
        self.client = Client(self, fault)
        self._numbers = dict.fromkeys(Purpose, 0)
        self._open: set[controller.ClientLinkId] = set()
        self._away = False

    def play(self, scenario: Scenario) -> list[Entry]:
        self.controller.begin(scenario, self.now)
        self.client.motion = self.connect(Purpose.MOTION)
        blind = self.client.neglects(Neglect.FIRST_REPORT)
        self.client.state = None if blind else self.connect(Purpose.STATE)
        while self.now < END:
            self.now += STEP
            if blind and self.now == 2 * BEGIN:
                self.client.state = self.connect(Purpose.STATE)
            self.perform(self.controller.due(self.now))
            if self.now == BEGIN:
                self.controller.note(TRIGGERED, self.now)
            self.client.tick()
        return self.controller.trace

    def connect(self, purpose: Purpose) -> controller.ClientLinkId:
        self._numbers[purpose] += 1
        link = controller.ClientLinkId(purpose, PORTS[purpose], self._numbers[purpose])
        self._open.add(link)
        self.controller.connected(link, self.now)
        return link

    def send(self, link: controller.ClientLinkId, data: bytes) -> None:
        if link in self._open:
            self.perform(self.controller.received(link, data, self.now))

    def close(self, link: controller.ClientLinkId) -> None:
        self._open.discard(link)
        self.controller.disconnected(link, self.now)

    def perform(self, actions: Sequence[controller.Action]) -> None:
        for action in actions:
            match action:
                case controller.Write(link=link, data=data) if link in self._open:
                    self.client.hear(link, data)
                case controller.Do(act=controller.Act.AWAY):
                    for link in sorted(self._open, key=lambda one: one.port):
                        self._open.discard(link)
                        self.client.lost(link)
                    self.client.reconnect = None
                case controller.Do(act=controller.Act.BACK):
                    self.client.state = self.connect(Purpose.STATE)
                    self.client.reconnect = self.now + 50 * MS
                case controller.Do(link=gone) if gone is not None and gone in self._open:
                    self._open.discard(gone)
                    self.client.lost(gone)

    def point(self, index: int) -> wire.Message:
        """Return a point of a joint motion that begins and ends at rest."""
        joints = wire.joint_array([WAY * index] * 6)
        moves = 0 < index < POINTS - 1
        speed = wire.joint_array([WAY / PERIOD if moves else 0.0] * 6)
        time = PERIOD * index
        match self.form:
            case Form.FULL | Form.MOTOMAN:
                return wire.JointTrajPtFull(0, index, 7, time, joints, speed, wire.joint_array(()))
            case Form.GROUPS:
                group = MotomanGroup(0, 7, time, joints, speed, wire.joint_array(()))
                return MotomanJointTrajPtFullEx(2, index, (group, _of_group(group, 1)))
        sequence = index
        if self.form is Form.DOWNLOAD:
            ends = {
                0: int(wire.SpecialSequence.START_DOWNLOAD),
                POINTS - 1: int(wire.SpecialSequence.END),
            }
            sequence = ends.get(index, index)
        point = wire.JointTrajPt(sequence, joints, 0.15, PERIOD if index else 0.0)
        if self.form is Form.DOWNLOAD:
            point.comm_type = wire.CommType.TOPIC
        return point


def _of_group(group: MotomanGroup, number: int) -> MotomanGroup:
    return MotomanGroup(
        number,
        group.valid_fields,
        group.time,
        group.positions,
        group.velocities,
        group.accelerations,
    )


def judge(fault: Fault) -> dict[str, CheckFinding]:
    """Play a client with a fault and return the findings by number of the check."""
    return _judged_by(fault, CHECKS)


def judge_by_its_check(fault: Fault) -> CheckFinding:
    """Play a client with a fault and return what the check says that has to find it."""
    return _judged_by(fault, [_CHECKS[fault.check]])[fault.check]


@cache
def findings_of_correct(mutation: Mutation, form: Form) -> dict[str, CheckFinding]:
    """Return the findings on a client without a fault, which is judged once."""
    return judge(Fault("nothing", "", mutation, form))


def _judged_by(fault: Fault, checks: Iterable[ClientCheck]) -> dict[str, CheckFinding]:
    rig = Rig(fault)
    return judge_scenario(rig.play(Scenario(fault.mutation)), rig.setup, checks)


_CHECKS = {check.number: check for check in CHECKS}
