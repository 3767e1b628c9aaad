"""What a run over a journal showed, for people and for programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from openpendant.simplemsg import PENDANT, Connection, Malformed, Role, Unasked, codec_for
from openpendant.simplemsg.opaque import message_type
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME

from .journal_file import Asked, Effect, Out
from .rerun import Outcome


def in_words(path: Path, outcome: Outcome) -> str:
    """Return one line or, where there is a difference, also what happened just before it."""
    seconds = outcome.last / 1e9
    pace = seconds / outcome.seconds if outcome.seconds else 0.0
    figures = (
        f"{path}: {outcome.header.kind}, {seconds:.1f} s, {outcome.events} events,"
        f" {outcome.bytes_in} bytes in, {outcome.bytes_out} bytes out in {outcome.frames} writes"
    )
    took = f"{outcome.seconds:.2f} s, {pace:.0f} times real time"
    if outcome.difference is None:
        return f"{figures}: identical ({took})"
    return "\n".join([f"{figures}: then a DIFFERENCE ({took})", *_context(outcome)])


def _context(outcome: Outcome) -> list[str]:
    difference = outcome.difference
    assert difference is not None
    lines = []
    for happening in outcome.before:
        marker = ">" if happening is outcome.before[-1] else " "
        what = f"{happening.event} {happening.link}".rstrip()
        said = _names(happening.data)
        lines.append(f"{marker} #{happening.number} {happening.time / 1e9:.6f} s: {what}{said}")
    expected, actual = difference.expected, difference.actual
    lines += [f"  then: {_effect(expected)}", f"  now:  {_effect(actual)}"]
    if isinstance(expected, Out) and isinstance(actual, Out) and expected.link == actual.link:
        lines.append(f"  first different byte: {_first_difference(expected.data, actual.data)}")
    return lines


def _effect(effect: Effect | str | None) -> str:
    match effect:
        case Out(link, data):
            return f"to {link}: {data.hex()}{_names(data)}"
        case Asked(question, link):
            return f"{link} was {question}"
        case None:
            return "nothing more"
    return effect


def _names(data: bytes) -> str:
    """Return the names of the messages in bytes that are whole frames, as a remark."""
    wire = Connection(Role.SERVER, PENDANT, max_frame=MAX_PENDANT_FRAME)
    codec = codec_for(PENDANT)
    names = []
    for received in wire.receive(data):
        match received:
            case Malformed(msg_type=msg_type):
                names.append(f"malformed {msg_type}")
            case Unasked(message=message) | message:
                names.append(codec.name_of(message_type(message), message.comm_type))
    return f" ({', '.join(names)})" if names else ""


def _first_difference(expected: bytes, actual: bytes) -> str:
    for at, (then, now) in enumerate(zip(expected, actual, strict=False)):
        if then != now:
            return f"{at}: {then:#04x} then, {now:#04x} now"
    return f"{min(len(expected), len(actual))}: {len(expected)} bytes then, {len(actual)} now"


def as_json(path: Path, outcome: Outcome) -> dict[str, Any]:
    """Return the same as a JSON object, the state at the end included."""
    difference = outcome.difference
    return {
        "file": str(path),
        "of": outcome.header.kind,
        "version": outcome.header.version,
        "identical": difference is None,
        "duration": outcome.last / 1e9,
        "events": outcome.events,
        "bytes_in": outcome.bytes_in,
        "bytes_out": outcome.bytes_out,
        "seconds": outcome.seconds,
        "state": outcome.state,
        "difference": None
        if difference is None
        else {
            "event": difference.happening.number,
            "time": difference.happening.time / 1e9,
            "then": _effect(difference.expected),
            "now": _effect(difference.actual),
        },
    }
