"""`openpendant home`: moves the robot to a named position and returns the outcome."""

from __future__ import annotations

import sys
from functools import partial

from ..client import PendantClient
from .moving import STATE_RATE, move
from .running import CommandOutput, add_speed, parser, run, server_access


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    about = "Move the robot to its home, or another named position. Ctrl-C stops it."
    reader = parser("home", about)
    reader.add_argument(
        "name", nargs="?", help="named position: home (default), zero, or one of the cell's"
    )
    reader.add_argument("--to", metavar="NAME", help="the same, as an option")
    add_speed(reader, 0.1, "the joints' largest speed")
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    if arguments.name is not None and arguments.to is not None:
        reader.error("NAME and --to say the same; one of them is enough")
    target: str = arguments.name or arguments.to or "home"
    what = f"{target} at {arguments.speed:.0%} speed"

    async def act(pendant: PendantClient, output: CommandOutput) -> int:
        return await move(
            pendant, output, what, lambda: pendant.home(target, speed=arguments.speed)
        )

    return run(
        CommandOutput("home", is_json=arguments.json),
        partial(server_access, arguments),
        act,
        state_rate=STATE_RATE,
    )


if __name__ == "__main__":
    sys.exit(main())
