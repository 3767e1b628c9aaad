"""`openpendant why`: asks a server which condition keeps its robot from moving.

Speaks the public protocol as an onlooker; takes no authority and moves nothing. Exit codes: 0
ready, 1 not ready, 2 wrong usage, 69 nobody answered or the server does not want us, 130
interrupted.
"""

from __future__ import annotations

import argparse
import asyncio
import ssl
import sys
from pathlib import Path

from openpendant.simplemsg.pendant.management.cell import Why
from openpendant.simplemsg.verdicts import VerdictCode

from .console import ExitCode, complain, json_text, one_line
from .pendants.client import (
    DEFAULT_PORT,
    PendantClient,
    PendantError,
    Refused,
    SecretUnprotected,
    WrongArgument,
)
from .pendants.commands.running import address_argument
from .pendants.credentials import (
    PASSWORD_VARIABLE,
    STRICT,
    password_of,
    tls_context,
    told_of_unprotected_secrets,
)

_TIMEOUT = 5.0
_KINDS = ("move", "jog", "program")
_IS_IT = f"is it a pendant port (default {DEFAULT_PORT})?"


def main(argv: list[str] | None = None) -> int:
    """Run the command."""
    arguments = _parsed(sys.argv[1:] if argv is None else argv)
    host, port = arguments.server
    try:
        tls, password = tls_context(arguments.ca), password_of(arguments.user)
    except WrongArgument as error:
        return _complain(str(error), ExitCode.USAGE)
    except KeyboardInterrupt:
        return _complain("interrupted", ExitCode.INTERRUPTED)
    try:
        with told_of_unprotected_secrets(_warn):
            answer = asyncio.run(_ask(arguments, tls, password))
    except TimeoutError:
        return _complain(f"{host}:{port} did not answer within {_TIMEOUT:g} s; {_IS_IT}")
    except (SecretUnprotected, WrongArgument) as error:
        return _complain(str(error), ExitCode.USAGE)
    except Refused as refused:
        if refused.code == VerdictCode.UNKNOWN_CELL:
            return _complain(f"{host}:{port}: {refused}; say which by --cell NAME")
        return _complain(f"{host}:{port}: {refused.explained}")
    except PendantError as error:
        return _complain(str(error))
    try:
        said = json_text(answer, indent=2) if arguments.json else table(answer)
        is_ready = answer["ready"]
    except (KeyError, TypeError, StopIteration) as error:
        return _complain(f"{host}:{port}: its answer cannot be read ({error!r}); {_IS_IT}")
    print(said)
    return ExitCode.OK if is_ready else ExitCode.FAILED


def _parsed(argv: list[str]) -> argparse.Namespace:
    """Return the arguments; `server` is where it stands, bare or behind the option."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    if arguments.server is not None and arguments.named is not None:
        parser.error("HOST[:PORT] and --server both name a server; accepted: one of them")
    arguments.server = arguments.server or arguments.named or ("127.0.0.1", DEFAULT_PORT)
    return arguments


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="openpendant why",
        description="Ask a server why its robot does not move.",
        epilog="Exit codes: 0 it could move, 1 a condition is broken, 2 wrong usage, 69 no server"
        " answered or it does not want us, 130 interrupted.",
    )
    parser.add_argument(
        "named",
        nargs="?",
        type=address_argument,
        metavar="HOST[:PORT]",
        help=f"the pendant server (default: 127.0.0.1:{DEFAULT_PORT})",
    )
    parser.add_argument(
        "--server",
        type=address_argument,
        metavar="HOST[:PORT]",
        help="the same, as other commands take it",
    )
    parser.add_argument("--cell", default="", help="name of the cell, where it serves several")
    parser.add_argument("--kind", choices=_KINDS, default="move", help="what shall move it")
    parser.add_argument(
        "--ca", type=Path, metavar="FILE", help="certificate of the server; encrypts the connection"
    )
    parser.add_argument(
        "--user",
        default="",
        metavar="NAME",
        help=f"account; its password is asked for, or taken from {PASSWORD_VARIABLE}",
    )
    parser.add_argument("--strict", action="store_true", help=STRICT)
    parser.add_argument("--json", action="store_true", help="print the whole answer as JSON")
    return parser


async def _ask(
    arguments: argparse.Namespace, tls: ssl.SSLContext | None, password: str | None
) -> Why:
    host, port = arguments.server
    async with asyncio.timeout(_TIMEOUT):
        pendant = await PendantClient.connect(
            host,
            port,
            client="openpendant why",
            cell=arguments.cell,
            state_rate=0.0,
            tls=tls,
            user=arguments.user,
            password=password,
            strict=arguments.strict,
        )
        async with pendant:
            return await pendant.why(kind=arguments.kind)


def table(answer: Why) -> str:
    """Return the chain as lines: what holds, what is broken, and what to do about the first."""
    broken = answer["broken"]
    verdict = "is ready" if answer["ready"] else "is not ready"
    lines = [f"cell {answer['cell']} {verdict} for a {answer['kind']}", ""]
    for condition in answer["conditions"]:
        mark = "ok" if condition["holds"] else "NO"
        first = ">" if condition["condition"] == broken else " "
        lines.append(f"{first} {mark}  {condition['condition']:<10}  {condition['meaning']}")
        if not condition["holds"]:
            lines.append(f"                      {condition['text']}")
    if not answer["ready"]:
        first_broken = next(each for each in answer["conditions"] if each["condition"] == broken)
        lines += [
            "",
            f"cause:  {first_broken['cause']} ({first_broken['name']}, {first_broken['code']})",
            f"remedy: {first_broken['remedy']}",
        ]
    elif (ended := answer.get("ended")) is not None:
        lines += [
            "",
            f"the last motion ended before its goal: {ended['text']}",
            f"cause:  {ended['cause']} ({ended['name']}, {ended['code']})",
            f"remedy: {ended['remedy']}",
        ]
    lines += [f"note:   {remark}" for remark in answer.get("remarks", ())]
    return "\n".join(map(one_line, lines))


def _warn(text: str) -> None:
    complain(f"openpendant why: warning: {text}")


def _complain(text: str, code: int = ExitCode.UNAVAILABLE) -> int:
    complain(f"openpendant why: {text}")
    return code


if __name__ == "__main__":
    sys.exit(main())
