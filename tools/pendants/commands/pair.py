"""`openpendant users pair`: asks a running server for the pairing code of a class, or ends it."""

from __future__ import annotations

import sys
from functools import partial

from ...console import ExitCode
from ..attaching import attach_command
from ..client import PendantClient, Refused
from .running import CommandOutput, facts_of, parser, run, server_access


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser(
        "users pair",
        "Ask a running server for a code that makes whoever types it an operator of its cell, or"
        " end the code. For admins.",
    )
    reader.add_argument(
        "--end", action="store_true", help="end the code, and what its guests may do"
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        try:
            if arguments.end:
                await pendant.end_pairing()
                output.say("ended", "the pairing code has ended, and what its guests may do")
            else:
                code = await pendant.issue_pairing_code()
                of_cell = ("--cell", arguments.cell) if arguments.cell else ()
                command = attach_command(*arguments.server, *of_cell, "--pairing")
                text = f"{code}   for: {command}"
                output.say("code", text, code=code)
        except Refused as refused:
            output.complain("refused", refused.explained, **facts_of(refused))
            return ExitCode.FAILED
        return ExitCode.OK

    output = CommandOutput("users pair", is_json=arguments.json)
    return run(output, partial(server_access, arguments), act)


if __name__ == "__main__":
    sys.exit(main())
