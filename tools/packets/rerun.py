"""`openpendant packets rerun`: run a server or an emulator again, exactly as its journal says.

Owns arguments, output and exit codes, nothing else; the run is `journals.rerun`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .console import ExitCode, complain, parser, run
from .journals.rerun import Until, rerun
from .journals.rerun_report import as_json, in_words

_EPILOG = """\
Make a journal with `openpendant serve --journal FILE` or `openpendant emulate --journal FILE`.

examples:
  openpendant packets rerun server.journal emulator.journal
  openpendant packets rerun server.journal --until 12.5     the state 12.5 s after the start
  openpendant packets rerun server.journal --until '#1234'  the state after event 1234

exit codes: 0 every byte is the same; 1 a difference; 2 no journal, or a damaged one"""


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    command = parser(
        "rerun",
        "Execute a journal again on a virtual clock, and compare every byte that leaves.",
        _EPILOG,
    )
    command.add_argument("files", nargs="+", type=Path, metavar="FILE", help="journals")
    command.add_argument(
        "--until",
        type=_until,
        default=Until(),
        metavar="T",
        help="end T seconds after the start, or after event '#N', and print the state",
    )
    command.add_argument("--state", action="store_true", help="print the state at the end")
    command.add_argument("--json", action="store_true", help="one JSON object for each file")
    return run(command, _rerun_files, argv)


def _until(text: str) -> Until:
    try:
        if text.startswith("#"):
            number = int(text[1:])
            if number < 1:
                raise ValueError
            return Until(number=number)
        seconds = float(text)
        if not 0 <= seconds < 1e9:
            raise ValueError
    except ValueError:
        expected = "seconds since the start, or '#' and the number of an event"
        raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}") from None
    return Until(time=round(seconds * 1e9))


def _rerun_files(arguments: argparse.Namespace) -> int:
    code = ExitCode.OK
    is_asked = arguments.state or arguments.until != Until()
    for path in arguments.files:
        outcome = rerun(path, arguments.until)
        if outcome.is_cut:
            complain(f"{path}: has no end (a killed process?); its last event is left out")
        if arguments.json:
            print(json.dumps(as_json(path, outcome)))
        else:
            print(in_words(path, outcome))
            if is_asked and outcome.difference is None:
                print(json.dumps(outcome.state, indent=2))
        if outcome.difference is not None:
            code = ExitCode.FINDINGS
    return code


if __name__ == "__main__":
    sys.exit(main())
