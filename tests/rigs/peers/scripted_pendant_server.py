"""A pendant server that agrees to everything, notes what it was told and when, and says what a
test has it say."""

from __future__ import annotations

import asyncio
import json
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any, TypeVar

from openpendant import simplemsg as wire
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode

SESSION = 7
DOF = 6
STATE_PERIOD = 0.04
"""From one state to the next where the client asks for none [s]; else it is what it asks for."""

_M = TypeVar("_M", bound=wire.Message)


def state(
    sequence: int, *, mode: messages.OperatingMode = messages.OperatingMode.MANUAL_REDUCED
) -> messages.State:
    """Return a state of a robot that stands at (0.1, 0.2, …, 0.6)."""
    return messages.State(
        sequence=sequence,
        time_s=0,
        time_ns=0,
        age=0.0,
        dropped=0,
        activity=messages.Activity.IDLE,
        request_id=0,
        holder=0,
        stop=messages.StopKind.NONE,
        operating_mode=mode,
        enabling=messages.EnablingPosition.RELEASED,
        override=1.0,
        tool_speed_cap=0.25,
        jog_scale=1.0,
        jog_reason=messages.JogReason.NONE,
        jog_joint=-1,
        program_state=messages.ProgramState.NONE,
        program_line=0,
        link=messages.LinkState.UP,
        drives_powered=1,
        e_stopped=0,
        error_code=0,
        in_error=0,
        in_motion=0,
        mode=2,
        motion_possible=1,
        valid_fields=messages.StateField.POSITION | messages.StateField.TOOL,
        tool_speed=0.0,
        positions=wire.joint_array([0.125 * (joint + 1) for joint in range(DOF)]),
        velocities=wire.joint_array(()),
        tool_position=(0.5, 0.25, 0.75),
        tool_orientation=(0.0, 0.0, 0.0, 1.0),
    )


class ScriptedPendantServer:
    """The other end of connections; what it says unasked goes to the newest.

    Attributes:
        got: what came, with the loop's time [s].
        refusals: verdict for the next request of a type, with its text.
        answers: body of the management answer by `op`; what is not here is refused.
        mode: shown in the states.
        holder: session that the states show in control.
        mutes: nothing is answered any more.
        mutes_all_but: what is answered even then; None for nothing.
        completes: motions other than jogs are completed at once.
        cells: what a hello has to name one of; empty for a server of one cell.
        called: name of the robot in the answer to hello, and of the cell where the hello has none.
    """

    def __init__(self) -> None:
        self.got: list[tuple[float, wire.Message]] = []
        self.refusals: dict[type[wire.Message], tuple[VerdictCode, str]] = {}
        self.answers: dict[str, dict[str, Any]] = {}
        self.mode = messages.OperatingMode.MANUAL_REDUCED
        self.holder = 0
        self.mutes = False
        self.mutes_all_but: type[wire.Message] | None = None
        self.completes = True
        self.cells: tuple[str, ...] = ()
        self.called = ("ur5", "cell")
        self.sequence = 0
        self.port = 0
        self._jogs: dict[int, int] = {}
        self.lines: list[_Line] = []
        self._answered: _Line | None = None

    # The connections.

    def take(self, line: _Line, message: wire.Message) -> None:
        self.got.append((asyncio.get_running_loop().time(), message))
        is_heard = self.mutes_all_but is not None and isinstance(message, self.mutes_all_but)
        if (is_heard or not self.mutes) and message.comm_type == wire.CommType.REQUEST:
            self._answered = line
            self._answer(message)
            self._answered = None

    def send(self, message: wire.Message) -> None:
        (self._answered or self.lines[-1]).send(message)

    def hang_up(self) -> None:
        for line in [self._answered] if self._answered else list(self.lines):
            line.hang_up()

    def tell_state(self) -> None:
        self.sequence += 1
        self.send(self._state())

    def _state(self) -> messages.State:
        return replace(state(self.sequence, mode=self.mode), holder=self.holder)

    # What it answers.

    def _answer(self, message: wire.Message) -> None:
        match message:
            case messages.Hello() if self.cells and message.cell not in self.cells:
                wanted = f"no cell {message.cell!r}" if message.cell else "name a cell"
                text = f"{wanted}; here: {', '.join(self.cells)}"
                self.send(_verdict(0, VerdictCode.UNKNOWN_CELL, text))
                self.hang_up()
            case messages.Hello():
                self.send(self._welcome(message))
                self.tell_state()
                assert self._answered is not None
                period = 1.0 / message.state_rate if message.state_rate else STATE_PERIOD
                telling = self._tell_states(self._answered, period)
                self._answered.telling = asyncio.create_task(telling)
            case wire.Ping():
                self.send(
                    wire.Ping(comm_type=wire.CommType.REPLY, reply_code=wire.ReplyCode.SUCCESS)
                )
            case messages.Management():
                self._manage(message)
            case _:
                self._judge(message, getattr(message, "request_id", 0))

    async def _tell_states(self, line: _Line, period: float) -> None:
        while True:
            await asyncio.sleep(period)
            if not self.mutes:
                self.sequence += 1
                line.send(self._state())

    def _welcome(self, hello: messages.Hello) -> messages.HelloReply:
        return messages.HelloReply(
            protocol_version=hello.protocol_version,
            session=SESSION,
            capabilities=32,
            max_frame=65_532,
            dof=DOF,
            tick_rate=100.0,
            max_state_rate=100.0,
            authority_timeout=3.0,
            cell=hello.cell or self.called[1],
            robot=self.called[0],
            server="scripted",
        )

    def _manage(self, message: messages.Management) -> None:
        answer = self.answers.get(json.loads(message.body)["op"])
        refusal = {"code": 42, "text": "no such op"}
        self.send(
            messages.Management(
                request_id=message.request_id,
                body=json.dumps(refusal if answer is None else answer).encode(),
                comm_type=wire.CommType.REPLY,
                reply_code=wire.ReplyCode.FAILURE if answer is None else wire.ReplyCode.SUCCESS,
            )
        )

    def _judge(self, message: wire.Message, request_id: int) -> None:
        code, text = self.refusals.pop(type(message), (VerdictCode.ACCEPTED, ""))
        self.send(_verdict(request_id, code, text))
        if code is not VerdictCode.ACCEPTED:
            return
        match message:
            case messages.JogStart():
                self._jogs[message.press] = request_id
            case messages.JogRelease():
                self.end_jog(message.press)
            case _ if hasattr(message, "speed") and self.completes:
                self.end_motion(request_id)

    def end_motion(self, request_id: int, code: VerdictCode = VerdictCode.ACCEPTED) -> None:
        kind = messages.OutcomeKind.ABORTED if code else messages.OutcomeKind.COMPLETED
        self.send(
            messages.Outcome(
                request_id=request_id,
                outcome=kind,
                code=code,
                joint=-1,
                value=0.0,
                limit=0.0,
                plan_time=0.25,
                motion_time=0.5,
                text="scripted",
            )
        )

    def end_jog(
        self,
        press: int,
        why: messages.JogEnd = messages.JogEnd.RELEASED,
        code: VerdictCode = VerdictCode.ACCEPTED,
    ) -> None:
        """Bring the robot to rest after a press."""
        self.send(
            messages.JogEnded(
                press=press,
                reason=why,
                stop_time=0.0625,
                joint_distance=0.03125,
                tool_distance=0.015625,
                positions=wire.joint_array([0.5] * DOF),
            )
        )
        self.end_motion(self._jogs.pop(press), code)

    # What came.

    def times(self, kind: type[wire.Message]) -> list[float]:
        return [at for at, message in self.got if isinstance(message, kind)]

    def all(self, kind: type[_M]) -> list[_M]:
        return [message for _, message in self.got if isinstance(message, kind)]

    def one(self, kind: type[_M]) -> _M:
        (found,) = self.all(kind)
        return found


class _Line(asyncio.Protocol):
    """One connection, with its states."""

    def __init__(self, server: ScriptedPendantServer) -> None:
        self.telling: asyncio.Task[None] | None = None
        self.lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._server = server
        self._wire = wire.Connection(wire.Role.SERVER, wire.PENDANT, max_frame=65_532)
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._server.lines.append(self)

    def data_received(self, data: bytes) -> None:
        for received in self._wire.receive(data):
            assert not isinstance(received, wire.Malformed | wire.Unasked), received
            self._server.take(self, received)

    def send(self, message: wire.Message) -> None:
        assert self._transport is not None
        self._transport.write(self._wire.send(message))

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.lines.remove(self)
        if self.telling is not None:
            self.telling.cancel()
        self.lost.set_result(None)

    def hang_up(self) -> None:
        assert self._transport is not None
        self._transport.close()


def _verdict(request_id: int, code: VerdictCode, text: str) -> messages.Verdict:
    return messages.Verdict(
        request_id=request_id,
        code=code,
        joint=2 if code else -1,
        value=7.0 if code else 0.0,
        limit=6.25 if code else 0.0,
        text=text,
        comm_type=wire.CommType.REPLY,
        reply_code=wire.ReplyCode.FAILURE if code else wire.ReplyCode.SUCCESS,
    )


@asynccontextmanager
async def scripted_server(
    tls: ssl.SSLContext | None = None,
    make: type[ScriptedPendantServer] = ScriptedPendantServer,
) -> AsyncIterator[ScriptedPendantServer]:
    """Listen on a free port of loopback."""
    server = make()
    listener = await asyncio.get_running_loop().create_server(
        lambda: _Line(server), "127.0.0.1", 0, ssl=tls
    )
    server.port = listener.sockets[0].getsockname()[1]
    try:
        yield server
    finally:
        listener.close()
        lost = [line.lost for line in server.lines]
        server.hang_up()
        if lost:
            # One whose client reads nothing may have more to say.
            await asyncio.wait(lost, timeout=STATE_PERIOD)
