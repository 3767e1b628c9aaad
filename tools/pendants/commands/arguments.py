"""Arguments of the operator's commands: server and cell, login, and form of the output."""

from __future__ import annotations

import argparse
import ssl
from dataclasses import dataclass
from pathlib import Path

from ..client import DEFAULT_PORT
from ..connection_errors import server_address
from ..credentials import PASSWORD_VARIABLE, guest_name, pairing_code, password_of, tls_context

EPILOG = (
    "Exit codes: 0 done, 1 refused or not done, 2 wrong usage, 69 no server answered or it does"
    " not want us, 130 interrupted."
)


@dataclass(frozen=True, slots=True)
class ServerAccess:
    """Address of a cell and the login of a command.

    Attributes:
        host: the server.
        port: its pendant port.
        cell: name of the cell; empty for the only one.
        tls: how to encrypt; None for clear text.
        user: account, or name of a guest.
        password: of the account; None without an account.
        pairing: code of a class; None without one.
    """

    host: str
    port: int
    cell: str
    tls: ssl.SSLContext | None = None
    user: str = ""
    password: str | None = None
    pairing: str | None = None


def parser(name: str, description: str, *, logs_in: bool = True) -> argparse.ArgumentParser:
    """Return a parser of the arguments that the commands share.

    Args:
        name: of the command.
        description: for its help.
        logs_in: add the options of a login.
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


def server_access(arguments: argparse.Namespace) -> ServerAccess:
    """Return the server's address and the login; prompt for a secret if one is needed.

    Raises:
        WrongArgument: a certificate cannot be used, or no secret was typed.
    """
    host, port = arguments.server
    tls = tls_context(arguments.ca)
    if "user" not in arguments:
        return ServerAccess(host, port, arguments.cell, tls)
    if arguments.pairing:
        code = pairing_code()
        user = arguments.user or guest_name("terminal")
        return ServerAccess(host, port, arguments.cell, tls, user, pairing=code)
    password = password_of(arguments.user)
    return ServerAccess(host, port, arguments.cell, tls, arguments.user, password)


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
