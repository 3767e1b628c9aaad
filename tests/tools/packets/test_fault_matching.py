"""Which frames a rule fits, and that chance repeats."""

from __future__ import annotations

from typing import Any

import pytest
from rigs.faults.fault_bench import DOWN, EXAMPLES, LINK, UP, Bench, bench, point, taken
from rigs.peers.loopback_peers import PING, PONG

from openpendant.tools.packets.faulty.fault_engine import FaultEngine
from openpendant.tools.packets.faulty.fault_script import load_script

MATCHES: dict[str, tuple[dict[str, Any], set[int]]] = {
    "nothing in particular": ({}, {0, 1, 2, 3, 4, 5}),
    "a direction": ({"direction": "to_client"}, {1, 4}),
    "a type by number": ({"type": 11}, {0, 1, 2, 3, 5}),
    "a type by name": ({"type": "ping"}, {4}),
    "a kind of exchange": ({"comm": "reply"}, {1, 4}),
    "a reply code": ({"reply_code": 1}, {1, 4}),
    "a sequence": ({"sequence": 2}, {3}),
    "the n-th": ({"type": 11, "nth": 3}, {2}),
    "every n-th": ({"direction": "to_server", "every": 2}, {2, 5}),
    "at most so often": ({"times": 2}, {0, 1}),
    "from a time on": ({"after_s": 0.03}, {3, 4, 5}),
    "until a time": ({"before_s": 0.03}, {0, 1, 2}),
    "another connection": ({"connection": 2}, set()),
    "another pair": ({"pair": 2}, set()),
}


@pytest.mark.parametrize("case", MATCHES)
def test_a_rule_fits_what_it_says(case: str) -> None:
    match, fitting = MATCHES[case]
    frames = [
        (UP, point(0)),
        (DOWN, taken(0)),
        (UP, point(1)),
        (UP, point(2)),
        (DOWN, PONG),
        (UP, point(-4)),
    ]
    run = bench("drop", match)
    dropped = set()
    for index, (direction, frame) in enumerate(frames):
        before = len(run.sent)
        run.feed(direction, frame)
        if len(run.sent) == before:
            dropped.add(index)
        run.wait(10)
    assert dropped == fitting


def test_a_share_of_the_frames_is_about_that_share() -> None:
    run = bench("drop", {"probability": 0.2}).feed(UP, *[PING] * 2000)
    assert len(run.done) == pytest.approx(400, abs=80)


def _noise(seed: int | None) -> tuple[Any, ...]:
    script = load_script(EXAMPLES / "noisy.toml")
    run = Bench([])
    run.engine = FaultEngine(script, seed, run.done.append)
    run.engine.opened(LINK, 0)
    for sequence in range(2000):
        run.feed(UP, point(sequence)).feed(DOWN, taken(sequence)).wait(1)
    return run.sent, run.others, run.done


def test_the_same_seed_and_input_give_the_same_output() -> None:
    assert _noise(7) == _noise(7)
    assert _noise(None) == _noise(1)
    assert _noise(7)[2] != _noise(8)[2]
