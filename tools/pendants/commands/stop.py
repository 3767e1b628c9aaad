"""`openpendant stop`: stops the robot and latches; anybody may, without a login. No safety device.

It asks for no password and takes no authority: nothing may stand between a person and a stop.
"""

from __future__ import annotations

import asyncio
import sys
from functools import partial

from ..client import PendantClient, PendantError
from .arguments import parser, way_in
from .running import DONE, UNAVAILABLE, Voice, run

_WITHIN = 3.0
_UNSURE = "it is not sure that the robot was stopped: use the controller's own emergency stop"


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code.

    Args:
        argv: arguments behind `openpendant stop`; None takes those of the process.
    """
    reader = parser(
        "stop",
        "Stop the robot and latch the software stop; it is no safety device. Anybody may.",
        logs_in=False,
    )
    reader.add_argument(
        "--reason", default="stop from a terminal", help="shown to others, up to 64 bytes"
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)

    async def act(pendant: PendantClient, voice: Voice) -> int:
        return await _stop(pendant, voice, arguments.reason)

    code = run(Voice("stop", is_json=arguments.json), partial(way_in, arguments), act)
    if code != DONE:
        print(f"openpendant stop: {_UNSURE}", file=sys.stderr)
    return code


async def _stop(pendant: PendantClient, voice: Voice, reason: str) -> int:
    try:
        async with asyncio.timeout(_WITHIN):
            await pendant.stop(_fitting(reason))
    except (PendantError, TimeoutError) as error:
        voice.complain("unconfirmed", str(error) or f"no answer within {_WITHIN:g} s")
        return UNAVAILABLE
    voice.say("stopped", "stopped; latched until `openpendant reset`, or a pendant, resets it")
    return DONE


def _fitting(reason: str) -> str:
    """Return a reason as the message holds it: none is a reason to send no stop."""
    printable = "".join(each if each.isprintable() else " " for each in reason)
    return printable.encode("utf-8", "ignore")[:64].decode("utf-8", "ignore")


if __name__ == "__main__":
    sys.exit(main())
