"""The planning process: one that cannot be started is tried again."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import pytest

from openpendant.server.planning import process as planning_process
from openpendant.server.planning.process import PlanningProcess


def test_a_process_that_cannot_be_started_is_logged_and_tried_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    attempts = 0

    async def refuse(*_: Any, **__: Any) -> None:
        nonlocal attempts
        attempts += 1
        if attempts == 3:
            raise asyncio.CancelledError
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(asyncio, "create_subprocess_exec", refuse)
    monkeypatch.setattr(planning_process, "_RESTART_PAUSE", 0.001)
    with caplog.at_level(logging.ERROR), pytest.raises(asyncio.CancelledError):
        asyncio.run(PlanningProcess(["ur5"], lambda: None).keep_up())
    assert [record.levelname for record in caplog.records] == ["ERROR", "ERROR"]
    assert "temporarily unavailable" in caplog.text
