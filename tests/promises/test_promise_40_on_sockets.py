"""Thirty pages that ask about kinematics, with real processes: replies, and the ticks beside."""

import asyncio
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from promises.promise_figures import FEW, SLACK, Figures, tell
from promises.promise_table import Figure, figure
from rigs.clock.busy_machine import SCALE
from rigs.data.mesh_files import prism, stl, ur5_with_meshes
from rigs.processes.warm_start import begun

from openpendant.simplemsg.pendant import LinkState
from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.tools.bench import questions
from openpendant.tools.bench.questions import ASKINGS, Asking, observed, p99, served
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(3_600)]

REPLIES = [figure(40, "reply"), figure(40, "all_reply"), figure(40, "redundant_reply")]
TICK = figure(40, "tick")
PAGES = figure(40, "pages").count
RATES = [figure(40, "rate"), figure(40, "all_rate"), figure(40, "redundant_rate")]


MOVES = 0.9
"""Share of the ticks at which the robot moves; it turns round once a second."""

soak = pytest.mark.soak
TRIALS = [
    pytest.param(ASKINGS[0], REPLIES[0], FEW, 0.3, SLACK, id="few"),
    *(
        pytest.param(asking, reply, reply.trials, 6.0, 1.0, id=asking.title, marks=soak)
        for asking, reply in zip(ASKINGS, REPLIES, strict=True)
    ),
]


def test_what_is_asked_is_what_is_promised() -> None:
    assert [asking.rate for asking in ASKINGS] == [rate.count for rate in RATES]
    assert [asking.most for asking in ASKINGS] == [reply.ms for reply in REPLIES]


@pytest.fixture
def port(asking: Asking, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The pendant port of a server with the robot that is asked about, which has answered once.

    The first question starts the process that answers.
    """
    monkeypatch.setattr(questions, "process", begun)
    with served(asking.robot) as port:
        with SyncPendantClient.connect("127.0.0.1", port) as pendant:
            # A controller that has just been started reports when it comes to it.
            next(state for state in pendant.states() if state.link == LinkState.UP)
            at = pendant.kinematics.fk()
            pose: PlacedPose = {"position": at["position"], "orientation": at["orientation"]}
            pendant.kinematics.ik(pose)
        yield port


@pytest.mark.parametrize(("asking", "reply", "trials", "seconds", "slack"), TRIALS)
def test_promise_40_thirty_pages_ask_beside_a_robot_that_moves(
    port: int, asking: Asking, reply: Figure, trials: int, seconds: float, slack: float
) -> None:
    figures = Figures(f"{PAGES} pages ask for {asking.title}, reply")

    def seen(**how: Any) -> Any:
        return asyncio.run(observed(port, asking, seconds, pages=PAGES, **how))

    alone, beside = seen(are_silent=True), []
    assert alone.moving > MOVES
    while figures.need_more(trials, reply.ms, slack):
        began = time.monotonic_ns()
        account = seen()
        assert account.refused == []
        assert account.moving > MOVES
        figures.take(began, *account.replies)
        figures.idle += account.idle
        beside += account.late
    late, before = p99(beside), p99(alone.late)
    tell(f"ticks p99 {late:.2f} ms late, without questions {before:.2f} ms")
    figures.judge(reply.ms, slack=slack)
    assert late <= before + TICK.ms * slack * SCALE


async def downloads(port: int, sizes: list[int]) -> None:
    """Download all meshes, again and again; note how large they were."""
    async with await PendantClient.connect("127.0.0.1", port) as page:
        while True:
            for mesh in await page.shapes.meshes():
                sizes.append(len(await page.shapes.download(mesh["hash"])))


async def beside_downloads(port: int, asking: Asking, seconds: float) -> tuple[Any, list[int]]:
    """Return what pages saw beside a connection that downloads all meshes, and their sizes."""
    sizes: list[int] = []
    downloading = asyncio.create_task(downloads(port, sizes))
    try:
        return await observed(port, asking, seconds, pages=PAGES), sizes
    finally:
        downloading.cancel()
        with suppress(asyncio.CancelledError):
            await downloading


@soak
def test_promise_40_a_reply_is_as_soon_beside_a_page_that_downloads_all_meshes(
    tmp_path: Path,
) -> None:
    meshes = [stl(*prism(2_001, 0.1, 0.3 + 0.01 * number)) for number in range(3)]
    asking = replace(ASKINGS[0], robot=str(ur5_with_meshes(tmp_path, meshes)))
    figures = Figures("pages ask beside a download of all meshes, reply")
    with served(asking.robot) as port:
        while figures.need_more(REPLIES[0].trials, REPLIES[0].ms):
            began = time.monotonic_ns()
            account, sizes = asyncio.run(beside_downloads(port, asking, 12.0))
            assert account.refused == []
            assert len(sizes) >= len(meshes)
            figures.take(began, *account.replies)
            figures.idle += account.idle
    figures.judge(REPLIES[0].ms)
