"""`openpendant reset`: unlatches a software or protective stop after a confirmation.

It moves nothing, and clears no fault of the controller.
"""

from __future__ import annotations

import sys
from functools import cache, partial

from openpendant.simplemsg.pendant.management.cell import LatchedStop

from ...console import ExitCode, one_line
from ..client import NotUnderstood, PendantClient, Refused
from .running import CommandOutput, facts_of, parser, run, server_access


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser("reset", "Reset the latched stop; moves nothing. Asks before, unless --yes.")
    reader.add_argument("--yes", action="store_true", help="do not ask")
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    output = CommandOutput("reset", is_json=arguments.json)
    enter = cache(partial(server_access, arguments))
    shown: list[LatchedStop] = []
    if not arguments.yes:
        # On a connection of its own: nobody keeps one alive while a person thinks.
        code = run(output, enter, partial(_look, shown))
        if code != ExitCode.OK or not shown:
            return code
        code = _ask(output, shown[0])
        if code != ExitCode.OK:
            return code
    return run(output, enter, partial(_reset, shown))


async def _look(shown: list[LatchedStop], pendant: PendantClient, output: CommandOutput) -> int:
    """Read the latched stop into `shown`."""
    latched = await _latched(pendant)
    if latched is None:
        output.say("nothing", "no stop is latched")
    else:
        shown.append(latched)
    return ExitCode.OK


async def _reset(shown: list[LatchedStop], pendant: PendantClient, output: CommandOutput) -> int:
    """Reset the stop that was shown, or any latched stop if none was shown."""
    latched = await _latched(pendant)
    if latched is None:
        output.say("nothing", "no stop is latched")
        return ExitCode.OK
    whose = {"by": latched["client"], "reason": latched["reason"]}
    if shown and shown[0] != latched:
        text = f"another stop was latched meanwhile, by {_told(latched)}; it stays latched"
        output.complain("kept", text, **whose)
        return ExitCode.FAILED
    try:
        async with pendant.control():
            await pendant.reset_stop()
    except Refused as refused:
        output.complain("refused", refused.explained, **facts_of(refused))
        return ExitCode.FAILED
    output.say("reset", f"the stop by {_told(latched)} is reset; nothing moves by it", **whose)
    return ExitCode.OK


async def _latched(pendant: PendantClient) -> LatchedStop | None:
    """Return the latched stop; None for none.

    Raises:
        NotUnderstood: the server's snapshot does not say.
    """
    try:
        latched = (await pendant.snapshot())["stop"]
        if latched is not None:
            _told(latched)
    except (KeyError, TypeError) as error:
        text = f"the server's snapshot cannot be read ({error!r}); is it another version?"
        raise NotUnderstood(text) from None
    return latched


def _ask(output: CommandOutput, latched: LatchedStop) -> int:
    """Ask for a confirmation; return `ExitCode.OK` for yes, else the exit code of the command."""
    if not sys.stdin.isatty():
        output.complain("wrong", "nobody is there to be asked; a script says --yes")
        return ExitCode.USAGE
    question = one_line(f"Reset the stop by {_told(latched)}?", "?")
    print(f"{question} [y/N] ", end="", file=sys.stderr, flush=True)
    try:
        answer = sys.stdin.readline()
    except KeyboardInterrupt:
        output.complain("interrupted", "interrupted")
        return ExitCode.INTERRUPTED
    if answer.strip().lower() in ("y", "yes"):
        return ExitCode.OK
    output.complain("kept", "the stop stays latched")
    return ExitCode.FAILED


def _told(latched: LatchedStop) -> str:
    return f"{latched['client']} ({latched['reason']})"


if __name__ == "__main__":
    sys.exit(main())
