from __future__ import annotations

import logging
import os

import pytest

from openpendant.server.shell.server_process import asked_niceness


class Scheduler:
    def __init__(self, lowest: int) -> None:
        self.niceness, self._lowest = 3, lowest

    def get(self, which: int, process: int) -> int:
        assert (which, process) == (os.PRIO_PROCESS, 0)
        return self.niceness

    def set(self, which: int, process: int, niceness: int) -> None:
        assert (which, process) == (os.PRIO_PROCESS, 0)
        if niceness < min(self.niceness, self._lowest):
            raise PermissionError
        self.niceness = niceness


def scheduler(monkeypatch: pytest.MonkeyPatch, lowest: int) -> Scheduler:
    made = Scheduler(lowest)
    monkeypatch.setattr(os, "getpriority", made.get)
    monkeypatch.setattr(os, "setpriority", made.set)
    return made


def test_the_niceness_holds_while_the_server_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    system = scheduler(monkeypatch, lowest=-20)
    with asked_niceness(-10):
        assert system.niceness == -10
    assert system.niceness == 3


def test_a_denied_niceness_is_logged_with_what_stays(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    system = scheduler(monkeypatch, lowest=0)
    with caplog.at_level(logging.INFO), asked_niceness(-10):
        assert system.niceness == 3
    assert caplog.messages == ["the system does not allow niceness -10; it stays at 3"]


def test_a_server_that_is_to_run_last_stays_last(monkeypatch: pytest.MonkeyPatch) -> None:
    system = scheduler(monkeypatch, lowest=0)
    with asked_niceness(19):
        assert system.niceness == 19
    assert system.niceness == 19
