"""Thirty pages that ask about kinematics, with real processes: replies, and the ticks beside."""

import asyncio
import time
from typing import Any

import pytest
from promises.promise_figures import FEW, SLACK, Figures, tell
from promises.promise_table import Figure, figure
from rigs.clock.busy_machine import SCALE
from rigs.processes.warm_start import begun

from openpendant.tools.bench import questions
from openpendant.tools.bench.questions import ASKINGS, Asking, observed, p99, served

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(3_600)]

REPLIES = [figure(40, "reply"), figure(40, "all_reply"), figure(40, "redundant_reply")]
TICK = figure(40, "tick")
PAGES = figure(40, "pages").count
RATES = [figure(40, "rate"), figure(40, "all_rate"), figure(40, "redundant_rate")]


MOVES = 0.9
"""Share of the ticks at which the robot moves; it turns round once a second."""

soak = pytest.mark.soak
TRIALS = [
    pytest.param(ASKINGS[0], REPLIES[0], FEW, 1.0, SLACK, id="few"),
    *(
        pytest.param(asking, reply, reply.trials, 6.0, 1.0, id=asking.title, marks=soak)
        for asking, reply in zip(ASKINGS, REPLIES, strict=True)
    ),
]


def test_what_is_asked_is_what_is_promised() -> None:
    assert [asking.rate for asking in ASKINGS] == [rate.count for rate in RATES]
    assert [asking.most for asking in ASKINGS] == [reply.ms for reply in REPLIES]


@pytest.mark.parametrize(("asking", "reply", "trials", "seconds", "slack"), TRIALS)
def test_promise_40_thirty_pages_ask_beside_a_robot_that_moves(
    asking: Asking,
    reply: Figure,
    trials: int,
    seconds: float,
    slack: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(questions, "process", begun)
    figures = Figures(f"{PAGES} pages ask for {asking.title}, reply")
    with served(asking.robot) as port:

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
