"""`openpendant packets rerun`: run a server or an emulator again, exactly as its journal says.

Owns the run over a journal and what the user reads about it. The comparison is `reenactment`'s.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
import time
from collections import deque
from collections.abc import Callable
from contextvars import Context
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from openpendant.simplemsg import PENDANT, Connection, Malformed, Role, Unasked, codec_for
from openpendant.simplemsg.opaque import message_type
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME

from .console import ExitCode, PacketToolError, complain, parser, run
from .journals.journal_file import Asked, Effect, Happening, Header, JournalFile, Out
from .journals.reenactment import Actor, Difference, MakeActor, Prompter

_CONTEXT = 5
_EPILOG = """\
Make a journal with `openpendant serve --journal FILE` or `openpendant emulate --journal FILE`.

examples:
  openpendant packets rerun server.journal emulator.journal
  openpendant packets rerun server.journal --until 12.5     the state 12.5 s after the start
  openpendant packets rerun server.journal --until '#1234'  the state after event 1234

exit codes: 0 every byte is the same; 1 a difference; 2 no journal, or a damaged one"""


@dataclass(slots=True)
class Outcome:
    """What a run over a journal showed.

    Attributes:
        header: of the journal.
        events: how many events happened again.
        last: time of the last of them since the start [ns].
        bytes_in: bytes that came in.
        bytes_out: bytes that left, all equal.
        frames: pieces in which they left.
        seconds: how long the run took [s].
        state: what the process knew at the end.
        difference: the first difference, None where there was none.
        before: the last events before the difference, it included.
        is_cut: the journal has no end.
    """

    header: Header
    events: int = 0
    last: int = 0
    bytes_in: int = 0
    bytes_out: int = 0
    frames: int = 0
    seconds: float = 0.0
    state: dict[str, Any] = field(default_factory=dict)
    difference: Difference | None = None
    before: deque[Happening] = field(default_factory=lambda: deque(maxlen=_CONTEXT))
    is_cut: bool = False


@dataclass(frozen=True, slots=True)
class Until:
    """Where a run ends: after the last event up to a time [ns], or after an event by number."""

    time: int | None = None
    number: int | None = None

    def is_before(self, happening: Happening) -> bool:
        """Say whether the run ends before an event."""
        if self.number is not None:
            return happening.number > self.number
        return self.time is not None and happening.time > self.time


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
            print(json.dumps(_as_json(path, outcome)))
        else:
            print(_in_words(path, outcome))
            if is_asked and outcome.difference is None:
                print(json.dumps(outcome.state, indent=2))
        if outcome.difference is not None:
            code = ExitCode.FINDINGS
    return code


class StillLoop(asyncio.SelectorEventLoop):
    """A loop on which nothing happens by itself: what is to happen is in the journal.

    Attributes:
        is_still: callbacks and timers are forgotten.
    """

    is_still = False

    def call_soon(  # type: ignore[override]  # the stubs' type variables cannot be repeated here
        self, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.Handle:
        """Forget the callback while the loop is still."""
        handle = asyncio.Handle(callback, args, self, context)
        return handle if self.is_still else super().call_soon(callback, *args, context=context)

    def call_at(  # type: ignore[override]
        self,
        when: float,
        callback: Callable[..., object],
        *args: Any,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Forget the timer while the loop is still."""
        if self.is_still:
            return asyncio.TimerHandle(when, callback, args, self, context)
        return super().call_at(when, callback, *args, context=context)


def rerun(path: Path, until: Until | None = None) -> Outcome:
    """Execute a journal again.

    Args:
        path: the journal.
        until: where to end; the journal's end where left out.

    Raises:
        JournalError: it is no journal, or a damaged one.
        OSError: it cannot be read.
    """
    loop = StillLoop()

    async def live_again() -> Outcome:
        # The process that is played wants a running loop.
        loop.is_still = True
        try:
            return _rerun(path, until or Until())
        finally:
            loop.is_still = False

    try:
        return loop.run_until_complete(live_again())
    finally:
        loop.close()


def _rerun(path: Path, limit: Until) -> Outcome:
    began = time.perf_counter()
    with path.open("rb") as stream:
        journal = JournalFile(path, stream)
        prompter = Prompter(journal.header)
        actor = _actor_of(journal.header)(journal.header, prompter)
        outcome = Outcome(journal.header)
        try:
            for happening in journal.happenings():
                if limit.is_before(happening):
                    break
                _play(actor, prompter, happening, outcome)
        except Difference as difference:
            outcome.difference = difference
        outcome.is_cut = journal.is_cut
    outcome.bytes_out, outcome.frames = prompter.bytes_out, prompter.frames
    outcome.state = actor.state()
    outcome.seconds = time.perf_counter() - began
    return outcome


def _play(actor: Actor, prompter: Prompter, happening: Happening, outcome: Outcome) -> None:
    outcome.before.append(happening)
    outcome.last = happening.time
    outcome.bytes_in += len(happening.data)
    with prompter.prompting(happening):
        actor.play(happening)
    outcome.events += 1


def _actor_of(header: Header) -> MakeActor:
    # Either is imported only when it is wanted: an emulator's journal needs no Pinocchio.
    match header.kind:
        case "server":
            from .journals.reenacted_server import ReenactedServer

            return ReenactedServer
        case "emulator":
            from .journals.reenacted_emulator import ReenactedEmulator

            return ReenactedEmulator
    raise PacketToolError(f"a journal of {header.kind!r} is not known here")


def _in_words(path: Path, outcome: Outcome) -> str:
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


def _as_json(path: Path, outcome: Outcome) -> dict[str, Any]:
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


if __name__ == "__main__":
    sys.exit(main())
