"""The server runs before ordinary programs where the system lets it, and says where it does not."""

from __future__ import annotations

import logging
import os

import pytest

from openpendant.server.scheduling import ask_for_niceness


def test_the_niceness_is_asked_for_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, int, int]] = []
    monkeypatch.setattr(os, "setpriority", lambda *given: asked.append(given))
    ask_for_niceness(-10)
    assert asked == [(os.PRIO_PROCESS, 0, -10)]


def test_a_denied_niceness_is_logged_with_what_stays(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def deny(*_: int) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", deny)
    monkeypatch.setattr(os, "getpriority", lambda *_: 3)
    with caplog.at_level(logging.INFO):
        ask_for_niceness(-10)
    assert caplog.messages == ["the system does not allow niceness -10; it stays at 3"]
