"""Run of an operator's command: connection, output, errors and exit code.

Owns the exit code and the sentence of each failure. The modules of the commands own what they do on
the connection.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable

from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode, complain, one_line
from ..client import PendantClient, PendantError, Refused, WrongArgument
from .arguments import ServerAccess

CONNECT_WITHIN = 10.0
"""Connecting, hello and login may take so long [s]."""


class CommandOutput:
    """Output of a command: sentences for a person, or one JSON object a line.

    Attributes:
        name: of the command.
    """

    def __init__(self, name: str, *, is_json: bool) -> None:
        """Make the output of a command."""
        self.name = name
        self._is_json = is_json

    def say(self, event: str, sentence: str, **facts: object) -> None:
        """Write an event to standard output."""
        line = one_line(sentence, "?")
        if self._is_json:
            line = json.dumps({"event": event, "text": sentence, **facts}, ensure_ascii=False)
        print(line, flush=True)

    def complain(self, event: str, sentence: str, **facts: object) -> None:
        """Write an error to standard error, and as JSON to standard output, too."""
        if self._is_json:
            self.say(event, sentence, **facts)
        complain(f"openpendant {self.name}: {one_line(sentence, '?')}")


Act = Callable[[PendantClient, CommandOutput], Awaitable[int]]
"""Action of a command on its connection; returns the exit code."""


def run(
    output: CommandOutput, enter: Callable[[], ServerAccess], act: Act, *, state_rate: float = 0.0
) -> int:
    """Connect, let a command act and return its exit code; every failure is one sentence.

    Args:
        output: of the command.
        enter: returns the server's address and the login; may prompt for a secret.
        act: what the command does on the connection; returns the exit code.
        state_rate: of the state messages [Hz].
    """
    try:
        return asyncio.run(_connected(enter(), act, output, state_rate))
    except KeyboardInterrupt:
        output.complain("interrupted", "interrupted")
        return ExitCode.INTERRUPTED
    except TimeoutError:
        text = f"no answer within {CONNECT_WITHIN:g} s; is it a pendant port?"
        return _unavailable(output, text)
    except WrongArgument as error:
        output.complain("wrong", str(error))
        return ExitCode.USAGE
    except Refused as refused:
        return _refused(output, refused)
    except PendantError as error:
        return _unavailable(output, str(error))


def _unavailable(output: CommandOutput, text: str) -> int:
    output.complain("unavailable", text)
    return ExitCode.UNAVAILABLE


def _refused(output: CommandOutput, refused: Refused) -> int:
    """Write why the server refuses the connection; return the exit code."""
    if refused.code == VerdictCode.UNKNOWN_CELL:
        output.complain("refused", f"{refused}; say which by --cell NAME", **facts_of(refused))
        return ExitCode.USAGE
    output.complain("refused", refused.explained, **facts_of(refused))
    return ExitCode.UNAVAILABLE


async def _connected(way: ServerAccess, act: Act, output: CommandOutput, state_rate: float) -> int:
    async with asyncio.timeout(CONNECT_WITHIN):
        pendant = await PendantClient.connect(
            way.host,
            way.port,
            client=f"openpendant {output.name}",
            cell=way.cell,
            state_rate=state_rate,
            tls=way.tls,
            user=way.user,
            password=way.password,
            pairing=way.pairing,
        )
    async with pendant:
        return await act(pendant, output)


def facts_of(refused: Refused) -> dict[str, object]:
    """Return a refusal as JSON fields."""
    code = refused.code
    name = code.name if isinstance(code, VerdictCode) else str(code)
    numbers = {"joint": refused.joint, "value": refused.value, "limit": refused.limit}
    return {"code": int(code), "name": name, **numbers, "remedy": refused.remedy}
