"""The process log: bounded, and one entry never looks like two (promise 30)."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator

import pytest
from promises.promise_table import figure

from openpendant.server.access.lockout import SECOND_NS
from openpendant.server.access.process_log import LimitedHandler


class Logged:
    def __init__(self) -> None:
        self.now = 0
        self.stream = io.StringIO()
        self.handler = LimitedHandler(self.stream, lambda: self.now)
        self.log = logging.Logger("tested", logging.INFO)
        self.log.addHandler(self.handler)

    @property
    def lines(self) -> list[str]:
        return self.stream.getvalue().splitlines()


@pytest.fixture
def logged() -> Iterator[Logged]:
    made = Logged()
    yield made
    made.handler.close()


@pytest.mark.parametrize("rate", [50, 150, 1_000, 10_000])
def test_promise_30_at_most_100_lines_in_any_second_and_none_uncounted(
    logged: Logged, rate: int
) -> None:
    at: list[int] = []
    for number in range(3 * rate):
        logged.now = number * SECOND_NS // rate
        written = logged.stream.tell()
        logged.log.info("line %d", number)
        at += [logged.now] * logged.stream.getvalue()[written:].count("\n")
    logged.handler.close()
    most = max(sum(begin <= each < begin + SECOND_NS for each in at) for begin in at)
    assert most <= figure(30, "lines").count
    left_out = [int(line.split(": ")[1].split()[0]) for line in logged.lines if "left out" in line]
    assert sum("line " in line for line in logged.lines) + sum(left_out) == 3 * rate


@pytest.mark.parametrize(
    "text", ["\n2026-01-01 ERROR forged", "\x1b[2J", "\r", "\u2028", "\x00", "\u202e", "\x9b31m"]
)
def test_promise_30_what_a_peer_says_breaks_no_line_and_commands_no_terminal(
    logged: Logged, text: str
) -> None:
    logged.log.info("a client called %s", text)
    assert len(logged.lines) == 1
    assert logged.stream.getvalue()[:-1].isprintable()


def test_the_lines_of_a_traceback_are_indented_and_counted(logged: Logged) -> None:
    for _ in range(100):
        try:
            raise ValueError("first\n2026-01-01 ERROR forged\x1b[2J")
        except ValueError:
            logged.log.exception("it failed")
    assert len(logged.lines) <= 100
    entries = [line for line in logged.lines if not line.startswith("    ")]
    assert all("it failed" in line for line in entries)
    assert logged.stream.getvalue().replace("\n", "").isprintable()
