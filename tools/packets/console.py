"""What every packet tool shares with its user: arguments, exit codes, and errors in one line.

Owns the exit codes and the way from an exception to a sentence on standard error; no input may end
in a traceback. The standard library's argument parser is used because scripts call these tools
often, and it starts in milliseconds.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from enum import IntEnum

from openpendant.simplemsg import DIALECTS, ByteOrder, Codec, ProtocolError, codec_for
from openpendant.simplemsg.errors import shown

ORDERS = {"little": ByteOrder.LITTLE, "big": ByteOrder.BIG}


class ExitCode(IntEnum):
    """Exit codes of `openpendant packets`; `--help` and docs/packets.md list them."""

    OK = 0
    FINDINGS = 1
    """A packet that is none, a check that failed, a difference, or nobody who reads the output."""
    USAGE = 2
    """Wrong arguments, or a file that cannot be read or is of no known kind."""
    PEER = 3
    """The peer could not be reached, hung up or never answered."""
    INTERRUPTED = 130


class PacketToolError(Exception):
    """The tool cannot go on; the text is the one line that the user reads.

    Attributes:
        code: what the process exits with.
    """

    code: ExitCode = ExitCode.USAGE


class PeerError(PacketToolError):
    """The peer could not be reached, hung up or never answered."""

    code = ExitCode.PEER


def parser(command: str, about: str, epilog: str = "") -> argparse.ArgumentParser:
    """Return an argument parser for `openpendant packets COMMAND`."""
    return argparse.ArgumentParser(
        prog=f"openpendant packets {command}",
        description=about,
        epilog=epilog,
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def add_wire_form(
    command: argparse.ArgumentParser, *, dialect: str = "standard", order: str | None = "little"
) -> None:
    """Add `--order`, `--real` and `--dialect`; `codec_of` reads them.

    Args:
        command: where to add them.
        dialect: the default dialect.
        order: the default byte order; None leaves `arguments.order` None, to be detected.
    """
    told = f"default: {order}" if order else "default: detected"
    command.add_argument("--order", choices=ORDERS, default=order, help=f"byte order ({told})")
    command.add_argument(
        "--real", type=int, choices=(4, 8), default=4, help="bytes of a real (default: 4)"
    )
    command.add_argument(
        "--dialect",
        choices=DIALECTS,
        default=dialect,
        help=f"messages to know (default: {dialect})",
    )


def codec_of(arguments: argparse.Namespace, order: ByteOrder | None = None) -> Codec:
    """Return the codec that `add_wire_form`'s arguments name.

    Args:
        arguments: as parsed.
        order: the byte order where the arguments leave it open.
    """
    known = ORDERS[arguments.order] if arguments.order else order or ByteOrder.LITTLE
    return codec_for(DIALECTS[arguments.dialect], known, arguments.real)


def seconds(text: str) -> float:
    """Return the time that an argument names [s]: up to a day, to wait for something."""
    try:
        named = float(text)
    except ValueError:
        named = -1.0
    if not 0 < named <= 86_400:
        raise argparse.ArgumentTypeError(f"{shown(text)} is no time from 0 to 86400 s")
    return named


def run(
    command: argparse.ArgumentParser,
    body: Callable[[argparse.Namespace], int],
    argv: list[str] | None,
) -> int:
    """Parse the arguments and run a command; whatever goes wrong becomes a line and a code.

    Args:
        command: the parser.
        body: what to do; returns the exit code.
        argv: arguments behind the command's name; None takes those of the process.
    """
    try:
        # Options may also stand between a name and what belongs to it.
        arguments = command.parse_intermixed_args(argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else ExitCode.OK
    if sys.stdout is None:
        # Nothing that a tool finds would be seen, and its exit code would say that all is well.
        complain("standard output is closed")
        return ExitCode.FINDINGS
    try:
        return body(arguments)
    except PacketToolError as error:
        complain(str(error))
        return error.code
    except ProtocolError as error:
        complain(str(error))
        return ExitCode.FINDINGS
    except BrokenPipeError:
        # Nobody reads any more; Python would complain again when it flushes at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.FINDINGS
    except OSError as error:
        complain(f"{error.filename or 'input or output'}: {error.strerror or error}")
        return ExitCode.USAGE
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED


def complain(sentence: str) -> None:
    """Write one line to standard error."""
    if sys.stderr is not None:  # else it would go where the output goes
        print(sentence, file=sys.stderr, flush=True)
