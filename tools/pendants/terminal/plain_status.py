"""How the robot stands, as plain text, once: for pipes, logs and screen readers.

Owns the asking and the order of the texts, which are those of the full screen.
"""

from __future__ import annotations

import time

from . import screen_text, words
from .connection import Connect, SignIn
from .panel import Panel

_PATIENCE = 5.0


async def status_once(connect: Connect, sign_in: SignIn) -> str:
    """Connect, wait for one state, and return it in words.

    Args:
        connect: makes a connection.
        sign_in: logs in on it.

    Raises:
        OSError: nobody listens there.
        PendantError: the server does not want us, or the connection ended.
        TimeoutError: no state came.
    """
    panel = Panel()
    async with await connect() as client:
        await sign_in(client)
        panel.cell.connected(client.hello, await client.snapshot())
        state = await client.wait_until(lambda _: True, within=_PATIENCE)
        now = time.monotonic_ns()
        panel.cell.take_state(state, now)
        texts = (
            screen_text.lamp_line(panel, now),
            screen_text.status_line(panel, now),
            words.banner(panel.cell, now),
            screen_text.joint_table(panel),
        )
    return "\n".join(text for text in texts if text)
