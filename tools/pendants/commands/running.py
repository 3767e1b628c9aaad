"""Run of an operator's command: arguments, login, connection, output, errors and exit code.

Owns the arguments that the commands share, and the exit code and the sentence of each failure. The
modules of the commands own what they do on the connection.
"""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from functools import partial
from pathlib import Path

from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode, complain, json_text, one_line
from ..client import (
    DEFAULT_PORT,
    PendantClient,
    PendantError,
    Refused,
    SecretUnprotected,
    WrongArgument,
)
from ..connection_errors import server_address
from ..credentials import (
    PASSWORD_VARIABLE,
    STRICT,
    guest_name,
    pairing_code,
    password_of,
    tls_context,
    told_of_unprotected_secrets,
)

EPILOG = (
    "Exit codes: 0 done, 1 refused or not done, 2 wrong usage, 69 no server answered or it does"
    " not want us, 130 interrupted."
)


Connect = Callable[..., Awaitable[PendantClient]]
"""Connects to a command's server and logs in; takes `client` and `state_rate`."""


def parser(
    name: str, description: str, *, logs_in: bool = True, of_cell: bool = True
) -> argparse.ArgumentParser:
    """Return a parser of the arguments that the commands share.

    Args:
        of_cell: the command is about one cell.
    """
    reader = argparse.ArgumentParser(
        prog=f"openpendant {name}", description=description, epilog=EPILOG
    )
    reader.add_argument(
        "--server",
        type=address_argument,
        default=("127.0.0.1", DEFAULT_PORT),
        metavar="HOST[:PORT]",
        help=f"the pendant server (default: 127.0.0.1:{DEFAULT_PORT})",
    )
    if of_cell:
        reader.add_argument("--cell", default="", help="name of the cell, where it serves several")
    reader.add_argument(
        "--ca", type=Path, metavar="FILE", help="certificate of the server; encrypts the connection"
    )
    if logs_in:
        reader.add_argument(
            "--user",
            default="",
            metavar="NAME",
            help=f"account; its password is asked for, or taken from {PASSWORD_VARIABLE};"
            " with --pairing: your name in the class",
        )
        reader.add_argument("--pairing", action="store_true", help="ask for the code of a class")
        reader.add_argument("--strict", action="store_true", help=STRICT)
    reader.add_argument(
        "--json", action="store_true", help="one JSON object a line on standard output"
    )
    return reader


def add_speed(reader: argparse.ArgumentParser, default: float, of_what: str) -> None:
    """Add the option of the speed."""
    reader.add_argument(
        "--speed",
        type=_fraction,
        default=default,
        metavar="FRACTION",
        help=f"of {of_what}, above 0, up to 1 (default: {default:g})",
    )


def server_access(arguments: argparse.Namespace) -> Connect:
    """Return what connects to the server; prompt for a secret if one is needed.

    Raises:
        WrongArgument: a certificate cannot be used, or no secret was typed.
    """
    host, port = arguments.server
    tls = tls_context(arguments.ca)
    connect = partial(PendantClient.connect, host, port, cell=arguments.cell, tls=tls)
    if "user" not in arguments:
        return connect
    connect = partial(connect, strict=arguments.strict)
    if arguments.pairing:
        code = pairing_code()
        return partial(connect, user=arguments.user or guest_name("terminal"), pairing=code)
    return partial(connect, user=arguments.user, password=password_of(arguments.user))


def address_argument(text: str) -> tuple[str, int]:
    """Return host and port of a command's argument, for `argparse`.

    Raises:
        ArgumentTypeError: it is no address.
    """
    address = server_address(text)
    if address is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no HOST[:PORT] with a port of 1 to 65535")
    return address


def _fraction(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no fraction above 0, up to 1")
    return value


CONNECT_WITHIN = 10.0
"""Connecting, hello and login may take so long [s]."""


class CommandOutput:
    """Output of a command: sentences for a person, or one JSON object a line."""

    def __init__(self, name: str, *, is_json: bool) -> None:
        self.name = name
        self._is_json = is_json

    def say(self, event: str, sentence: str, **facts: object) -> None:
        """Write an event to standard output."""
        line = one_line(sentence, "?")
        if self._is_json:
            line = json_text({"event": event, "text": sentence, **facts})
        print(line, flush=True)

    def complain(self, event: str, sentence: str, **facts: object) -> None:
        """Write an error to standard error, and as JSON to standard output, too."""
        if self._is_json:
            self.say(event, sentence, **facts)
        complain(f"openpendant {self.name}: {one_line(sentence, '?')}")


Act = Callable[[PendantClient, CommandOutput], Awaitable[int]]
"""Action of a command on its connection; returns the exit code."""


def run(
    output: CommandOutput, enter: Callable[[], Connect], act: Act, *, state_rate: float = 0.0
) -> int:
    """Connect, let a command act and return its exit code; every failure is one sentence.

    Args:
        enter: returns what connects; may prompt for a secret.
        act: what the command does on the connection; returns the exit code.
        state_rate: of the state messages [Hz].
    """
    return run_task(output, lambda: _connected(enter(), act, output, state_rate))


def run_task(output: CommandOutput, make: Callable[[], Coroutine[None, None, int]]) -> int:
    """Carry out what a command does on the network and return its exit code.

    Args:
        make: returns what is to be carried out; may prompt for a secret.
    """

    def warn(text: str) -> None:
        complain(f"openpendant {output.name}: warning: {text}")

    try:
        with told_of_unprotected_secrets(warn):
            return asyncio.run(make())
    except KeyboardInterrupt:
        output.complain("interrupted", "interrupted")
        return ExitCode.INTERRUPTED
    except TimeoutError:
        text = f"no answer within {CONNECT_WITHIN:g} s; is it a pendant port?"
        return _unavailable(output, text)
    except (SecretUnprotected, WrongArgument) as error:
        output.complain("wrong", str(error))
        return ExitCode.USAGE
    except Refused as refused:
        return _refused(output, refused)
    except PendantError as error:
        return _unavailable(output, str(error))


def _unavailable(output: CommandOutput, text: str) -> int:
    output.complain("unavailable", text)
    return ExitCode.UNAVAILABLE


def _refused(output: CommandOutput, refused: Refused) -> int:
    """Write why the server refuses the connection; return the exit code."""
    if refused.code == VerdictCode.UNKNOWN_CELL:
        output.complain("refused", f"{refused}; say which by --cell NAME", **facts_of(refused))
        return ExitCode.USAGE
    output.complain("refused", refused.explained, **facts_of(refused))
    return ExitCode.UNAVAILABLE


async def _connected(connect: Connect, act: Act, output: CommandOutput, state_rate: float) -> int:
    async with asyncio.timeout(CONNECT_WITHIN):
        pendant = await connect(client=f"openpendant {output.name}", state_rate=state_rate)
    async with pendant:
        return await act(pendant, output)


def facts_of(refused: Refused) -> dict[str, object]:
    """Return a refusal as JSON fields."""
    code = refused.code
    name = code.name if isinstance(code, VerdictCode) else str(code)
    numbers = {"joint": refused.joint, "value": refused.value, "limit": refused.limit}
    return {"code": int(code), "name": name, **numbers, "remedy": refused.remedy}
