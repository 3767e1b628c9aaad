"""A bench for the fault engine: frames in, and what came out with its times.

Owns the frames and the clock that the engine's tests share.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from openpendant.simplemsg import (
    Codec,
    HeaderOnly,
    JointTrajPt,
    JointTrajPtFull,
    ReplyCode,
    codec_for,
)
from openpendant.tools.packets.faulty.fault_engine import FaultDone, FaultEngine
from openpendant.tools.packets.faulty.fault_script import make_script
from openpendant.tools.packets.live.relay import Action, ProxyLinkId, SendBytes
from openpendant.tools.packets.trace import TraceDirection

MS = 1_000_000
LINK = ProxyLinkId(1, 11000, 1)
UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT
ZEROS = (0.0,) * 10
EXAMPLES = Path(__file__).parents[3] / "examples" / "faults"


def point(sequence: int, codec: Codec | None = None) -> bytes:
    return (codec or codec_for()).encode(JointTrajPt(sequence, ZEROS, 0.1, 1.0))


def full_point(sequence: int) -> bytes:
    return codec_for().encode(JointTrajPtFull(0, sequence, 7, 0.5, ZEROS, ZEROS, ZEROS))


def taken(sequence: int) -> bytes:
    return codec_for().encode(HeaderOnly(11, reply_code=ReplyCode.SUCCESS))


@dataclass
class Bench:
    """An engine, its clock in milliseconds, and what came out: (ms, direction, bytes)."""

    rules: list[dict[str, Any]]
    options: dict[str, Any] = field(default_factory=dict)
    seed: int | None = None

    def __post_init__(self) -> None:
        script = make_script({"rule": self.rules, **self.options}, "test")
        self.done: list[FaultDone] = []
        self.engine = FaultEngine(script, self.seed, self.done.append)
        self.engine.opened(LINK, 0)
        self.now = 0.0
        self.sent: list[tuple[float, TraceDirection, bytes]] = []
        self.others: list[Action] = []

    def feed(self, direction: TraceDirection, *frames: bytes, link: ProxyLinkId = LINK) -> Bench:
        for frame in frames:
            self.note(self.engine.take(direction, link, frame, round(self.now * MS)))
        return self

    def wait(self, ms: float) -> Bench:
        until = self.now + ms
        while (due := self.engine.next_due()) is not None and due <= until * MS:
            self.now = due / MS
            self.note(self.engine.due(due))
        self.now = until
        return self

    def note(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, SendBytes):
                self.sent.append((round(self.now, 3), action.direction, action.data))
            else:
                self.others.append(action)

    def came(self, direction: TraceDirection) -> list[bytes]:
        return [data for _, way, data in self.sent if way is direction]

    def times(self, direction: TraceDirection) -> list[float]:
        return [time for time, way, _ in self.sent if way is direction]


def bench(fault: str, match: dict[str, Any] | None = None, **parameters: Any) -> Bench:
    options: dict[str, Any] = {}
    if "dialect" in parameters:
        options["dialect"] = parameters.pop("dialect")
    return Bench([{"fault": fault, "match": match or {}, **parameters}], options)
