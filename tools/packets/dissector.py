"""`openpendant packets dissector`: write the Wireshark dissector of this version's messages."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..console import ExitCode
from ..reference.dissector import lua_dissector
from .console import parser, run

_EPILOG = """\
Use it at once:
  openpendant packets dissector -o openpendant.lua
  wireshark -X lua_script:openpendant.lua
or put the file into Wireshark's folder of personal Lua plugins (Help, About, Folders).
"""


def main(argv: list[str] | None = None) -> int:
    """Run the tool and return its exit code."""
    command = parser("dissector", "Write the Wireshark dissector, in Lua.", _EPILOG)
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="where to write it (default: stdout)"
    )
    return run(command, _write, argv)


def _write(arguments: argparse.Namespace) -> int:
    text = lua_dissector()
    if arguments.output is None:
        sys.stdout.write(text)
        sys.stdout.flush()
    else:
        arguments.output.write_text(text, encoding="utf-8", newline="\n")
    return ExitCode.OK
