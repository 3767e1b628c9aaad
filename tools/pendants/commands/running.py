"""From the arguments of a command to its exit code: the connection, what is said, what went wrong.

Owns the exit codes and how a failure is told; what a command does with its connection is its own.
"""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Awaitable, Callable

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import PendantClient, PendantError, Refused, WrongArgument
from .arguments import WayIn

DONE, NOT_DONE, USAGE, UNAVAILABLE, INTERRUPTED = 0, 1, 2, 69, 130

CONNECT_WITHIN = 10.0
"""Connecting, hello and login may take so long [s]."""


class Voice:
    """What a command says: sentences for a person, or one JSON object a line.

    Attributes:
        name: of the command.
    """

    def __init__(self, name: str, *, is_json: bool) -> None:
        """Speak for a command."""
        self.name = name
        self._is_json = is_json

    def say(self, event: str, sentence: str, **facts: object) -> None:
        """Tell what happened on standard output."""
        line = _printable(sentence)
        if self._is_json:
            line = json.dumps({"event": event, "text": sentence, **facts}, ensure_ascii=False)
        print(line, flush=True)

    def complain(self, event: str, sentence: str, **facts: object) -> None:
        """Tell what went wrong, on standard error; as JSON on standard output, too."""
        if self._is_json:
            self.say(event, sentence, **facts)
        print(f"openpendant {self.name}: {_printable(sentence)}", file=sys.stderr, flush=True)


Act = Callable[[PendantClient, Voice], Awaitable[int]]
"""What a command does with its connection; returns its exit code."""


def run(voice: Voice, enter: Callable[[], WayIn], act: Act, *, state_rate: float = 0.0) -> int:
    """Connect, let a command act and return its exit code; every failure is one sentence.

    Args:
        voice: what says it.
        enter: says how to get in; may ask for a secret.
        act: what to do.
        state_rate: state messages wanted, Hz.
    """
    try:
        return asyncio.run(_connected(enter(), act, voice, state_rate))
    except KeyboardInterrupt:
        voice.complain("interrupted", "interrupted")
        return INTERRUPTED
    except TimeoutError:
        text = f"no answer within {CONNECT_WITHIN:g} s; is it a pendant port?"
        return _unavailable(voice, text)
    except WrongArgument as error:
        voice.complain("wrong", str(error))
        return USAGE
    except Refused as refused:
        return _refused(voice, refused)
    except PendantError as error:
        return _unavailable(voice, str(error))


def _unavailable(voice: Voice, text: str) -> int:
    voice.complain("unavailable", text)
    return UNAVAILABLE


def _refused(voice: Voice, refused: Refused) -> int:
    """Tell of a server that does not want us."""
    if refused.code == VerdictCode.UNKNOWN_CELL:
        voice.complain("refused", f"{refused}; say which by --cell NAME", **facts_of(refused))
        return USAGE
    voice.complain("refused", refused.explained, **facts_of(refused))
    return UNAVAILABLE


async def _connected(way: WayIn, act: Act, voice: Voice, state_rate: float) -> int:
    async with asyncio.timeout(CONNECT_WITHIN):
        pendant = await PendantClient.connect(
            way.host,
            way.port,
            client=f"openpendant {voice.name}",
            cell=way.cell,
            state_rate=state_rate,
            tls=way.tls,
            user=way.user,
            password=way.password,
            pairing=way.pairing,
        )
    async with pendant:
        return await act(pendant, voice)


def facts_of(refused: Refused) -> dict[str, object]:
    """Return what a refusal says, for a program."""
    code = refused.code
    name = code.name if isinstance(code, VerdictCode) else str(code)
    numbers = {"joint": refused.joint, "value": refused.value, "limit": refused.limit}
    return {"code": int(code), "name": name, **numbers, "remedy": refused.remedy}


def _printable(text: str) -> str:
    """Return text of others so that it cannot command a terminal."""
    return "".join(each if each.isprintable() else "?" for each in text)
