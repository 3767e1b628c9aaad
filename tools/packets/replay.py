"""`openpendant packets replay`: plays one side of a trace against a real peer, and compares."""

from __future__ import annotations

import argparse
import asyncio
import dataclasses
import json
import math
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..console import complain, one_line
from .console import PacketToolError, open_input, parser, run
from .live.consent import add_consent, may_act, require_consent
from .live.endpoints import Endpoint, listen_endpoint, target_endpoint
from .live.playback import Pace, PlayedSide, RecordedSession, sessions_of
from .live.replaying import Replay, ReplaySummary
from .live.serving import report_loop_errors, warn_of_strangers
from .reading.trace_files import read_trace
from .trace import Entry

_EPILOG = """\
The packets of one side are sent, at recorded times or as fast as replies come; what comes back is
compared with the recording: type, communication and reply code, one after the other. A server's
topics are not compared, but with --exact.

A trace with several ports needs one --to or --listen for each: RECORDED_PORT=[HOST:]PORT.

examples:
  openpendant packets replay motion.jsonl --as client --to 12000 --as-fast-as-replies
  openpendant packets replay cell.jsonl --as client --to 11000=robot:11000 --to 11002=robot:11002
  openpendant packets replay motion.jsonl --as server --listen 11000 --speed 2

exit codes: 0 all came back as recorded; 1 differences; 2 wrong usage, or an unreadable trace; 3 the
peer could not be reached, went away or did not answer.
"""


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(_parser(), _replay, argv)


def _parser() -> argparse.ArgumentParser:
    command = parser("replay", "Play one side of a trace against a real peer.", _EPILOG)
    add = command.add_argument
    add("trace", metavar="TRACE", help="a trace, capture or pcap; - for standard input")
    add("--as", dest="part", choices=[part.value for part in PlayedSide], required=True)
    add("--to", action="append", default=[], metavar="[RECORDED=][HOST:]PORT")
    add("--listen", action="append", default=[], metavar="[RECORDED=][HOST:]PORT")
    add("--port", type=int, help="play only the connections of this recorded port")
    add("--scenario", help="play only this part of a capture")
    add("--speed", type=_speed, default=1.0, metavar="X", help="X times as fast (default: 1)")
    add("--as-fast-as-replies", action="store_true", help="do not wait for recorded times")
    add("--exact", action="store_true", help="compare every byte, topics too")
    add("--timeout", type=_speed, default=5.0, metavar="S", help="for the peer (default: 5 s)")
    add("--json", action="store_true", help="print JSON objects")
    add_consent(command)
    return command


def _speed(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 1e-6 <= number <= 1e6:
        raise argparse.ArgumentTypeError(f"{text[:60]!r} is no number from 0.000001 to 1000000")
    return number


def _replay(arguments: argparse.Namespace) -> int:
    part = PlayedSide(arguments.part)
    speed = None if arguments.as_fast_as_replies else arguments.speed
    pace = Pace(speed, exact=arguments.exact)
    with open_input(arguments.trace) as stream:
        source = stream if arguments.trace == "-" else Path(arguments.trace)
        entries = chosen(read_trace(source), arguments.port, arguments.scenario)
        sessions = sessions_of(entries, part, exact=pace.exact)
    if not sessions:
        raise PacketToolError(f"{arguments.trace}: no connection to play")
    ways = _ways(arguments, part, sorted({session.port for session in sessions}))
    if part is PlayedSide.CLIENT and any(may_act(s.data) for each in sessions for s in each.steps):
        require_consent(arguments.yes_it_may_move, ", ".join(map(str, ways.values())))
    return asyncio.run(_run(sessions, part, pace, ways, arguments))


def chosen(entries: Iterable[Entry], port: int | None, scenario: str | None) -> Iterator[Entry]:
    """Yield the entries of one port and one part of a recording; None is any port, the only part.

    Raises:
        PacketToolError: there are several parts and none was chosen.
    """
    only: str | None = None
    for entry in entries:
        if scenario is None:
            if only is not None and entry.scenario != only:
                names = f"{only!r}, {entry.scenario!r}"
                raise PacketToolError(f"the recording has several parts ({names}, …): --scenario")
            only = entry.scenario
        if scenario in (None, entry.scenario) and port in (None, entry.port):
            yield entry


def _ways(arguments: argparse.Namespace, part: PlayedSide, ports: list[int]) -> dict[int, Endpoint]:
    """Return the address for each recorded port; PacketToolError for one wrong, missing or idle."""
    option = "--to" if part is PlayedSide.CLIENT else "--listen"
    given: list[str] = arguments.to if part is PlayedSide.CLIENT else arguments.listen
    read = target_endpoint if part is PlayedSide.CLIENT else listen_endpoint
    ways: dict[int, Endpoint] = {}
    for text in given:
        recorded, equals, address = text.rpartition("=")
        try:
            port = int(recorded) if equals else ports[0]
            endpoint = read(address)
        except (ValueError, argparse.ArgumentTypeError) as error:
            raise PacketToolError(f"{option} {text[:80]}: {error}") from None
        if port not in ports or port in ways or (not equals and len(ports) > 1):
            break
        ways[port] = endpoint
    if set(ways) != set(ports):
        wanted = " ".join(f"{option} {port}=[HOST:]PORT" for port in ports)
        raise PacketToolError(f"the recording has port {_list(ports)}: {wanted}, or choose --port")
    return ways


def _list(ports: list[int]) -> str:
    return ", ".join(map(str, ports))


async def _run(
    sessions: list[RecordedSession],
    part: PlayedSide,
    pace: Pace,
    ways: dict[int, Endpoint],
    arguments: argparse.Namespace,
) -> int:
    report_loop_errors()
    replay = Replay(sessions, part, pace, arguments.timeout)
    if part is PlayedSide.CLIENT:
        summary = await replay.play_client(ways)
    else:
        _say_ready(ways, await replay.listen(ways), as_json=arguments.json)
        summary = await replay.play_server()
    _say_summary(summary, as_json=arguments.json)
    return summary.code


def _say_ready(ways: dict[int, Endpoint], ports: dict[int, int], *, as_json: bool) -> None:
    warn_of_strangers(ways.values())
    if as_json:
        listen = [{"recorded": recorded, "port": port} for recorded, port in ports.items()]
        line = json.dumps({"event": "ready", "listen": listen, "pid": os.getpid()})
    else:
        used = ", ".join(f"{recorded} on {port}" for recorded, port in ports.items())
        line = f"replay ready {used} pid={os.getpid()}"
    print(line, flush=True)


def _say_summary(summary: ReplaySummary, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"event": "summary", **dataclasses.asdict(summary)}), flush=True)
    else:
        print(
            f"{summary.sent} packets sent, {summary.received} came back,"
            f" {summary.differences} differences",
            flush=True,
        )
        if summary.first:
            print(one_line(f"first difference: {summary.first}"), flush=True)
    if summary.failure:
        complain(summary.failure)
