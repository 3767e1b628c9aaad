"""Answers of a peer: which reply answers which request, and how one is printed with its latency.

Owns the rule by types alone: a reply has the type of its request, unless the declaration names
another one. What known controllers do instead is accepted and named. Owns, too, which answers count
as a finding. Knows no sockets and no clock.
"""

from __future__ import annotations

import json
import statistics
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from openpendant.simplemsg import (
    DIALECTS,
    Codec,
    CommType,
    Message,
    MsgType,
    ProtocolError,
    ReplyCode,
    codec_for,
)
from openpendant.simplemsg.framing import HEADER_SIZE, Cut, Frame, detect_byte_order
from openpendant.simplemsg.masking import masked_frame
from openpendant.simplemsg.motoman import MotomanMotionCtrl, MotomanMotionReply
from openpendant.simplemsg.packet_text import packet_to_json
from openpendant.simplemsg.pendant import Hello, Management, Verdict

from ...console import clean_json, complain
from ..reading.field_table import is_failed_verdict, remark_on

COMMAND_AT = HEADER_SIZE + 8
"""Offset of the field `command` in types 2001 and 2002; integers only stand before it."""

_MOTION_CONTROL = MotomanMotionCtrl.PLACE.msg_type
_MOTION_REPLY = MotomanMotionReply.PLACE.msg_type
_VERDICT = Verdict.PLACE.msg_type
_MAY_FAIL_SO = {Hello.PLACE.msg_type, Management.PLACE.msg_type}
"""Requests with an answer of their own type that are refused by a verdict."""


class Answering(NamedTuple):
    """Match of a reply and a request.

    Attributes:
        remark: why not, or whose habit it is; empty for what the protocol says.
    """

    fits: bool
    remark: str = ""


def answering(request: bytes, reply: bytes) -> Answering:
    """Compare the types of two whole frames."""
    asked, told = Frame(request).msg_type, Frame(reply).msg_type
    if told == asked:
        return Answering(True)
    if told == _MOTION_REPLY:
        return _by_command(request, asked, reply)
    if told == _declared_answers().get(asked) or (told == _VERDICT and asked in _MAY_FAIL_SO):
        return Answering(True)
    if (asked, told) == (MsgType.JOINT_TRAJ_PT, MsgType.JOINT_POSITION):
        return Answering(True, "type 11 was answered by type 10, a habit of Fanuc's")
    return Answering(False, f"a reply of type {told} is no answer to type {asked}")


def _by_command(request: bytes, asked: int, reply: bytes) -> Answering:
    """Judge a MOTION_REPLY, which names what it answers: a command, else a message type."""
    command = Frame(reply).integer_at(COMMAND_AT)
    meant = {asked, Frame(request).integer_at(COMMAND_AT) if asked == _MOTION_CONTROL else asked}
    if command not in meant:
        about = "nothing" if command is None else f"command {command}"
        return Answering(False, f"a motion reply about {about} is no answer to type {asked}")
    is_declared = _declared_answers().get(asked) == _MOTION_REPLY
    return Answering(
        True, "" if is_declared else f"type {asked} was answered by type 2002, a habit of Motoman's"
    )


@cache
def _declared_answers() -> dict[int, int]:
    """Return the types of requests whose answers have another type, with the latter."""
    places = [cls.PLACE for dialect in DIALECTS.values() for cls in dialect.messages]
    types = {place.name: int(place.msg_type) for place in places}
    return {int(place.msg_type): types[place.reply] for place in places if place.reply in types}


@dataclass(frozen=True, slots=True)
class PeerAnswer:
    """Reply of the peer to one request.

    Attributes:
        latency: since the request was written [s]; None for a topic nobody asked for.
        fit: whether it is the answer to the request, None where there is none to compare.
    """

    piece: Cut
    latency: float | None = None
    fit: Answering | None = None


class AnswerPrinter:
    """Printer of answers, with the counts for the summary.

    Attributes:
        findings: answers that were malformed, a failure, or to another request.
    """

    def __init__(self, codec: Codec, *, as_json: bool) -> None:
        """Make a printer; the byte order of each answer is seen from it."""
        self.findings = 0
        self._codec = codec
        self._as_json = as_json
        self._latencies: list[float] = []

    def note(self, text: str) -> None:
        """Print a sentence for a person."""
        if not self._as_json:
            print(text, flush=True)

    def show(self, answer: PeerAnswer) -> None:
        """Print one answer, and what is to be said about it."""
        order = detect_byte_order(answer.piece.data) or self._codec.byte_order
        codec = codec_for(self._codec.dialect, order, self._codec.real_size)
        message, fault = _decoded(answer.piece, codec)
        if message is None:
            digits = masked_frame(answer.piece.data)[:1024].hex()
            shown_as: dict[str, Any] = {"malformed": fault, "hex": digits}
        else:
            shown_as = packet_to_json(message, codec)
            if order is not self._codec.byte_order:
                shown_as["order"] = order.name.lower()
        if answer.latency is not None:
            self._latencies.append(answer.latency)
            shown_as["latency_ms"] = round(1e3 * answer.latency, 3)
        said = json.dumps(shown_as) if self._as_json else _in_a_line(shown_as)
        print(clean_json(said), flush=True)
        remark = remark_on(message) if message is not None else ""
        if remark:
            self.note(f"    {remark}")
        misfits = answer.fit is not None and not answer.fit.fits
        if answer.fit is not None and answer.fit.remark:
            complain(answer.fit.remark)
        self.findings += misfits or message is None or _is_failure(message)

    def summarise(self) -> None:
        """Print the latencies of several requests."""
        if len(self._latencies) > 1:
            ordered = sorted(1e3 * latency for latency in self._latencies)
            median = statistics.median(ordered)
            complain(
                f"{len(ordered)} replies, latency in ms: least {ordered[0]:.3f},"
                f" median {median:.3f}, largest {ordered[-1]:.3f}"
            )


def _decoded(piece: Cut, codec: Codec) -> tuple[Message | None, str]:
    """Return the message in a piece, or None and why there is none."""
    if not piece.is_frame:
        return None, "in these bytes no frame can be found"
    try:
        return codec.decode(piece.data), ""
    except ProtocolError as error:
        return None, str(error)


def _is_failure(message: Message) -> bool:
    return message.reply_code == ReplyCode.FAILURE or is_failed_verdict(message)


_COMM_NAMES = {int(member): member.name.lower() for member in CommType}
_CODE_NAMES = {ReplyCode.SUCCESS: " success", ReplyCode.FAILURE: " failure"}


def _in_a_line(shown_as: dict[str, Any]) -> str:
    latency = shown_as.get("latency_ms")
    after = f" after {latency:.3f} ms" if latency is not None else ""
    if "malformed" in shown_as:
        return f"malformed{after}: {shown_as['malformed']}: {shown_as['hex']}"
    comm = _COMM_NAMES.get(shown_as["comm_type"], f"comm {shown_as['comm_type']}")
    code = _CODE_NAMES.get(shown_as["reply_code"], "")
    order = f", {shown_as['order']}-endian" if "order" in shown_as else ""
    fields = f" {json.dumps(shown_as['fields'])}" if shown_as["fields"] else ""
    return f"{shown_as['msg_type']} {shown_as['name']} {comm}{code}{after}{order}{fields}"
