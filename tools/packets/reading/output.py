"""Output of the reading tools: one of three formats, colour, limit of packets."""

from __future__ import annotations

import argparse
import io
import json
import sys
from enum import Enum

from ..trace import Event
from .presentation import (
    Paint,
    Style,
    harmless,
    item_as_json,
    item_as_line,
    item_as_tree,
    on_terminal,
    painter,
)
from .reader import Reading


class Format(Enum):
    """Format of printed packets; the value is its name on the command line."""

    JSON = "json"
    LINE = "line"
    TREE = "tree"


def add_presentation(command: argparse.ArgumentParser, usual: Format | None) -> None:
    """Add `--format`, `--json`, `--color` and `--max-packets`.

    Args:
        command: where to add them.
        usual: the default format; None is a line a packet on a terminal, JSON elsewhere.
    """
    told = usual.value if usual else "line on a terminal, else json"
    command.add_argument(
        "--format",
        choices=[form.value for form in Format],
        default=usual.value if usual else None,
        help=f"one JSON object or one line a packet, or every field (default: {told})",
    )
    command.add_argument(
        "--json", dest="format", action="store_const", const="json", help="short for --format json"
    )
    command.add_argument(
        "--color",
        choices=["auto", "always", "never"],
        default="auto",
        help="auto: on a terminal, unless NO_COLOR is set (default)",
    )
    command.add_argument(
        "--max-packets", type=_positive, metavar="N", help="stop after N packets were printed"
    )


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


class Output:
    """Prints packets and events.

    Attributes:
        form: as what.
        paint: colours a text.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        """Read what `add_presentation` added."""
        if isinstance(sys.stdout, io.TextIOWrapper):
            # Texts of any script survive a terminal that cannot show them.
            sys.stdout.reconfigure(errors="backslashreplace")
        usual = Format.LINE if on_terminal() else Format.JSON
        self.form = Format(arguments.format) if arguments.format else usual
        self.paint: Paint = painter(arguments.color)
        self._left: int | None = arguments.max_packets
        self._scenario = ""

    @property
    def full(self) -> bool:
        """True when as many packets were printed as were asked for."""
        return self._left == 0

    def print_item(self, item: Reading | Event) -> None:
        """Print a packet or an event in the chosen format."""
        scenario = item.scenario if isinstance(item, Event) else item.packet.scenario
        if scenario != self._scenario and self.form is not Format.JSON:
            self.print_text(self.paint(f"== {harmless(scenario)}", Style.BOLD))
        self._scenario = scenario
        match self.form:
            case Format.JSON:
                self.print_text(json.dumps(item_as_json(item), allow_nan=False))
            case Format.LINE:
                self.print_text(item_as_line(item, self.paint))
            case Format.TREE:
                self.print_text(item_as_tree(item, self.paint))
        if isinstance(item, Reading):
            self.count_packet()

    def count_packet(self) -> None:
        """Note that a packet was printed."""
        if self._left is not None:
            self._left -= 1

    def print_text(self, text: str) -> None:
        """Print lines at once, so that a reader sees each packet before the next one comes."""
        print(text, flush=True)
