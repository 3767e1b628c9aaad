"""`openpendant plan`: planned offline, or at a served cell where `--server` or `--cell` says so.

Owns that choice and the help text of both, nothing else: who plans offline starts no client, and
who plans at a cell needs no library of robots.
"""

from __future__ import annotations

from collections.abc import Sequence

from .console import ExitCode
from .help_text import asks_for_help, run_for_help

SERVED = ("--server", "--cell")
"""Either of these options makes it a plan at a served cell."""


def main(argv: list[str]) -> int:
    """Run the command and return its exit code."""
    if _is_served(argv):
        return _at_a_cell(argv)
    if not asks_for_help(argv):
        return _offline(argv)
    _, text = run_for_help(_offline, argv)
    _, served = run_for_help(_at_a_cell, ["--help"])
    print(f"{text.rstrip()}\n\nAt a served cell:\n\n{served}", end="")
    return ExitCode.OK


def _is_served(argv: Sequence[str]) -> bool:
    return any(each.partition("=")[0] in SERVED for each in argv)


def _offline(argv: list[str]) -> int:
    from openpendant.motion.cli import plan_command

    return plan_command.main(argv)


def _at_a_cell(argv: list[str]) -> int:
    from .pendants.commands import plan

    return plan.main(argv)
