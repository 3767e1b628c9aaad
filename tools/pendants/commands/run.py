"""`openpendant run PROGRAM`: runs a stored program, reports its lines and returns the outcome."""

from __future__ import annotations

import argparse
import sys
from functools import partial

from openpendant.simplemsg.pendant import ProgramReport, ProgramState

from ..client import PendantClient
from .moving import STATE_RATE, move
from .running import CommandOutput, add_speed, parser, run, server_access

_STANDS = {
    ProgramState.PAUSED: "is paused",
    ProgramState.AT_BREAKPOINT: "waits at a breakpoint",
    ProgramState.STEPPED: "is paused after a step",
}


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser("run", "Run a stored program. Ctrl-C stops the robot and ends it.")
    reader.add_argument("program", metavar="PROGRAM", help="name of the program")
    add_speed(reader, 1.0, "the programmed speeds")
    reader.add_argument("--loops", type=_count, default=1, metavar="N", help="0 for without end")
    reader.add_argument(
        "--revision", type=_count, default=0, metavar="N", help="only this one; 0 for the newest"
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    what = f"program {arguments.program!r}"

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        pendant.on_program = lambda report: _tell(output, what, report)
        return await move(
            pendant,
            output,
            what,
            lambda: pendant.run_program(
                arguments.program,
                speed=arguments.speed,
                loops=arguments.loops,
                revision=arguments.revision,
            ),
        )

    return run(
        CommandOutput("run", is_json=arguments.json),
        partial(server_access, arguments),
        act,
        state_rate=STATE_RATE,
    )


def _tell(output: CommandOutput, what: str, report: ProgramReport) -> None:
    if report.state == ProgramState.NONE:
        return
    state = ProgramState(report.state)
    text = f"{what}: line {report.line}, run {report.loop}"
    if state in _STANDS:
        text += f" {_STANDS[state]}; Ctrl-C ends it"
    output.say(
        "line",
        f"{text}{f': {report.text}' if report.text else ''}",
        line=report.line,
        loop=report.loop,
        state=state.name.lower(),
        program=report.program,
    )


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 2**31):
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 0")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
