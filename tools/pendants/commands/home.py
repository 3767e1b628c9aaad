"""`openpendant home`: moves the robot to a named position and returns the outcome."""

from __future__ import annotations

import sys
from functools import partial

from ..client import PendantClient
from .moving import STATE_RATE, move
from .running import CommandOutput, add_speed, parser, run, server_access

_TARGETS = ("home", "zero")


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser("home", "Move the robot to its home position. Ctrl-C stops it.")
    reader.add_argument("--to", choices=_TARGETS, default="home", help="named position")
    add_speed(reader, 0.1, "the joints' largest speed")
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    what = f"{arguments.to} at {arguments.speed:.0%} speed"

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        return await move(
            pendant, output, what, lambda: pendant.home(arguments.to, speed=arguments.speed)
        )

    return run(
        CommandOutput("home", is_json=arguments.json),
        partial(server_access, arguments),
        act,
        state_rate=STATE_RATE,
    )


if __name__ == "__main__":
    sys.exit(main())
