"""Pendants that all jog at once, one in each cell of a server, and their report of its ticks.

Runs as a separate process, `python -m openpendant.tools.bench.jogging_pendants PORT PID SECONDS
PLACE CELL...`, and prints one JSON object. Each state message carries the time of its tick, so the
received messages show the lateness of the server's ticks without that of network and pendant.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from collections import Counter
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import cycle
from pathlib import Path

from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role, joint_array
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Activity,
    Authority,
    AuthorityAction,
    Declare,
    Enabling,
    EnablingPosition,
    Hello,
    HelloReply,
    JogBeat,
    JogEnd,
    JogEnded,
    JogRelease,
    JogSpace,
    JogStart,
    Notices,
    Outcome,
    OutcomeKind,
    ResetStop,
    State,
    StopKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

from .peers import before_ordinary_programs, pin

PERIOD_NS = 10_000_000
"""Between two ticks of the server."""

BEAT = 0.05
"""Between two beats of a key [s]."""

TURN = 40
"""Beats until the direction is reversed, by a new press that takes over."""

_SETTLE = 4.0
"""Until all have taken control and jog [s]."""


class Key(Enum):
    """Aim of a pendant's jog: half of the pendants jog joints, half the tool."""

    JOINTS = "all joints"
    BASE = "tool along z of the base"
    TOOL = "tool along its own z"


KEYS = (Key.JOINTS, Key.BASE, Key.JOINTS, Key.TOOL)
"""Of the pendants in turn."""

DEADLINE = 0.25
"""How long a press, and its enabling device, may be silent [s]."""

SLOT = 0.1
"""Length of the slots in which received messages are counted [s]; some may be left out later."""

ANYWHERE = "any"
"""A place: the system chooses the processor."""

_MOVES = 1e-4
"""A joint faster than this moves [rad/s or m/s]."""


class JoggingPendant(asyncio.Protocol):
    """One pendant: listens, at 100 Hz unless told otherwise, and holds a key, to and fro.

    Each press takes over from the one before, unless the hand is asked to rest between them.

    Attributes:
        ticks: times of the ticks in its state messages [ns].
        dropped: state messages that it was too slow for.
        ended: how often a jog was refused or ended for each reason.
        slots: state messages, and those that showed a jog, by the slot in which they arrived.
    """

    def __init__(
        self, cell: str, key: Key, rate: float = 100.0, *, held: int = TURN, rest: int = 0
    ) -> None:
        """Make one that is not yet connected.

        Args:
            cell: name of the cell.
            key: what it holds.
            rate: state messages a second.
            held: beats that a press lasts.
            rest: beats between a press and the next.
        """
        self.key = key
        self._rate = rate
        self._held, self._rest = held, rest
        self.ticks: list[int] = []
        self.jogging = 0
        self.moving = 0
        self.dropped = 0
        self.ended: Counter[str] = Counter()
        self.slots: dict[int, list[int]] = {}
        self.is_latched = False
        self._cell = cell
        self._wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self._dof = 0
        self._state: State | None = None
        self._requests = 0
        self._press = 0
        self._beats = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Say hello."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._write(Hello(PROTOCOL_VERSION, self._rate, self._cell, "bench"))

    def _write(self, *messages: Message) -> None:
        self._transport.write(b"".join(self._wire.send(message) for message in messages))

    def data_received(self, data: bytes) -> None:
        """Take control when welcomed; note ticks."""
        for message in self._wire.receive(data):
            match message:
                case State():
                    self._state = message
                    self.ticks.append(message.time_s * 1_000_000_000 + message.time_ns)
                    is_jogging = message.activity == Activity.JOGGING
                    self.jogging += is_jogging
                    slot = self.slots.setdefault(int(time.monotonic() / SLOT), [0, 0])
                    slot[0] += 1
                    slot[1] += is_jogging
                    self.is_latched = message.stop != StopKind.NONE
                    self.moving += any(abs(speed) > _MOVES for speed in message.velocities)
                    self.dropped = message.dropped
                case HelloReply():
                    self._dof = message.dof
                    # No press may be silent for longer than the enabling device.
                    self._write(Declare(0, DEADLINE, Notices.UNWANTED, ""))
                    self._take_control()
                case Verdict(code=code) if code != VerdictCode.ACCEPTED:
                    self._press_again(code)
                case Outcome(outcome=OutcomeKind.ABORTED, code=code):
                    self._press_again(code)
                case JogEnded(reason=reason) if reason not in (JogEnd.REPLACED, JogEnd.RELEASED):
                    self.ended[JogEnd(reason).name] += 1

    def _take_control(self) -> None:
        self._requests += 1
        self._write(Authority(self._requests, AuthorityAction.REQUEST))

    def _press_again(self, code: int) -> None:
        """Release the key after a refused or ended jog; the next beat is a new press."""
        self.ended[VerdictCode(code).name] += 1
        self._beats = 0
        if code == VerdictCode.NOT_IN_CONTROL:
            self._take_control()
        elif code == VerdictCode.NOT_ENABLED:
            self._write(Enabling(EnablingPosition.RELEASED))
        elif code == VerdictCode.PROTECTIVE_STOP:
            self._requests += 1
            self._write(Enabling(EnablingPosition.RELEASED), ResetStop(self._requests))

    def forget(self) -> None:
        """Reset all counts."""
        self.ticks.clear()
        self.jogging = self.moving = 0
        self.ended.clear()
        self.slots.clear()

    def beat(self) -> None:
        """Hold the enabling device (training) and the key; turn round now and then."""
        if self._state is None:
            return
        signs: list[Message] = [Enabling(EnablingPosition.HELD)]
        self._beats %= self._held + self._rest
        if self._beats == 0:
            self._press += 1
            signs.append(self._start(self._state))
        elif self._beats < self._held:
            signs.append(JogBeat(self._press, self._beats))
        elif self._beats == self._held:
            self._requests += 1
            signs.append(JogRelease(self._requests, self._press))
        self._write(*signs)
        self._beats += 1

    def _start(self, state: State) -> JogStart:
        rate = 0.3 if self._press % 2 else -0.3
        if self.key is Key.JOINTS:
            space, frame, values = JogSpace.JOINTS, "", [rate] * self._dof
        else:
            frame = "tool" if self.key is Key.TOOL else "base"
            space, values = JogSpace.TOOL, [0.0, 0.0, -rate, 0.0, 0.0, 0.0]
        self._requests += 1
        return JogStart(
            self._requests,
            self._press,
            state.sequence,
            DEADLINE,
            space,
            frame,
            len(values),
            joint_array(values),
        )


@dataclass(frozen=True, slots=True)
class JoggingReport:
    """Figures of a server in one run.

    Attributes:
        late_p50: median lateness of a tick [ms].
        late_p99: of a hundred ticks one was later [ms].
        late_most: the latest [ms].
        cpu: share of one processor that the server took, percent.
        jogging: share of the state messages that showed a jog, percent.
        moving: share of the state messages in which the robot moved, percent.
        dropped: state messages that a pendant was too slow for.
        ended: how often a jog was refused or ended for each reason.
        slots: state messages, and those that showed a jog, by the monotonic start of their slot.
        latched: cells whose stop was latched at the end.
    """

    late_p50: float
    late_p99: float
    late_most: float
    cpu: float
    jogging: float
    moving: float
    keys: dict[str, int]
    dropped: int
    ended: dict[str, int]
    slots: dict[float, list[int]]
    latched: int


def lateness(ticks: list[int], period: int = PERIOD_NS) -> list[int]:
    """Return the lateness of each due tick [ns]; a skipped one is as late as the next.

    No tick is early, and most are hardly late: on the circle of one period, due time lies where
    ticks begin behind the widest gap.

    Args:
        ticks: times of the ticks [ns], rising.
        period: between two due ticks [ns].
    """
    phases = sorted({tick % period for tick in ticks})
    gaps = [(phase - phases[at - 1]) % period or period for at, phase in enumerate(phases)]
    phase = phases[gaps.index(max(gaps))]
    due = ticks[0] - (ticks[0] - phase) % period
    late = []
    for tick in ticks:
        while due <= tick:
            late.append(tick - due)
            due += period
    return late


def _processor_time(pid: int) -> float:
    """Return the processor time of a process so far [s]; Linux only."""
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def _run(port: int, pid: int, seconds: float, cells: list[str]) -> JoggingReport:
    loop = asyncio.get_running_loop()
    pendants = [JoggingPendant(*pair) for pair in zip(cells, cycle(KEYS), strict=False)]
    for pendant in pendants:
        await loop.create_connection(partial(_same, pendant), "127.0.0.1", port)
    stretch = TURN * BEAT / len(pendants)
    keys = [loop.create_task(_hold(each, at * stretch)) for at, each in enumerate(pendants)]
    await asyncio.sleep(_SETTLE)
    for pendant in pendants:
        pendant.forget()
    began, used = loop.time(), _processor_time(pid)
    await asyncio.sleep(seconds)
    cpu = (_processor_time(pid) - used) / (loop.time() - began)
    for key in keys:
        key.cancel()
    await asyncio.gather(*keys, return_exceptions=True)
    late = sorted(lateness(pendants[0].ticks))
    heard = sum(len(pendant.ticks) for pendant in pendants)
    ended: Counter[str] = Counter()
    for pendant in pendants:
        ended += pendant.ended
    return JoggingReport(
        late[len(late) // 2] / 1e6,
        late[len(late) * 99 // 100] / 1e6,
        late[-1] / 1e6,
        100 * cpu,
        100 * sum(pendant.jogging for pendant in pendants) / heard,
        100 * sum(pendant.moving for pendant in pendants) / heard,
        dict(Counter(pendant.key.value for pendant in pendants)),
        sum(pendant.dropped for pendant in pendants),
        dict(ended),
        _slots(pendants),
        sum(pendant.is_latched for pendant in pendants),
    )


def _slots(pendants: list[JoggingPendant]) -> dict[float, list[int]]:
    """Return the counts of all pendants in each slot, by its start [s]."""
    counts: dict[float, list[int]] = {}
    for pendant in pendants:
        for number, (heard, jogging) in pendant.slots.items():
            count = counts.setdefault(number * SLOT, [0, 0])
            count[0] += heard
            count[1] += jogging
    return counts


def _same(pendant: JoggingPendant) -> JoggingPendant:
    return pendant


async def _hold(pendant: JoggingPendant, later: float) -> None:
    """Beat until cancelled, from some time on [s]: thirty hands neither press nor turn in step."""
    await asyncio.sleep(later)
    while True:
        pendant.beat()
        await asyncio.sleep(BEAT)


def main(argv: list[str]) -> None:
    """Run, and print the account as one JSON object."""
    port, pid, seconds, place, *cells = argv
    if place != ANYWHERE:
        pin(0, int(place))
    before_ordinary_programs(0)
    account = asyncio.run(_run(int(port), int(pid), float(seconds), cells))
    print(json.dumps({name: getattr(account, name) for name in JoggingReport.__slots__}))


if __name__ == "__main__":
    main(sys.argv[1:])
