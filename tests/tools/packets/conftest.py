"""What the tests of the conformance testers share: sound peers, judged once."""

from functools import cache

import pytest
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.judged_server import HALF_RATE, PARTS, running_server

from openpendant.tools.packets.conformance.check import Judgement, Section
from openpendant.tools.packets.conformance.server.runner import judge


@cache
def _sound_part(sections: tuple[Section, ...]) -> Judgement:
    async def judged() -> Judgement:
        async with running_server(HALF_RATE) as options:
            return await judge(options, only=[section.name for section in sections])

    loop = VirtualLoop()
    try:
        return loop.run_until_complete(judged())
    finally:
        loop.close()


@pytest.fixture(scope="session", params=PARTS, ids=lambda part: "-".join(s.name for s in part))
def sound_part(request: pytest.FixtureRequest) -> tuple[tuple[Section, ...], Judgement]:
    """Our own server at half its rate, judged by every check of some sections; each part once."""
    return request.param, _sound_part(request.param)


@pytest.fixture(scope="session")
def sound_pendant_port() -> Judgement:
    """Our own server at half its rate, judged by every check of the pendant port."""
    return _sound_part((Section.PENDANT,))
