"""Shared parts of the tools between two peers: their pairs, the ready line, and the end.

Owns the arguments `--listen` and `--to`, signals, and what the user reads while a proxy runs.
Knows nothing of what is done to the traffic.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from ...console import complain
from ..console import PacketToolError
from .endpoints import Endpoint, is_loopback, listen_endpoint, target_endpoint
from .proxy import Pair

PROGRESS_PERIOD = 0.5
"""The progress line on a terminal is renewed this often [s]."""


def add_pairs(command: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add `--listen`, `--to` and `--json`; `pairs_of` reads the first two."""
    command.add_argument(
        "--listen",
        action="append",
        required=required,
        type=listen_endpoint,
        metavar="[HOST:]PORT",
        help="where clients connect; 0 for any free port; may be repeated, each with its --to",
    )
    command.add_argument(
        "--to",
        action="append",
        required=required,
        type=target_endpoint,
        metavar="[HOST:]PORT",
        help="the server behind the --listen of the same place",
    )
    command.add_argument("--json", action="store_true", help="the ready line as a JSON object")


def pairs_of(arguments: argparse.Namespace) -> list[Pair]:
    """Return which port leads where; raise PacketToolError where they do not pair up."""
    listens: Sequence[Endpoint] = arguments.listen or ()
    targets: Sequence[Endpoint] = arguments.to or ()
    if not listens:
        raise PacketToolError("--listen and --to are needed")
    if len(listens) != len(targets):
        raise PacketToolError(f"{len(listens)} --listen need as many --to, not {len(targets)}")
    return [Pair(*pair) for pair in zip(listens, targets, strict=True)]


def say_ready(
    tool: str, pairs: Sequence[Pair], ports: Sequence[int], *, as_json: bool, on_stderr: bool
) -> None:
    """Print the ports in use, once they can be connected to; warn where strangers can."""
    warn_of_strangers(pair.listen for pair in pairs)
    if as_json:
        ways = [
            {"port": port, "to": str(pair.target)} for pair, port in zip(pairs, ports, strict=True)
        ]
        line = json.dumps({"event": "ready", "listen": ways, "pid": os.getpid()})
    else:
        ways_in_words = [
            f"{Endpoint(pair.listen.host, port)} -> {pair.target}"
            for pair, port in zip(pairs, ports, strict=True)
        ]
        line = f"{tool} ready {', '.join(ways_in_words)} pid={os.getpid()}"
    if on_stderr:
        complain(line)
    else:
        print(line, flush=True)


def warn_of_strangers(listens: Iterable[Endpoint]) -> None:
    """Warn if other machines can connect: nobody has to log in."""
    for listen in listens:
        if not is_loopback(listen.host):
            complain(f"warning: whoever reaches {listen.host or 'any address'} may use this")


def stop_on_signals(stop: asyncio.Event) -> None:
    """Set an event when the user or the system asks for the end."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, stop.set)
        except NotImplementedError:  # Windows
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop.set))


def report_loop_errors() -> None:
    """Report an error of the loop itself in one line, e.g. of closing a socket that is gone."""

    def report(loop: asyncio.AbstractEventLoop, context: dict[str, object]) -> None:
        complain(f"{context.get('message')}: {context.get('exception')}")

    asyncio.get_running_loop().set_exception_handler(report)


@contextmanager
def progress_line(text: Callable[[float], str]) -> Iterator[None]:
    """Write a line on a terminal over and over while the context lasts; nothing elsewhere.

    Its text gets the seconds since it was asked last.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield
        return

    async def renew() -> None:
        while True:
            await asyncio.sleep(PROGRESS_PERIOD)
            sys.stderr.write(f"\r{text(PROGRESS_PERIOD)}\x1b[K")
            sys.stderr.flush()

    task = asyncio.get_running_loop().create_task(renew())
    try:
        yield
    finally:
        task.cancel()
        sys.stderr.write("\n")
