"""`openpendant packets record`: a transparent proxy that writes every frame to a trace file."""

from __future__ import annotations

import argparse
import asyncio
import datetime
import re
from collections.abc import Callable, Sequence

from ..console import ExitCode, complain
from .console import parser, run
from .live.line_output import LineOutput
from .live.proxy import Pair, Proxy
from .live.relay import RecordingRelay
from .live.serving import (
    add_pairs,
    pairs_of,
    progress_line,
    report_loop_errors,
    say_ready,
    stop_on_signals,
)
from .trace import Entry, entry_line, header_line

_EPILOG = """\
Connect the client to the --listen port instead of the server. Every byte goes on at once; frames,
connections and their ends go to FILE, at the latest 0.1 s later. SIGINT or SIGTERM ends it.

examples:
  openpendant packets record --listen 11000 --to 192.168.1.20:11000 -o motion.jsonl
  openpendant packets record --listen 11000 --to robot:11000 --listen 11002 --to robot:11002 \\
      -o cell.jsonl --max-size 100M
  openpendant packets record --listen 0 --to 12000 -o - --json | openpendant packets show -

exit codes: 0 ended on request or at --max-size; 1 the file could not be written to its end; 2 wrong
usage, or the file cannot be opened; 3 a port cannot be listened on.
"""

_UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
_NANOSECONDS = 1e9


class PacketRecorder:
    """A proxy, the relay that records, and the trace file."""

    def __init__(
        self,
        pairs: Sequence[Pair],
        path: str,
        *,
        max_size: int | None = None,
        on_end: Callable[[str], None] = lambda reason: None,
    ) -> None:
        """Make a recorder that has touched nothing yet; needs a running loop."""
        started = datetime.datetime.now().astimezone().isoformat(timespec="microseconds")
        targets = ", ".join(str(pair.target) for pair in pairs)
        self.output = LineOutput(path, max_size=max_size, on_end=on_end)
        self.output.write(header_line(started, servers=targets))
        self._loop = asyncio.get_running_loop()
        self.relay = RecordingRelay(self._write, self._now)
        self._proxy = Proxy(pairs, self.relay)

    def _write(self, entry: Entry) -> None:
        if not self.output.ended:
            self.output.write(entry_line(entry))

    @property
    def _now(self) -> int:
        return round(self._loop.time() * _NANOSECONDS)

    @property
    def connections(self) -> int:
        """Connections now open."""
        return len(self._proxy.links)

    @property
    def unsent(self) -> int:
        """Bytes that receivers have not taken yet."""
        return self._proxy.unsent

    async def start(self) -> list[int]:
        """Listen, open the file, return the ports; PeerError or OSError, and nothing listens."""
        try:
            ports = await self._proxy.start()
            self.output.start()
        except BaseException:
            await self._proxy.close()
            await self.output.close()
            raise
        return ports

    async def close(self) -> None:
        """Drop the connections and complete the file."""
        await self._proxy.close()
        self.relay.finish(self._now)
        await self.output.close()


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(_parser(), lambda arguments: asyncio.run(_record(arguments)), argv)


def _parser() -> argparse.ArgumentParser:
    command = parser(
        "record", "Stand between client and server and write every frame to a trace file.", _EPILOG
    )
    add_pairs(command)
    command.add_argument("-o", dest="output", required=True, metavar="FILE", help="- for stdout")
    command.add_argument(
        "--max-size", type=_size, metavar="SIZE", help="end the recording there, e.g. 100M"
    )
    command.add_argument(
        "--fail",
        choices=("keep", "stop"),
        default="keep",
        help="when the recording ends early: keep the traffic flowing (default), or stop all",
    )
    return command


def _size(text: str) -> int:
    match = re.fullmatch(r"([0-9]{1,12})([kMG]?)", text, re.ASCII)
    if match is None or int(match[1]) == 0:
        raise argparse.ArgumentTypeError(f"{text[:80]!r} is no size such as 500k, 100M or 2G")
    return int(match[1]) * _UNITS[match[2]]


async def _record(arguments: argparse.Namespace) -> int:
    pairs = pairs_of(arguments)
    stop = asyncio.Event()
    goes_on = arguments.fail == "keep"

    def on_end(reason: str) -> None:
        complain(f"the recording ends here: {reason}" + ("; traffic goes on" if goes_on else ""))
        if not goes_on:
            stop.set()

    recorder = PacketRecorder(pairs, arguments.output, max_size=arguments.max_size, on_end=on_end)
    report_loop_errors()
    ports = await recorder.start()
    stop_on_signals(stop)
    say_ready("recorder", pairs, ports, as_json=arguments.json, on_stderr=arguments.output == "-")
    try:
        with progress_line(_progress_of(recorder)):
            await stop.wait()
    finally:
        goes_on = False  # a failure from here on is the end of everything
        await recorder.close()
    return ExitCode.FAILED if recorder.output.failed else ExitCode.OK


def _progress_of(recorder: PacketRecorder) -> Callable[[float], str]:
    before = 0

    def text(seconds: float) -> str:
        nonlocal before
        packets = recorder.relay.packets
        rate, before = (packets - before) / seconds, packets
        ended = f", recording ended: {recorder.output.ended}" if recorder.output.ended else ""
        return f"{packets} packets, {rate:.0f}/s, {recorder.connections} connections{ended}"

    return text
