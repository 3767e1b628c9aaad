"""What the tests of the conformance testers share: sound peers, judged once."""

import pytest
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.judged_server import HALF_RATE, running_server

from openpendant.tools.packets.conformance.check import Judgement
from openpendant.tools.packets.conformance.server.runner import judge


@pytest.fixture(scope="session")
def sound_server() -> Judgement:
    """Our own server at half its rate, judged by every check on all its ports."""

    async def judged() -> Judgement:
        async with running_server(HALF_RATE) as options:
            return await judge(options)

    loop = VirtualLoop()
    try:
        return loop.run_until_complete(judged())
    finally:
        loop.close()
