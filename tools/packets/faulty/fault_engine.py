"""Fault engine: the choice of each frame's fault, and of the time at which its bytes leave.

Pure: frames and times come in, actions go out; the relay cuts a proxy's bytes into frames for it.
The same script, seed and input give the same output. What a fault does is `fault_case`'s business.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from openpendant.simplemsg import DIALECTS
from openpendant.simplemsg.framing import Frame, Mode, Splitter

from ..live.relay import Action, CloseBoth, EndStream, Freeze, ProxyLinkId, ResetBoth
from ..trace import TraceDirection
from . import fault_script as faults
from .fault_case import FaultCase, FrameForm, is_reply, is_request, sequence_of
from .fault_lane import OPPOSITE, Awaited, Lane, Prepared, Traffic, nanoseconds, pay
from .fault_script import FaultScript, type_number

_COMM_TYPES = {faults.Exchange.TOPIC: 1, faults.Exchange.REQUEST: 2, faults.Exchange.REPLY: 3}


@dataclass(frozen=True, slots=True)
class FaultDone:
    """A fault that was done, or that a frame turned out not to allow.

    Attributes:
        time: when [ns].
        rule: number of the rule, from 1.
        detail: what was done to it, in words.
    """

    time: int
    rule: int
    fault: str
    link: ProxyLinkId
    direction: TraceDirection
    frame: bytes
    detail: str


class FaultEngine:
    """Application of a script to the frames of all connections."""

    def __init__(
        self,
        script: FaultScript,
        seed: int | None = None,
        log: Callable[[FaultDone], None] = lambda done: None,
    ) -> None:
        """Make an engine that has seen nothing yet; without a seed that of the script counts."""
        seed = script.seed if seed is None else seed
        self._form = FrameForm(DIALECTS[script.dialect], script.real)
        self._log = log
        self._rules = [
            Prepared(number, rule, _number_of(rule, script.dialect), Random(f"{seed}/{number}"))
            for number, rule in enumerate(script.rule, 1)
        ]
        self._traffic: dict[ProxyLinkId, Traffic] = {}

    def opened(self, link: ProxyLinkId, now: int) -> None:
        """Note a new connection."""
        lanes = {direction: Lane(link, direction) for direction in TraceDirection}
        self._traffic[link] = Traffic(now, lanes)

    def forget(self, link: ProxyLinkId) -> None:
        """Note that a connection is gone."""
        self._traffic.pop(link, None)

    def take(
        self, direction: TraceDirection, link: ProxyLinkId, frame: bytes, now: int
    ) -> list[Action]:
        """Take a whole frame at a time [ns]; return what is to be done now."""
        traffic = self._traffic.get(link)
        if traffic is None:
            return []
        if is_reply(frame) and self._settle(traffic, direction, link, frame, now):
            return self._release(link, traffic, now)
        prepared = self._first_that_fits(traffic, direction, link, frame, now)
        expects = is_request(frame)
        if prepared is None:
            self._forward(traffic, direction, frame, now)
        else:
            prepared.done += 1
            case = FaultCase(self._form, prepared, traffic, direction, link, frame, now)
            detail, expects = case.apply()
            if detail:
                self._note(prepared, link, direction, frame, now, detail)
        if expects:
            traffic.awaited[direction].append(Awaited())
        pay(traffic, direction, now)
        return self._release(link, traffic, now)

    def pass_on(
        self, direction: TraceDirection, link: ProxyLinkId, data: bytes, now: int
    ) -> list[Action]:
        """Forward stray bytes behind what waits; no rule fits them."""
        traffic = self._traffic.get(link)
        if traffic is None:
            return []
        traffic.lanes[direction].put(data, now)
        return self._release(link, traffic, now)

    def end(self, direction: TraceDirection, link: ProxyLinkId, now: int) -> list[Action]:
        """Forward the end of a stream behind what waits."""
        traffic = self._traffic.get(link)
        if traffic is None:
            return []
        traffic.lanes[direction].put_action(EndStream(link, direction), now)
        return self._release(link, traffic, now)

    def due(self, now: int) -> list[Action]:
        """Return what was put off until now."""
        actions: list[Action] = []
        for link, traffic in list(self._traffic.items()):
            actions += self._release(link, traffic, now)
        return actions

    def next_due(self) -> int | None:
        """Return when `due` has something to say next, None for never."""
        lanes = [lane for traffic in self._traffic.values() for lane in traffic.lanes.values()]
        times = [due for lane in lanes if (due := lane.next_due()) is not None]
        return min(times, default=None)

    def held(self, link: ProxyLinkId, direction: TraceDirection) -> int:
        """Return the bytes of a direction that wait."""
        traffic = self._traffic.get(link)
        return traffic.lanes[direction].held if traffic else 0

    def _settle(
        self, traffic: Traffic, direction: TraceDirection, link: ProxyLinkId, frame: bytes, now: int
    ) -> bool:
        """Match a reply with its request; return True if that decides about the reply."""
        asked = OPPOSITE[direction]
        if not traffic.awaited[asked]:
            return False
        awaited = traffic.awaited[asked].popleft()
        lane = traffic.lanes[direction]
        if awaited.lost_by is not None:
            self._note(awaited.lost_by, link, direction, frame, now, "the reply is lost")
        elif awaited.withheld_by is not None and isinstance(awaited.withheld_by.rule, faults.Busy):
            ms = awaited.withheld_by.rule.ms
            lane.put(frame, now, delay=nanoseconds(ms))
            self._note(awaited.withheld_by, link, direction, frame, now, f"withheld {ms:g} ms")
        else:
            return False
        pay(traffic, asked, now)
        return True

    def _forward(self, traffic: Traffic, direction: TraceDirection, frame: bytes, now: int) -> None:
        traffic.lanes[direction].put(frame, now)
        if is_reply(frame):
            pay(traffic, OPPOSITE[direction], now)

    def _first_that_fits(
        self, traffic: Traffic, direction: TraceDirection, link: ProxyLinkId, frame: bytes, now: int
    ) -> Prepared | None:
        age = (now - traffic.opened) / 1e9
        header = Frame(frame)
        for prepared in self._rules:
            if (
                _fits_header(prepared, direction, header)
                and _fits_link(prepared.rule.match, link, age)
                and self._fits_sequence(prepared.rule.match, frame)
                and _is_chosen(prepared)
            ):
                return prepared
        return None

    def _fits_sequence(self, match: faults.Match, frame: bytes) -> bool:
        return match.sequence is None or (sequence_of(frame, self._form) == match.sequence)

    def _note(
        self,
        prepared: Prepared,
        link: ProxyLinkId,
        direction: TraceDirection,
        frame: bytes,
        now: int,
        detail: str,
    ) -> None:
        fault = prepared.rule.fault
        self._log(FaultDone(now, prepared.number, fault, link, direction, frame, detail))

    def _release(self, link: ProxyLinkId, traffic: Traffic, now: int) -> list[Action]:
        actions: list[Action] = []
        for lane in traffic.lanes.values():
            for action in lane.release(now):
                actions.append(action)
                if isinstance(action, CloseBoth | ResetBoth | Freeze):
                    self.forget(link)
                    return actions
        return actions


def _number_of(rule: faults.Rule, dialect: str) -> int | None:
    wanted = rule.match.type
    return type_number(wanted, dialect) if isinstance(wanted, str) else wanted


def _fits_header(prepared: Prepared, direction: TraceDirection, header: Frame) -> bool:
    match = prepared.rule.match
    return (
        (match.direction is None or match.direction.direction is direction)
        and (prepared.msg_type is None or prepared.msg_type == header.msg_type)
        and (match.comm is None or _COMM_TYPES[match.comm] == header.comm_type)
        and (match.reply_code is None or match.reply_code == header.reply_code)
    )


def _fits_link(match: faults.Match, link: ProxyLinkId, age: float) -> bool:
    return (
        match.connection in (None, link.number)
        and match.pair in (None, link.pair)
        and (match.after_s is None or age >= match.after_s)
        and (match.before_s is None or age < match.before_s)
    )


def _is_chosen(prepared: Prepared) -> bool:
    """Count a frame that fits; return True if the rule chooses it."""
    match = prepared.rule.match
    prepared.fitted += 1
    return (
        (match.times is None or prepared.done < match.times)
        and (match.nth is None or prepared.fitted == match.nth)
        and (match.every is None or prepared.fitted % match.every == 0)
        and (match.probability is None or prepared.chance.random() < match.probability)
    )


class FaultRelay:
    """A `Relay` that lets an engine decide about every frame.

    Bytes in which no frame can be found are forwarded as they are. A frame is forwarded when it is
    complete; what there is of one when its sender ends is forwarded, too.
    """

    def __init__(self, engine: FaultEngine) -> None:
        self.frames = 0
        self._engine = engine
        self._splitters: dict[ProxyLinkId, dict[TraceDirection, Splitter]] = {}

    def opened(self, link: ProxyLinkId, now: int) -> None:
        """Add a new connection."""
        self._splitters[link] = {direction: Splitter(Mode.ONLOOKER) for direction in TraceDirection}
        self._engine.opened(link, now)

    def refused(self, link: ProxyLinkId, reason: str, now: int) -> None:
        """Do nothing: the client is closed, and `closed` follows."""

    def received(
        self, link: ProxyLinkId, direction: TraceDirection, data: bytes, now: int
    ) -> list[Action]:
        """Cut bytes into frames and ask the engine about each."""
        actions: list[Action] = []
        for piece in self._splitters[link][direction].feed(data):
            if piece.is_frame:
                self.frames += 1
                actions += self._engine.take(direction, link, piece.data, now)
            else:
                actions += self._engine.pass_on(direction, link, piece.data, now)
        return actions

    def ended(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a FIN on behind what waits."""
        actions: list[Action] = []
        for piece in self._splitters[link][direction].finish():
            actions += self._engine.pass_on(direction, link, piece.data, now)
        return actions + self._engine.end(direction, link, now)

    def reset(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a RST on at once; what waits is lost."""
        self._engine.forget(link)
        return [ResetBoth(link)]

    def closed(self, link: ProxyLinkId, now: int) -> None:
        """Forget a connection."""
        self._engine.forget(link)
        del self._splitters[link]

    def due(self, now: int) -> list[Action]:
        """Return what was put off until now."""
        return self._engine.due(now)

    def next_due(self) -> int | None:
        """Return when `due` has something to say next."""
        return self._engine.next_due()

    def held(self, link: ProxyLinkId, direction: TraceDirection) -> int:
        """Return the bytes that are kept back."""
        return self._engine.held(link, direction)


def fault_to_json(done: FaultDone, began: int) -> dict[str, Any]:
    """Return a line of the log that began at a time [ns]."""
    return {
        "t": (done.time - began) / 1e9,
        "rule": done.rule,
        "fault": done.fault,
        "detail": done.detail,
        "dir": done.direction.value,
        "port": done.link.port,
        "conn": done.link.number,
        "hex": done.frame.hex(),
    }
