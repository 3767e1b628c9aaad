"""`openpendant reset`: unlatches a software or protective stop, once somebody has said yes.

It moves nothing, and clears no fault of the controller's own.
"""

from __future__ import annotations

import sys
from functools import cache, partial

from ..client import PendantClient, Refused
from ..snapshot import LatchedStop
from .arguments import parser, way_in
from .running import DONE, INTERRUPTED, NOT_DONE, USAGE, Voice, facts_of, run


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code.

    Args:
        argv: arguments behind `openpendant reset`; None takes those of the process.
    """
    reader = parser("reset", "Reset the latched stop; moves nothing. Asks before, unless --yes.")
    reader.add_argument("--yes", action="store_true", help="do not ask")
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    voice = Voice("reset", is_json=arguments.json)
    enter = cache(partial(way_in, arguments))
    shown: list[LatchedStop] = []
    if not arguments.yes:
        # On a connection of its own: nobody keeps one alive while a person thinks.
        code = run(voice, enter, partial(_look, shown))
        if code != DONE or not shown:
            return code
        code = _ask(voice, shown[0])
        if code != DONE:
            return code
    return run(voice, enter, partial(_reset, shown))


async def _look(shown: list[LatchedStop], pendant: PendantClient, voice: Voice) -> int:
    """Find out which stop is latched."""
    latched = (await pendant.snapshot())["stop"]
    if latched is None:
        voice.say("nothing", "no stop is latched")
    else:
        shown.append(latched)
    return DONE


async def _reset(shown: list[LatchedStop], pendant: PendantClient, voice: Voice) -> int:
    """Reset the stop that was shown, or whichever there is where none was."""
    latched = (await pendant.snapshot())["stop"]
    if latched is None:
        voice.say("nothing", "no stop is latched")
        return DONE
    whose = {"by": latched["client"], "reason": latched["reason"]}
    if shown and shown[0] != latched:
        text = f"another stop was latched meanwhile, by {_told(latched)}; it stays latched"
        voice.complain("kept", text, **whose)
        return NOT_DONE
    try:
        async with pendant.control():
            await pendant.reset_stop()
    except Refused as refused:
        voice.complain("refused", refused.explained, **facts_of(refused))
        return NOT_DONE
    voice.say("reset", f"the stop by {_told(latched)} is reset; nothing moves by it", **whose)
    return DONE


def _ask(voice: Voice, latched: LatchedStop) -> int:
    """Ask whether a stop is to be reset; return the exit code where it is not, else that of yes."""
    if not sys.stdin.isatty():
        voice.complain("wrong", "nobody is there to be asked; a script says --yes")
        return USAGE
    print(f"Reset the stop by {_told(latched)}? [y/N] ", end="", file=sys.stderr, flush=True)
    try:
        answer = sys.stdin.readline()
    except KeyboardInterrupt:
        voice.complain("interrupted", "interrupted")
        return INTERRUPTED
    if answer.strip().lower() in ("y", "yes"):
        return DONE
    voice.complain("kept", "the stop stays latched")
    return NOT_DONE


def _told(latched: LatchedStop) -> str:
    return f"{latched['client']} ({latched['reason']})"


if __name__ == "__main__":
    sys.exit(main())
