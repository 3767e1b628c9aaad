"""Whether a server lives, found by its silence; and whether it still sends what was asked for.

A dead link ends in no other way: requests that are planned are waited for without a bound.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from openpendant.simplemsg import Ping

from .conversation import Conversation
from .failures import ConnectionLost

_LOOK_PERIOD = 1.0
_PING_PERIOD = 5.0

_SILENCE = 15.0
"""A server that says nothing for so long, not even to a ping, is gone [s]."""


async def keep_alive(
    conversation: Conversation, misses_news: Callable[[float, float], bool]
) -> None:
    """Let the server hear of us, and end the connection once it falls silent.

    Args:
        conversation: the connection.
        misses_news: told the time and when the last bytes came, both by the loop's clock [s];
            returns whether to ask at once if the link lives.
    """
    loop = asyncio.get_running_loop()
    asked = loop.time()
    with contextlib.suppress(ConnectionLost):
        while True:
            await asyncio.sleep(_LOOK_PERIOD)
            now, heard = loop.time(), conversation.heard
            if now - heard > _SILENCE:
                text = f"the server said nothing for {_SILENCE:g} s"
                conversation.abort(ConnectionLost(text))
            if misses_news(now, heard) or now - asked >= _PING_PERIOD:
                asked = now
                conversation.write(Ping())
