"""`openpendant stop`: latches the software stop, without a login. No safety device.

It needs no password and no authority, so that nothing can prevent a person's stop.
"""

from __future__ import annotations

import asyncio
import sys
from functools import partial

from ...console import ExitCode
from ..client import PendantClient, PendantError
from .running import CommandOutput, parser, run, server_access

_WITHIN = 3.0
_UNSURE = "it is not sure that the robot was stopped: use the controller's own emergency stop"


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser(
        "stop",
        "Stop the robot and latch the software stop; it is no safety device. Anybody may.",
        logs_in=False,
    )
    reader.add_argument(
        "--reason", default="stop from a terminal", help="shown to others, up to 64 bytes"
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        return await _stop(pendant, output, arguments.reason)

    code = run(
        CommandOutput("stop", is_json=arguments.json), partial(server_access, arguments), act
    )
    if code != ExitCode.OK:
        print(f"openpendant stop: {_UNSURE}", file=sys.stderr)
    return code


async def _stop(pendant: PendantClient, output: CommandOutput, reason: str) -> int:
    try:
        async with asyncio.timeout(_WITHIN):
            await pendant.stop(_fitting(reason))
    except (PendantError, TimeoutError) as error:
        output.complain("unconfirmed", str(error) or f"no answer within {_WITHIN:g} s")
        return ExitCode.UNAVAILABLE
    output.say("stopped", "stopped; latched until `openpendant reset`, or a pendant, resets it")
    return ExitCode.OK


def _fitting(reason: str) -> str:
    """Return a reason shortened to the message's field: no reason may prevent a stop."""
    printable = "".join(each if each.isprintable() else " " for each in reason)
    return printable.encode("utf-8", "ignore")[:64].decode("utf-8", "ignore")


if __name__ == "__main__":
    sys.exit(main())
