from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from openpendant.server.watchdog import watchdog_main


class Connection:
    def __init__(self) -> None:
        self.stops = 0

    def stop(self, now: int) -> None:
        self.stops += 1


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    said: list[int] = []
    monkeypatch.setattr(watchdog_main, "_tell", said.append)
    return said


@pytest.fixture
def stop(told: list[int]) -> Callable[[int], list[int]]:
    def stopped(cells: int) -> list[int]:
        process: Any = watchdog_main._Child.__new__(watchdog_main._Child)
        process._connections = [Connection() for _ in range(4)]
        process._say = lambda line: None
        process._stop(cells, "no beat", 0)
        return [each.stops for each in process._connections]

    return stopped


@pytest.mark.parametrize(
    ("cells", "stops"),
    [(0b0001, [1, 0, 0, 0]), (0b0010, [0, 1, 0, 0]), (0b1010, [0, 1, 0, 1]), (0b1111, [1] * 4)],
)
def test_each_cell_that_may_move_is_stopped_and_no_other(
    stop: Callable[[int], list[int]], told: list[int], cells: int, stops: list[int]
) -> None:
    assert stop(cells) == stops
    assert told == [cells]


def test_where_nothing_may_move_nothing_is_stopped_and_nothing_said(
    stop: Callable[[int], list[int]], told: list[int]
) -> None:
    assert stop(0) == [0] * 4
    assert told == []
