"""Options that state the wire form to the reading tools: byte order, width of a real, dialect.

Beside the dialects of the protocol there is `all`: traffic in a file may be anybody's, and the
numbers of no two dialects collide.
"""

from __future__ import annotations

import argparse

from openpendant.simplemsg import (
    DIALECTS,
    MOTOMAN,
    PENDANT,
    STANDARD,
    ByteOrder,
    Codec,
    Dialect,
    Message,
    codec_for,
)

from ..console import ORDERS
from .reader import Reader


def _every_message() -> tuple[type[Message], ...]:
    known = STANDARD.messages + MOTOMAN.messages + PENDANT.messages
    return tuple(dict.fromkeys(known))


ALL = Dialect("all", _every_message())
"""Every message that any dialect knows."""

READABLE = {**DIALECTS, ALL.name: ALL}


def add_reading_form(
    command: argparse.ArgumentParser, *, dialect: str | None = None, order: str | None = None
) -> None:
    """Add `--order`, `--real` and `--dialect`.

    Args:
        command: where to add them.
        dialect: the default dialect; None leaves the choice to the kind of input.
        order: the default byte order; None leaves it to be detected.
    """
    command.add_argument(
        "--order",
        choices=ORDERS,
        default=order,
        help=f"byte order (default: {order or 'detected; little for hexadecimal lines'})",
    )
    command.add_argument(
        "--real", type=int, choices=(4, 8), default=4, help="bytes of a real (default: 4)"
    )
    command.add_argument(
        "--dialect",
        choices=READABLE,
        default=dialect,
        help=f"messages to know (default: {dialect or 'all; standard for hexadecimal lines'})",
    )


def codec_of(arguments: argparse.Namespace) -> Codec:
    """Return the codec for hexadecimal lines; little-endian and standard unless told otherwise."""
    order = ORDERS[arguments.order] if arguments.order else ByteOrder.LITTLE
    dialect = READABLE[arguments.dialect] if arguments.dialect else STANDARD
    return codec_for(dialect, order, arguments.real)


def reader_of(arguments: argparse.Namespace) -> Reader:
    """Return the reader for a trace; it detects byte orders and knows all unless told otherwise."""
    order = ORDERS[arguments.order] if arguments.order else None
    dialect = READABLE[arguments.dialect] if arguments.dialect else ALL
    return Reader(dialect, order, arguments.real)
