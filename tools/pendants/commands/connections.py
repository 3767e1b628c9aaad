"""`openpendant connections`: shows who is connected to a server, closes one, bars an address.

An admin's command. The server keeps a bar until it ends by itself, is taken back, or the server
ends.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial

from openpendant.simplemsg.pendant.management.access import Bar, ConnectionReport

from ...console import ExitCode
from ..client import PendantClient, Refused
from .running import CommandOutput, facts_of, parser, run, server_access

_MOST_MINUTES = 24 * 60


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser(
        "connections",
        "List the connections of a server, close one, or bar an address. For admins.",
    )
    reader.add_argument(
        "action", nargs="?", choices=("list", "close", "bar", "unbar"), default="list"
    )
    reader.add_argument(
        "which", nargs="?", help="close: number of the connection; bar, unbar: address"
    )
    reader.add_argument(
        "--minutes",
        type=int,
        default=60,
        metavar="N",
        help=f"bar for so long, up to {_MOST_MINUTES} (default: 60)",
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    _check(reader, arguments)

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        try:
            return await _act(pendant, output, arguments)
        except Refused as refused:
            output.complain("refused", refused.explained, **facts_of(refused))
            return ExitCode.FAILED

    output = CommandOutput("connections", is_json=arguments.json)
    return run(output, partial(server_access, arguments), act)


def _check(reader: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Exit with a sentence where arguments do not go together."""
    action, which = arguments.action, arguments.which
    if (action == "list") != (which is None):
        reader.error("list takes nothing more; close takes a number, bar and unbar an address")
    if action == "close" and not (which.isascii() and which.isdigit() and int(which)):
        reader.error(f"{which!r} is no number of a connection")
    if not 1 <= arguments.minutes <= _MOST_MINUTES:
        reader.error(f"--minutes {arguments.minutes}; accepted: 1 to {_MOST_MINUTES}")


async def _act(pendant: PendantClient, output: CommandOutput, arguments: argparse.Namespace) -> int:
    which = arguments.which
    match arguments.action:
        case "close":
            await pendant.access.close(int(which))
            output.say("closed", f"connection {which} is closed", session=int(which))
        case "bar":
            closed = (await pendant.access.bar(which, minutes=arguments.minutes))["closed"]
            text = f"{which} is barred for {arguments.minutes} min; {closed} connections are closed"
            output.say("barred", text, address=which, closed=closed)
        case "unbar":
            await pendant.access.unbar(which)
            output.say("unbarred", f"{which} is let in again", address=which)
        case _:
            await _list(pendant, output)
    return ExitCode.OK


async def _list(pendant: PendantClient, output: CommandOutput) -> None:
    """Write a line for each connection and each bar."""
    last = 0
    while True:
        told = await pendant.access.connections(last)
        for each in told["connections"]:
            output.say("connection", _in_words(each), **each)
            last = each["session"]
        if not told["more"] or not told["connections"]:
            break
    for bar in told["barred"]:
        output.say("bar", _bar_in_words(bar), **bar)


def _in_words(each: ConnectionReport) -> str:
    who = f"{each['name']} ({each['role']})" if each["name"] else each["standing"]
    client = f"  {each['client']!r}" if each["client"] else ""
    cell = f" at {each['cell']}" if each["cell"] else ""
    return (
        f"{each['session']:>6}  {each['address']:<39}  {who:<28}{cell}  {each['since']:.0f} s"
        f"  {each['frames']}/s  {each['bytes'] / 1000:.1f} kB/s  {each['cost']:.1%}{client}"
    )


def _bar_in_words(bar: Bar) -> str:
    return f"barred  {bar['address']:<39}  for {bar['remaining'] / 60:.0f} min more"


if __name__ == "__main__":
    sys.exit(main())
