"""What a peer answered, printed as a line or as JSON, with its latency.

Owns what of it counts as a finding. Knows no sockets and no clock.
"""

from __future__ import annotations

import json
import statistics
from dataclasses import dataclass
from typing import Any

from openpendant.simplemsg import Codec, CommType, Message, ProtocolError, ReplyCode, codec_for
from openpendant.simplemsg.connection import detect_byte_order
from openpendant.simplemsg.masking import masked_frame
from openpendant.simplemsg.text import packet_to_json

from ..console import complain
from ..frames import Cut, order_name
from ..reading.remarks import is_failed_verdict, remark_on
from .answering import Answering


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back.

    Attributes:
        piece: the frame, or stray bytes.
        latency: since the request was written [s]; None for a topic nobody asked for.
        fit: whether it is the answer to the request, None where there is none to compare.
    """

    piece: Cut
    latency: float | None = None
    fit: Answering | None = None


class AnswerPrinter:
    """Prints answers, and keeps what is told at the end.

    Attributes:
        findings: answers that were malformed, a failure, or to another request.
    """

    def __init__(self, codec: Codec, *, as_json: bool) -> None:
        """Make a printer.

        Args:
            codec: what the bytes are taken for; their byte order is seen from each.
            as_json: print JSON objects, and no notes.
        """
        self.findings = 0
        self._codec = codec
        self._as_json = as_json
        self._latencies: list[float] = []

    def note(self, text: str) -> None:
        """Print a sentence for a person."""
        if not self._as_json:
            print(text, flush=True)

    def show(self, answer: Answer) -> None:
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
                shown_as["order"] = order_name(order)
        if answer.latency is not None:
            self._latencies.append(answer.latency)
            shown_as["latency_ms"] = round(1e3 * answer.latency, 3)
        print(json.dumps(shown_as) if self._as_json else _in_a_line(shown_as), flush=True)
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
