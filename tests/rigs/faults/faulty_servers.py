"""An emulated controller that breaks one rule, and everything else is the real emulator.

Owns where a fault may reach in: the bytes of a link, its messages, its replies, what the state port
says, and the controller itself. Which rules are broken is the business of the tables that use it.
"""

from __future__ import annotations

import asyncio
import dataclasses
import struct
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from rigs.cells.controller_rig import LIMITS, MS
from rigs.processes.judged_server import HALF_RATE

from openpendant import simplemsg as wire
from openpendant.controller_emulator.core.admission import Admission, Tolerances
from openpendant.controller_emulator.core.controller import EmulatedController, Outgoing
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.controller_emulator.profiles import GENERIC
from openpendant.controller_emulator.shell.links import EmulatorLink, LinkEvents
from openpendant.controller_emulator.shell.service import EmulatorPorts, Service
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg.journal import Journal
from openpendant.tools.packets.conformance.check import CheckVerdict, Judgement, Profile
from openpendant.tools.packets.conformance.server.checks import ServerCheck, server_checks
from openpendant.tools.packets.conformance.server.runner import judge
from openpendant.tools.packets.conformance.server.target import Options

HOST = "127.0.0.1"
START = (0.3, 0.4)


def little(*values: int) -> bytes:
    return struct.pack(f"<{len(values)}i", *values)


def header(data: bytes) -> tuple[int, int, int, int]:
    length, kind, comm, code = struct.unpack_from("<4i", data)
    return length, kind, comm, code


def patched(data: bytes, offset: int, value: int) -> bytes:
    """Return bytes with one little-endian integer replaced; too short ones are left alone."""
    if len(data) < offset + 4:
        return data
    return data[:offset] + little(value) + data[offset + 4 :]


def frame(kind: int, comm: int, code: int = 0, body: bytes = b"") -> bytes:
    return little(12 + len(body), kind, comm, code) + body


def is_stop(message: object) -> bool:
    return isinstance(message, wire.JointTrajPt | wire.JointTrajPtFull) and message.sequence == -4


def is_request(message: wire.Received) -> bool:
    return getattr(message, "comm_type", 0) == wire.CommType.REQUEST


@dataclass(frozen=True)
class Fault:
    """One broken rule.

    Attributes:
        found_by: numbers of the checks that must say so.
        verdict: what they must say.
        profile: as what the server is judged.
        settings: settings of the emulator that are part of the fault.
        bytes_in: what becomes of the bytes of a motion link before they are understood.
        message_in: what becomes of a message of a motion link.
        state_out: what becomes of a round of the state port.
    """

    name: str
    found_by: tuple[str, ...]
    verdict: CheckVerdict = CheckVerdict.FAILED
    profile: Profile = Profile.GENERIC
    settings: Mapping[str, object] = field(default_factory=dict)
    bytes_in: BytesChange | None = None
    message_in: MessageIn | None = None
    frame_out: BytesChange | None = None
    state_out: StateOut | None = None
    controller: type[EmulatedController] = EmulatedController
    link: type[FaultyLink] | None = None
    service: type[FaultyService] | None = None


class FaultyLink(EmulatorLink):
    """A link whose bytes pass through a fault."""

    def __init__(
        self,
        number: int,
        connection: wire.Connection,
        events: LinkEvents,
        journal: Journal,
        service: FaultyService,
    ) -> None:
        super().__init__(number, connection, events, journal)
        self.service = service
        self.fault = service.fault
        self.memory: dict[str, Any] = {}

    @property
    def is_motion(self) -> bool:
        return self.number in self.service.motion_numbers

    def data_received(self, data: bytes) -> None:
        if self.fault.bytes_in is not None and self.is_motion and data:
            data = self.fault.bytes_in(self, data)
            if not data:
                return
        super().data_received(data)

    def send(self, message: wire.Message) -> None:
        if self.fault.frame_out is None or not self.is_motion:
            super().send(message)
        else:
            self.write(self.fault.frame_out(self, self._connection.send(message)))

    def write(self, data: bytes) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(data)

    def answer(self, message: wire.Message) -> None:
        super().send(message)

    def later(self, seconds: float, action: Callable[[], None]) -> None:
        asyncio.get_running_loop().call_later(seconds, action)


class FaultyService(Service):
    """A service with faulty links.

    Attributes:
        motion_numbers: numbers of the links that were made for the motion port.
    """

    fault: Fault
    memory: dict[str, Any]
    motion_numbers: set[int]

    @property
    def loop_time(self) -> float:
        return self._loop.time()

    @property
    def is_moving(self) -> bool:
        return bool(self.controller.status(self.now).in_motion)

    def motion_link(self) -> EmulatorLink:
        self.motion_numbers.add(self._links_made + 1)
        return super().motion_link()

    def _link(self, events: LinkEvents) -> EmulatorLink:
        self._links_made += 1
        connection = wire.Connection(
            wire.Role.SERVER, wire.PENDANT, real_size=self._settings.real_size
        )
        kind = self.fault.link or FaultyLink
        return kind(self._links_made, connection, events, self.journal, self)

    def _motion_received(self, link: EmulatorLink, message: wire.Received) -> None:
        assert isinstance(link, FaultyLink)
        change = self.fault.message_in
        for received in [message] if change is None else list(change(link, message)):
            super()._motion_received(link, received)

    def obey(self, link: EmulatorLink, message: wire.Received) -> None:
        """Take a message that the fault held back."""
        if link.is_open:
            self.begin("held-back", link.number)
            Service._motion_received(self, link, message)

    def _broadcast(self, messages: list[wire.Message]) -> None:
        if self.fault.state_out is None:
            super()._broadcast(messages)
            return
        parts = self.fault.state_out(self, messages)
        frames = b"".join(
            part if isinstance(part, bytes) else self._codec.encode(part) for part in parts
        )
        for link in list(self._state_links.values()):
            link.send_state(frames, self._event_time)

    def stop_listening(self) -> None:
        for server in self._servers:
            server.close()


BytesChange = Callable[[FaultyLink, bytes], bytes]
MessageIn = Callable[[FaultyLink, wire.Received], Iterable[wire.Received]]
StateOut = Callable[[FaultyService, list[wire.Message]], list[wire.Message | bytes]]

SOUND = Fault("nothing at all", ())


def count(memory: dict[str, Any], name: str) -> int:
    memory[name] = memory.get(name, 0) + 1
    return int(memory[name])


def each(change: Callable[[FaultyService, wire.Message], wire.Message | bytes | None]) -> StateOut:
    return lambda service, messages: [
        told for message in messages if (told := change(service, message)) is not None
    ]


def each_frame(change: Callable[[bytes], bytes]) -> StateOut:
    return each(lambda service, message: change(service._codec.encode(message)))


def each_point(change: Callable[[wire.JointTrajPt], wire.JointTrajPt]) -> MessageIn:
    """Change each point that comes in, but no stop."""

    def apply(link: FaultyLink, received: wire.Received) -> Iterable[wire.Received]:
        if isinstance(received, wire.JointTrajPt) and not is_stop(received):
            return (change(received),)
        return (received,)

    return apply


def feedback(**changes: Callable[[wire.JointFeedback], object]) -> StateOut:
    def apply(_: FaultyService, message: wire.Message) -> wire.Message:
        if not isinstance(message, wire.JointFeedback):
            return message
        values: dict[str, Any] = {name: change(message) for name, change in changes.items()}
        return dataclasses.replace(message, **values)

    return each(apply)


def patch(at: int, value: int, kind: int | None = None) -> BytesChange:
    """Replace one little-endian integer of each frame, or of those of one type."""
    return lambda _, data: patched(data, at, value) if kind in (None, header(data)[1]) else data


def disobeying(
    when: Callable[[EmulatedController, int, wire.Message, int], bool],
) -> type[EmulatedController]:
    """Return a controller that takes some messages of a link, and does not obey them."""

    class Disobeying(EmulatedController):
        def handle(self, link: int, message: wire.Received, now: int) -> Outgoing:
            if isinstance(message, wire.Message) and when(self, link, message, now):
                return [(link, wire.accepted(message))] if is_request(message) else []
            return super().handle(link, message, now)

    return Disobeying


def ignoring(when: Callable[[Any], bool]) -> type[EmulatedController]:
    """Return a controller that takes some messages, whoever sends them, and does not obey them."""
    return disobeying(lambda _controller, _link, message, _now: when(message))


async def serve(fault: Fault) -> tuple[FaultyService, EmulatorPorts]:
    loop = asyncio.get_running_loop()
    settings = EmulatorSettings.model_validate(
        {"motion_port": 0, "state_port": 0, "rate": HALF_RATE, **fault.settings}
    )
    controller = fault.controller(
        Admission(LIMITS, Tolerances()),
        START,
        GENERIC,
        buffer_depth=settings.buffer,
        start_rule=StartRule(2, 50 * MS, 20 * MS, 200 * MS),
        is_strict=settings.strict_sequence,
        now=round(loop.time() * 1e9),
    )
    service = (fault.service or FaultyService)(controller, settings)
    service.fault, service.memory, service.motion_numbers = fault, {}, set()
    return service, await service.start()


@asynccontextmanager
async def sound_server(**options: Any) -> AsyncIterator[tuple[FaultyService, Options]]:
    """Run a server without a fault, with options to judge it by."""
    service, ports = await serve(SOUND)
    try:
        yield service, Options(HOST, ports.motion, ports.state, limits=LIMITS, **options)
    finally:
        await service.close()


def checks_named(numbers: Iterable[str]) -> list[ServerCheck]:
    known = {entry.number: entry for entry in server_checks()}
    return [known[number] for number in numbers]


async def judged(fault: Fault, checks: Iterable[ServerCheck] | None = None) -> Judgement:
    service, ports = await serve(fault)
    options = Options(
        HOST, ports.motion, ports.state, profile=fault.profile, may_move=True, limits=LIMITS
    )
    try:
        return await judge(options, checks=checks)
    finally:
        await service.close()
        await asyncio.sleep(0)


def words_of(judgement: Judgement, *verdicts: CheckVerdict) -> list[str]:
    """Return number and detail of the checks that ended in one of some verdicts."""
    return [
        f"{result.check.number} {result.finding.verdict.value}: {result.finding.detail}"
        for result in judgement.results
        if result.finding.verdict in verdicts
    ]
