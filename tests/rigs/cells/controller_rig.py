"""An emulated controller on a hand-driven clock: lists in, lists out, times in milliseconds.

Owns the double that the emulator's core tests share. Two joints with round limits, so that every
expectation can be worked out by hand: ±2 rad, 2 rad/s, 4 rad/s².
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

from openpendant import simplemsg as wire
from openpendant.controller_emulator.core.admission import Admission, Tolerances
from openpendant.controller_emulator.core.controller import EmulatedController
from openpendant.controller_emulator.core.signals import DigitalSignals
from openpendant.controller_emulator.error_codes import ViolationKind
from openpendant.controller_emulator.interpolation.segment import State
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.controller_emulator.profiles import GENERIC
from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.pendant import OperatorAction

MS = 1_000_000
LINK = 1
LIMITS = JointLimits(
    names=("shoulder", "elbow"),
    lower=(-2.0, -2.0),
    upper=(2.0, 2.0),
    velocity=(2.0, 2.0),
    acceleration=(4.0, 4.0),
    prismatic=(False, False),
)
SUCCESS, FAILURE = wire.ReplyCode.SUCCESS, wire.ReplyCode.FAILURE


def float32(value: float) -> float:
    """Return what four bytes keep of a number."""
    (rounded,) = struct.unpack("<f", struct.pack("<f", value))
    return float(rounded)


def ratio_point(
    sequence: int,
    joints: Sequence[float],
    duration: float,
    *,
    comm_type: wire.CommType = wire.CommType.REQUEST,
    velocity: float = 0.1,
) -> wire.JointTrajPt:
    return wire.JointTrajPt(
        sequence, wire.joint_array(joints), velocity, duration, comm_type=comm_type
    )


def full_point(
    sequence: int,
    time: float,
    joints: Sequence[float],
    velocity: Sequence[float] = (0.0, 0.0),
    acceleration: Sequence[float] | None = None,
    *,
    valid_fields: int | None = None,
    robot_id: int = 0,
) -> wire.JointTrajPtFull:
    fields = 7 if acceleration is None else 15
    return wire.JointTrajPtFull(
        robot_id,
        sequence,
        fields if valid_fields is None else valid_fields,
        time,
        wire.joint_array(joints),
        wire.joint_array(velocity),
        wire.joint_array(acceleration or ()),
    )


STOP = ratio_point(-4, (), 0.0, velocity=0.0)


@dataclass
class ControllerRig:
    """A controller, its clock, and everything that it has sent."""

    buffer_depth: int = 200
    start: tuple[float, ...] = (0.0, 0.0)
    limits: JointLimits = LIMITS
    is_strict: bool = True
    operator_events: bool = True
    signals: DigitalSignals | None = None
    start_rule: StartRule = field(default_factory=lambda: StartRule(1, 0, 0, 0))
    now: int = 0
    sent: list[tuple[int, wire.Message]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.controller = EmulatedController(
            Admission(self.limits, Tolerances()),
            self.start,
            GENERIC,
            buffer_depth=self.buffer_depth,
            start_rule=self.start_rule,
            is_strict=self.is_strict,
            operator_events=self.operator_events,
            signals=self.signals,
            now=self.now,
        )

    @property
    def status(self) -> wire.Status:
        return self.controller.status(self.now)

    @property
    def state(self) -> State:
        return self.controller.motion(self.now)

    @property
    def position(self) -> tuple[float, ...]:
        return self.state[0]

    @property
    def velocity(self) -> tuple[float, ...]:
        return self.state[1]

    @property
    def violations(self) -> dict[ViolationKind, int]:
        return dict(self.controller.referee.counts)

    def send(self, message: wire.Received, link: int = LINK) -> list[tuple[int, int, int]]:
        """Hand in a message and return (link, type, code) of what is sent in turn."""
        return self._keep(self.controller.handle(link, message, self.now))

    def code(self, message: wire.Received, link: int = LINK) -> int | None:
        """Hand in a request and return the code of its reply, None if it is withheld."""
        replies = [code for number, _, code in self.send(message, link) if number == link]
        return replies[-1] if replies else None

    def stream(self, *messages: wire.Message) -> list[int | None]:
        return [self.code(message) for message in messages]

    def lose(self, link: int = LINK) -> list[tuple[int, int, int]]:
        return self._keep(self.controller.disconnected(link, self.now))

    def operate(self, action: OperatorAction) -> list[tuple[int, int, int]]:
        return self._keep(self.controller.operate(action, self.now))

    def wait(self, milliseconds: float) -> list[tuple[int, int, int]]:
        """Let time pass in one step."""
        self.now += round(milliseconds * MS)
        return self._keep(self.controller.advance(self.now))

    def states(self, milliseconds: int, step: int = 1) -> list[State]:
        """Let time pass in steps and return the state after each."""
        states = []
        for _ in range(0, milliseconds, step):
            self.wait(step)
            states.append(self.state)
        return states

    def _keep(self, outgoing: list[tuple[int, wire.Message]]) -> list[tuple[int, int, int]]:
        self.sent += outgoing
        return [(link, wire.message_type(m), m.reply_code) for link, m in outgoing]
