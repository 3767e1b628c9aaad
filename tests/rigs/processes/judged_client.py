"""A scripted client joined with the scripted controller, on a hand-driven clock of 5 ms steps."""

from collections.abc import Iterable, Sequence
from functools import cache

from rigs.faults.client_fault import Fault, Form, Neglect
from rigs.peers.scripted_client import BEGIN, MS, PERIOD, POINTS, Client

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import (
    MOTOMAN,
    STANDARD,
    ByteOrder,
    CommType,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    SpecialSequence,
    joint_array,
)
from openpendant.simplemsg.motoman import (
    MotomanGroup,
    MotomanJointTrajPtFullEx,
)
from openpendant.tools.packets.conformance.check import CheckFinding
from openpendant.tools.packets.conformance.client.check import ClientCheck
from openpendant.tools.packets.conformance.client.controller import (
    Act,
    Action,
    ClientLinkId,
    Do,
    ScriptedController,
    Write,
)
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario
from openpendant.tools.packets.conformance.client.setup import (
    TRIGGERED,
    Mutation,
    Purpose,
    Scenario,
    Setup,
)
from openpendant.tools.packets.trace import Entry

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
            dialect=MOTOMAN if self.form.is_motoman else STANDARD,
            order=ByteOrder.LITTLE,
            limits=LIMITS,
        )
        self.now = 0
        self.controller = ScriptedController(self.setup, (0.0,) * 6, at_point=5)
        self.client = Client(self, fault)
        self._numbers = dict.fromkeys(Purpose, 0)
        self._open: set[ClientLinkId] = set()
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

    def connect(self, purpose: Purpose) -> ClientLinkId:
        self._numbers[purpose] += 1
        link = ClientLinkId(purpose, PORTS[purpose], self._numbers[purpose])
        self._open.add(link)
        self.controller.connected(link, self.now)
        return link

    def send(self, link: ClientLinkId, data: bytes) -> None:
        if link in self._open:
            self.perform(self.controller.received(link, data, self.now))

    def close(self, link: ClientLinkId) -> None:
        self._open.discard(link)
        self.controller.disconnected(link, self.now)

    def perform(self, actions: Sequence[Action]) -> None:
        for action in actions:
            match action:
                case Write(link=link, data=data) if link in self._open:
                    self.client.hear(link, data)
                case Do(act=Act.AWAY):
                    for link in sorted(self._open, key=lambda one: one.port):
                        self._open.discard(link)
                        self.client.lost(link)
                    self.client.reconnect = None
                case Do(act=Act.BACK):
                    self.client.state = self.connect(Purpose.STATE)
                    self.client.reconnect = self.now + 50 * MS
                case Do(link=gone) if gone is not None and gone in self._open:
                    self._open.discard(gone)
                    self.client.lost(gone)

    def point(self, index: int) -> Message:
        """Return a point of a joint motion that begins and ends at rest."""
        joints = joint_array([WAY * index] * 6)
        moves = 0 < index < POINTS - 1
        speed = joint_array([WAY / PERIOD if moves else 0.0] * 6)
        time = PERIOD * index
        match self.form:
            case Form.FULL | Form.MOTOMAN:
                return JointTrajPtFull(0, index, 7, time, joints, speed, joint_array(()))
            case Form.GROUPS:
                group = MotomanGroup(0, 7, time, joints, speed, joint_array(()))
                return MotomanJointTrajPtFullEx(2, index, (group, _of_group(group, 1)))
        sequence = index
        if self.form is Form.DOWNLOAD:
            ends = {0: int(SpecialSequence.START_DOWNLOAD), POINTS - 1: int(SpecialSequence.END)}
            sequence = ends.get(index, index)
        point = JointTrajPt(sequence, joints, 0.15, PERIOD if index else 0.0)
        if self.form is Form.DOWNLOAD:
            point.comm_type = CommType.TOPIC
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
