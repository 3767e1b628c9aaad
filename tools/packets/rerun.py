"""`openpendant packets rerun`: run a server or an emulator again, exactly as its journal says.

Owns arguments, output for people and for programs, and exit codes; `journals.reenactment` runs it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from openpendant.simplemsg import PENDANT, Connection, Malformed, Role, Unasked, codec_for
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME
from openpendant.simplemsg.standard import message_type

from ..console import ExitCode, complain, one_line
from .console import parser, run
from .journals.journal_file import BytesOut, Effect, GrantedQuestion
from .journals.reenactment import RerunOutcome, Until, rerun


def in_words(path: Path, outcome: RerunOutcome) -> str:
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


def _context(outcome: RerunOutcome) -> list[str]:
    difference = outcome.difference
    assert difference is not None
    lines = []
    for happening in outcome.before:
        marker = ">" if happening is outcome.before[-1] else " "
        what = one_line(f"{happening.event} {happening.link}".rstrip())
        said = _names(happening.data)
        lines.append(f"{marker} #{happening.number} {happening.time / 1e9:.6f} s: {what}{said}")
    expected, actual = difference.expected, difference.actual
    lines += [f"  then: {_effect(expected)}", f"  now:  {_effect(actual)}"]
    if (
        isinstance(expected, BytesOut)
        and isinstance(actual, BytesOut)
        and expected.link == actual.link
    ):
        lines.append(f"  first different byte: {_first_difference(expected.data, actual.data)}")
    return lines


def _effect(effect: Effect | str | None) -> str:
    match effect:
        case BytesOut(link, data):
            return f"to {one_line(link)}: {data.hex()}{_names(data)}"
        case GrantedQuestion(question, link):
            return one_line(f"{link} was {question}")
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


def as_json(path: Path, outcome: RerunOutcome) -> dict[str, Any]:
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


_EPILOG = """\
Make a journal with `openpendant serve --journal FILE` or `openpendant emulate --journal FILE`.

examples:
  openpendant packets rerun server.journal emulator.journal
  openpendant packets rerun server.journal --until 12.5     the state 12.5 s after the start
  openpendant packets rerun server.journal --until '#1234'  the state after event 1234

exit codes: 0 every byte is the same; 1 a difference; 2 no journal, or a damaged one"""


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    command = parser(
        "rerun",
        "Execute a journal again on a virtual clock, and compare every byte that leaves.",
        _EPILOG,
    )
    command.add_argument("files", nargs="+", type=Path, metavar="FILE", help="journals")
    command.add_argument(
        "--until",
        type=_until,
        default=Until(),
        metavar="T",
        help="end T seconds after the start, or after event '#N', and print the state",
    )
    command.add_argument("--state", action="store_true", help="print the state at the end")
    command.add_argument("--json", action="store_true", help="one JSON object for each file")
    return run(command, _rerun_files, argv)


def _until(text: str) -> Until:
    try:
        if text.startswith("#"):
            number = int(text[1:])
            if number < 1:
                raise ValueError
            return Until(number=number)
        seconds = float(text)
        if not 0 <= seconds < 1e9:
            raise ValueError
    except ValueError:
        expected = "seconds since the start, or '#' and the number of an event"
        raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}") from None
    return Until(time=round(seconds * 1e9))


def _rerun_files(arguments: argparse.Namespace) -> int:
    code = ExitCode.OK
    is_asked = arguments.state or arguments.until != Until()
    for path in arguments.files:
        outcome = rerun(path, arguments.until)
        if outcome.is_cut:
            complain(f"{path}: has no end (a killed process?); its last event is left out")
        if arguments.json:
            print(json.dumps(as_json(path, outcome)))
        else:
            print(in_words(path, outcome))
            if is_asked and outcome.difference is None:
                print(json.dumps(outcome.state, indent=2))
        if outcome.difference is not None:
            code = ExitCode.FAILED
    return code


if __name__ == "__main__":
    sys.exit(main())
