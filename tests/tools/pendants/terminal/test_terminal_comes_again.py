"""When the terminal pendant tries to connect again."""

import asyncio
from contextlib import suppress
from itertools import pairwise

import pytest

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import ConnectionLost, PendantClient, Refused
from openpendant.tools.pendants.terminal.connection import LONGEST_PAUSE, RETRY, TerminalConnection
from openpendant.tools.pendants.terminal.panel import Panel


@pytest.mark.virtual_clock
@pytest.mark.parametrize(
    ("failure", "pause"),
    [
        (OSError("nobody listens"), RETRY),
        (ConnectionLost("broken"), RETRY),
        (Refused(VerdictCode.NO_PLACE, "more than 256 connections", -1, 5.0, 0.0), 5.0),
        (Refused(VerdictCode.NO_PLACE, "", -1, 0.0, 0.0), RETRY),
        (Refused(VerdictCode.NO_PLACE, "", -1, 3e38, 0.0), LONGEST_PAUSE),
        (Refused(VerdictCode.CELL_FAULTED, "", -1, 5.0, 0.0), RETRY),
    ],
)
async def test_it_comes_again_when_the_server_says_and_else_after_a_while(
    failure: Exception, pause: float
) -> None:
    loop = asyncio.get_running_loop()
    came: list[float] = []

    async def connect() -> PendantClient:
        came.append(loop.time())
        raise failure

    panel = Panel()
    with suppress(TimeoutError):
        async with asyncio.timeout(2.5 * pause):
            await TerminalConnection(panel, connect).run()
    assert [later - first for first, later in pairwise(came)] == [
        pytest.approx(pause),
        pytest.approx(pause),
    ]
    assert f"in {pause:g} s" in panel.messages.newest
