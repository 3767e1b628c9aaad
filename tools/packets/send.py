"""`openpendant packets send`: sends packets, waits for the replies, prints them."""

from __future__ import annotations

import argparse
import asyncio
import time
from collections.abc import Sequence

from openpendant.simplemsg import Codec, CommType, ProtocolError
from openpendant.simplemsg.errors import shown
from openpendant.simplemsg.framing import HEADER_SIZE, Cut, Frame, detect_byte_order
from openpendant.simplemsg.masking import masked_frame

from ..console import ExitCode, complain
from .console import (
    LineError,
    PacketToolError,
    add_wire_form,
    codec_of,
    lines_of,
    open_input,
    parser,
    run,
    seconds,
    text_of,
)
from .encode import encode_line
from .live.answers import Answering, AnswerPrinter, PeerAnswer, answering
from .live.consent import add_consent, may_act, require_consent
from .live.endpoints import Endpoint, Peer, target_endpoint
from .live.typed_message import message_from_words

_EPILOG = """\
NAME is a message's name or number, or stop. Arrays are comma lists; what is left out is zero.
comm=topic sends a topic. - reads JSON objects from standard input, as encode takes them.

examples:
  openpendant packets send 11000 ping
  openpendant packets send 11000 stop
  openpendant packets send robot:11002 --topics 4
  openpendant packets send 11000 joint_traj_pt joints=0.1,-0.2 velocity=0.1 duration=5 \\
      --yes-it-may-move
  openpendant packets send robot:50240 motoman_motion_ctrl command=200101 --dialect motoman
  openpendant packets send 11000 --hex 0c000000010000000200000000000000 --count 100

exit codes: 0 answered; 1 answered with failure, with something malformed, or with what answers
another request; 2 wrong usage; 3 the peer could not be reached, hung up or never answered.
"""

MAX_PACKETS = 1_000
"""Most packets read from standard input."""

MAX_HEX = 131_078
"""Longest packet to send, hexadecimal digits: the largest frame."""


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(_parser(), _send, argv)


def _parser() -> argparse.ArgumentParser:
    command = parser("send", "Send one packet, wait, print the reply.", _EPILOG)
    add = command.add_argument
    add("peer", type=target_endpoint, metavar="[HOST:]PORT")
    add("name", nargs="?", metavar="NAME", help="message to send, or -")
    add("fields", nargs="*", metavar="FIELD=VALUE")
    add("--hex", metavar="DIGITS", help="send these bytes instead")
    add("--count", type=_count, default=1, metavar="N", help="send it so often (default: 1)")
    add("--timeout", type=seconds, default=5.0, metavar="S", help="for each answer (default: 5)")
    add("--topics", type=_count, default=0, metavar="N", help="then print the next N topics")
    add("--json", action="store_true", help="print JSON objects")
    add("--strict", action="store_true", help="send no password to another machine: end instead")
    add_wire_form(command)
    add_consent(command)
    return command


def _count(text: str) -> int:
    if text.isascii() and text.isdigit() and 1 <= int(text[:8]) <= 1_000_000:
        return int(text[:8])
    raise argparse.ArgumentTypeError(f"{shown(text)} is no number from 1 to 1000000")


def _send(arguments: argparse.Namespace) -> int:
    codec = codec_of(arguments)
    packets = packets_to_send(arguments, codec)
    if not packets and not arguments.topics:
        raise PacketToolError("nothing to do: give a NAME, --hex, - or --topics")
    if any(map(may_act, packets)):
        require_consent(arguments.yes_it_may_move, str(arguments.peer))
    return asyncio.run(_talk(packets * arguments.count, arguments, codec))


def packets_to_send(arguments: argparse.Namespace, codec: Codec) -> list[bytes]:
    """Return the packets that the arguments describe, none for `--topics` alone."""
    if arguments.hex is not None:
        if arguments.name is not None:
            raise PacketToolError("give either a NAME or --hex")
        return [_from_digits(arguments.hex)]
    if arguments.name is None:
        return []
    if arguments.name == "-":
        return _from_stdin(codec)
    try:
        return [codec.encode(message_from_words(arguments.name, arguments.fields, codec))]
    except ProtocolError as error:  # nothing was sent, so it is not the peer's
        raise PacketToolError(str(error)) from None


def _from_digits(digits: str) -> bytes:
    try:
        data = bytes.fromhex(digits.removeprefix("0x"))
    except ValueError:
        raise PacketToolError(f"--hex {shown(digits)}: no pairs of hexadecimal digits") from None
    if not 0 < 2 * len(data) <= MAX_HEX:
        raise PacketToolError(f"--hex: {len(data)} bytes; 1 to {MAX_HEX // 2} can be sent")
    return data


def _from_stdin(codec: Codec) -> list[bytes]:
    packets: list[bytes] = []
    with open_input("-") as stream:
        for number, raw in enumerate(lines_of(stream), start=1):
            try:
                line = text_of(raw)
                if line:
                    packets.append(bytes.fromhex(encode_line(line, codec)))
            except (LineError, ProtocolError) as error:
                raise PacketToolError(f"line {number}: {error}") from None
            if len(packets) > MAX_PACKETS:
                raise PacketToolError(f"more than {MAX_PACKETS} packets on standard input")
    return packets


async def _talk(packets: Sequence[bytes], arguments: argparse.Namespace, codec: Codec) -> int:
    return await talk(
        arguments.peer,
        packets,
        codec,
        within=arguments.timeout,
        topics=arguments.topics,
        as_json=arguments.json,
        strict=arguments.strict,
    )


async def talk(
    endpoint: Endpoint,
    packets: Sequence[bytes],
    codec: Codec,
    *,
    within: float,
    topics: int = 0,
    as_json: bool = False,
    strict: bool = False,
) -> int:
    """Send packets one after the other, print what comes back, return the exit code.

    Raises:
        PeerError: the peer cannot be reached, hangs up or does not answer.
        PacketToolError: a packet holds a password for another machine, and this is `strict`.
    """
    peer = await Peer.connect(endpoint, within)
    printer = AnswerPrinter(codec, as_json=as_json)
    try:
        if not peer.is_here and any(masked_frame(packet) != packet for packet in packets):
            if strict:
                raise PacketToolError(f"not sent: it holds a password in clear text for {endpoint}")
            complain(f"warning: a password leaves in clear text for {endpoint}; this has no TLS")
        for packet in packets:
            before = time.perf_counter()
            await peer.send(packet, within)
            if _expects_reply(packet):
                piece = await _next(peer, within, unwanted=CommType.TOPIC)
                latency = time.perf_counter() - before
                printer.show(PeerAnswer(piece, latency, _fit(packet, piece)))
            else:
                printer.note("sent; nobody replies to it")
        for _ in range(topics):
            printer.show(PeerAnswer(await _next(peer, within, unwanted=CommType.REPLY)))
    finally:
        await peer.close()
        printer.summarise()
    return ExitCode.FAILED if printer.findings else ExitCode.OK


def _expects_reply(packet: bytes) -> bool:
    """Return True if a reply may come: a topic or a reply has none, bytes that are no frame may."""
    if detect_byte_order(packet) is None or len(packet) < HEADER_SIZE:
        return True
    return Frame(packet).comm_type not in (CommType.TOPIC, CommType.REPLY)


def _fit(packet: bytes, piece: Cut) -> Answering | None:
    """Compare an answer with what was sent, where both have a header."""
    if not piece.is_frame or detect_byte_order(packet) is None or len(packet) < HEADER_SIZE:
        return None
    return answering(packet, piece.data)


async def _next(peer: Peer, within: float, unwanted: CommType) -> Cut:
    """Return the next frame that is not of a kind, or the next bytes that are no frame.

    A peer that sends other things without end does not put the deadline off.
    """
    return await peer.next_piece(
        within, lambda piece: not piece.is_frame or Frame(piece.data).comm_type != unwanted
    )
