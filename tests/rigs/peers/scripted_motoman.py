"""A Motoman controller by the book (MotoROS for ROS 1), as far as the tester asks; it never moves.

Owns the answers of motoman.md's sections 2 and 4, and a few faults to leave them by.
"""

import asyncio
from typing import NamedTuple

from openpendant import simplemsg as wire
from openpendant.simplemsg import motoman as m
from openpendant.tools.packets.conformance.check import CheckVerdict, Judgement, Profile
from openpendant.tools.packets.conformance.server.runner import judge
from openpendant.tools.packets.conformance.server.target import Options

_HOST = "127.0.0.1"
_EMPTY = wire.joint_array(())
_PERIOD = 0.025

MOTOMAN_FAULTS: dict[str, tuple[str, CheckVerdict]] = {
    "quotes no sequence": ("YS02", CheckVerdict.FAILED),
    "header says failure": ("YS03", CheckVerdict.FAILED),
    "unknown types are answered by their own": ("YS04", CheckVerdict.FAILED),
    "repeats its last reply": ("YS05", CheckVerdict.DEVIATES),
    "takes any group": ("YS06", CheckVerdict.FAILED),
    "takes points without velocity": ("YS08", CheckVerdict.FAILED),
    "understands sequence -4": ("YS10", CheckVerdict.FAILED),
    "reads any bit": ("YS13", CheckVerdict.FAILED),
    "reports ten times a second": ("YS17", CheckVerdict.FAILED),
}
"""Name of each fault: the check that must find it, and what that says."""


class _Verdict(NamedTuple):
    result: int
    subcode: int = 0


class _MotionLink(asyncio.Protocol):
    def __init__(self, fault: str) -> None:
        self._fault = fault
        self._wire = wire.Connection(wire.Role.SERVER, wire.MOTOMAN)
        self._last = m.MotomanMotionReply(0, 0, 0, 0, 0, _EMPTY)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        for received in self._wire.receive(data):
            reply = self._answer(received)
            if reply is not None and self._wire.unanswered:
                self._transport.write(self._wire.send(reply))
        if self._wire.fault is not None:
            self._transport.close()

    def _answer(self, received: wire.Received) -> wire.Message | None:
        match received:
            case wire.Ping(comm_type=wire.CommType.REQUEST):
                return wire.Ping(comm_type=wire.CommType.REPLY, reply_code=1)
            case m.MotomanGetDhParameters():
                return m.MotomanGetDhParametersReply((0.0,) * 128)
            case m.MotomanReadSingleIo(address=address):
                exists = 10 <= address <= 89_999 and address % 10 < 8
                code = 0 if exists or self._fault == "reads any bit" else 1001
                return m.MotomanReadSingleIoReply(0, code, reply_code=1 if code == 0 else 2)
            case wire.Malformed(msg_type=msg_type):
                return self._say(-1, -1, msg_type, _INVALID_TYPE)
            case wire.Message() if received.comm_type == wire.CommType.REQUEST:
                return self._verdict_on(received)
        return None

    def _verdict_on(self, message: wire.Message) -> wire.Message:
        match message:
            case m.MotomanMotionCtrl():
                if self._fault == "repeats its last reply" and message.command > 200_130:
                    return self._last
                verdict = self._command(message)
                return self._say(message.robot_id, message.sequence, message.command, verdict)
            case wire.JointTrajPtFull():
                verdict = self._point(message)
                return self._say(message.robot_id, message.sequence, 14, verdict)
            case m.MotomanSelectTool():
                good = 0 <= message.tool <= 63
                verdict = _OK if good else _Verdict(m.MotionResult.INVALID, m.Subcode.INVALID_TOOL)
                return self._say(message.group, message.sequence, 2018, verdict)
        if self._fault.startswith("unknown types") and isinstance(message, wire.Opaque):
            return wire.HeaderOnly(wire.message_type(message), reply_code=2)
        return self._say(-1, -1, wire.message_type(message), _INVALID_TYPE)

    def _say(self, group: int, sequence: int, command: int, verdict: _Verdict) -> wire.Message:
        if self._fault == "quotes no sequence":
            sequence = 0
        code = 2 if self._fault == "header says failure" and verdict.result else 1
        self._last = m.MotomanMotionReply(
            group, sequence, command, verdict.result, verdict.subcode, _EMPTY, reply_code=code
        )
        return self._last

    def _command(self, message: m.MotomanMotionCtrl) -> _Verdict:
        match message.command:
            case m.MotionCommand.CHECK_QUEUE_CNT:
                any_group = self._fault == "takes any group"
                known = message.robot_id == 0 or any_group
                return _OK if known else _Verdict(m.MotionResult.FAILURE, -1)
            case m.MotionCommand.CHECK_MOTION_READY | m.MotionCommand.STOP_MOTION:
                return _OK
        return _Verdict(m.MotionResult.INVALID, m.Subcode.INVALID_COMMAND)

    def _point(self, point: wire.JointTrajPtFull) -> _Verdict:
        subcode = 0
        if point.robot_id != 0:
            subcode = m.Subcode.INVALID_GROUP
        elif point.valid_fields & 7 != 7 and self._fault != "takes points without velocity":
            subcode = m.Subcode.INVALID_INSUFFICIENT_FIELDS
        elif point.time >= 14_400:
            subcode = m.Subcode.INVALID_TIME
        elif point.sequence < 0 and self._fault != "understands sequence -4":
            subcode = m.Subcode.INVALID_SEQUENCE
        return _Verdict(m.MotionResult.INVALID, subcode) if subcode else _OK


_OK = _Verdict(m.MotionResult.SUCCESS)
_INVALID_TYPE = _Verdict(m.MotionResult.INVALID, m.Subcode.INVALID_MESSAGE_TYPE)


class _StateLink(asyncio.Protocol):
    def __init__(self, period: float) -> None:
        self._period = period
        self._wire = wire.Connection(wire.Role.SERVER, wire.MOTOMAN, wire.ByteOrder.LITTLE)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._report()

    def connection_lost(self, exc: Exception | None) -> None:
        self._timer.cancel()

    def _report(self) -> None:
        told = wire.JointFeedback(0, 2, 0.0, wire.joint_array((0.1, 0.2)), _EMPTY, _EMPTY)
        self._transport.write(
            self._wire.send(told) + self._wire.send(wire.Status(0, 0, 0, 0, 0, 2, 0))
        )
        self._timer = asyncio.get_running_loop().call_later(self._period, self._report)


async def judged_motoman(fault: str = "", *only: str) -> Judgement:
    loop = asyncio.get_running_loop()
    period = 0.1 if fault == "reports ten times a second" else _PERIOD
    servers = [
        await loop.create_server(lambda: _MotionLink(fault), _HOST, 0),
        await loop.create_server(lambda: _StateLink(period), _HOST, 0),
    ]
    ports = [server.sockets[0].getsockname()[1] for server in servers]
    options = Options(_HOST, ports[0], ports[1], profile=Profile.MOTOMAN, dialect="motoman")
    try:
        return await judge(options, only=only)
    finally:
        for server in servers:
            server.close()
            await server.wait_closed()
        await asyncio.sleep(0)
