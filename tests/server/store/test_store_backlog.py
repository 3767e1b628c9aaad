from __future__ import annotations

import threading
from pathlib import Path

import pytest
from rigs.data.stored_documents import ANN

from openpendant.server.store import store_client as writer_module
from openpendant.server.store.documents import DocumentKind, Heading
from openpendant.server.store.requests import Answer, Save
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.store.store_client import StoreWriter


def test_bytes_that_the_disk_took_make_room_for_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, "MOST_WAITING_BYTES", 5_000)
    writer = StoreWriter(lambda: open_store(tmp_path / "store.db"), lambda call: call())
    body = f'{{"text": "{"x" * 3_000}"}}'
    for number in range(4):
        told = threading.Event()
        answers: list[Answer] = []

        def take(
            answer: Answer, answers: list[Answer] = answers, told: threading.Event = told
        ) -> None:
            answers.append(answer)
            told.set()

        writer.submit(Save(DocumentKind.PROGRAM, f"p{number}", body, 0, ANN), take)
        assert told.wait(10)
        assert isinstance(answers[0], Heading)
    assert writer.close()
