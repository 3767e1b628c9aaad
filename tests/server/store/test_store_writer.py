import asyncio
import contextlib
import logging
import sqlite3
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import cast

import pytest
from rigs.data.stored_documents import ANN, opened

from openpendant.server.store import requests
from openpendant.server.store import store_client as writer_module
from openpendant.server.store.documents import Document, DocumentKind, Extent, Heading
from openpendant.server.store.sqlite_store import SqliteStore, open_store
from openpendant.server.store.store_client import StoreWriter
from openpendant.server.store.store_errors import Conflict, NotFound, StoreBusy, StoreFailed

PROGRAM, RECORDING = DocumentKind.PROGRAM, DocumentKind.RECORDING


def at_once(call: Callable[[], None]) -> None:
    call()


@pytest.fixture
def writer(path: Path) -> StoreWriter:
    return StoreWriter(lambda: open_store(path), at_once)


class Stuck:
    """A store whose disk hangs until it is told to go on."""

    def __init__(self, path: Path) -> None:
        self.go_on = threading.Event()
        self._path = path
        self.writer = StoreWriter(self._open, at_once)

    def _open(self) -> SqliteStore:
        self._store = open_store(self._path)
        return cast(SqliteStore, self)

    def __getattr__(self, name: str) -> object:
        assert self.go_on.wait(10)
        return getattr(self._store, name)


def ask(writer: StoreWriter, request: requests.Request) -> requests.Answer:
    answers: SimpleQueue[requests.Answer] = SimpleQueue()
    writer.submit(request, answers.put)
    return answers.get(timeout=10)


def test_every_request_has_its_answer(writer: StoreWriter) -> None:
    saved = ask(writer, requests.Save(PROGRAM, "a", "{}", 0, ANN))
    assert isinstance(saved, Heading)
    loaded = ask(writer, requests.Load(PROGRAM, "a"))
    assert isinstance(loaded, Document)
    assert loaded.heading == saved
    assert ask(writer, requests.ListHeadings()) == (saved,)
    assert ask(writer, requests.ListHistory(PROGRAM, "a")) == (saved,)
    assert isinstance(ask(writer, requests.Delete(PROGRAM, "a", 1, ANN)), Heading)
    assert isinstance(ask(writer, requests.Load(PROGRAM, "a")), NotFound)
    ask(writer, requests.Save(RECORDING, "r", "{}", 0, ANN))
    assert ask(writer, requests.AppendChunk("r", 0, b"abc")) == Extent(1, 3)
    assert ask(writer, requests.LoadChunks("r", 0, 9)) == (b"abc",)
    assert ask(writer, requests.MeasureRecording("r")) == Extent(1, 3)
    assert isinstance(ask(writer, requests.Save(RECORDING, "r", "{}", 0, ANN)), Conflict)
    assert writer.close()


def test_an_answer_comes_after_the_change_can_be_seen_by_others(path: Path) -> None:
    """Promise 22: never an acknowledgement before the commit."""
    open_store(path).close()
    seen: list[int] = []
    with contextlib.closing(sqlite3.connect(path, check_same_thread=False)) as other:

        def look_first(call: Callable[[], None]) -> None:
            seen.append(other.execute("SELECT count(*) FROM revision").fetchone()[0])
            call()

        writer = StoreWriter(lambda: open_store(path), look_first)
        for number in range(5):
            ask(writer, requests.Save(PROGRAM, f"p{number}", "{}", 0, ANN))
        assert writer.close()
    assert seen == [1, 2, 3, 4, 5]


def test_answers_come_on_the_loop_in_the_order_of_the_requests(path: Path) -> None:
    async def run() -> list[tuple[int, str]]:
        loop = asyncio.get_running_loop()
        told: list[tuple[int, str]] = []
        writer = StoreWriter(lambda: open_store(path), loop.call_soon_threadsafe)
        done = asyncio.Event()
        for number in range(20):

            def take(answer: requests.Answer, number: int = number) -> None:
                assert isinstance(answer, Heading)
                told.append((number, threading.current_thread().name))
                if number == 19:
                    done.set()

            writer.submit(requests.Save(PROGRAM, f"p{number}", "{}", 0, ANN), take)
        assert told == []
        await asyncio.wait_for(done.wait(), 10)
        await asyncio.to_thread(writer.close)
        return told

    main = threading.main_thread().name
    assert asyncio.run(run()) == [(number, main) for number in range(20)]


def test_a_store_that_cannot_be_opened_is_told_to_whoever_starts_the_writer(path: Path) -> None:
    with pytest.raises(StoreFailed):
        StoreWriter(lambda: open_store(path.parent), at_once)


@pytest.mark.parametrize(
    ("bound", "value", "says"),
    [("MOST_WAITING", 2, "2 requests wait"), ("MOST_WAITING_BYTES", 10, "10 bytes wait")],
)
def test_more_than_may_wait_is_refused_at_once_and_the_rest_is_done(
    path: Path, monkeypatch: pytest.MonkeyPatch, bound: str, value: int, says: str
) -> None:
    monkeypatch.setattr(writer_module, bound, value)
    stuck = Stuck(path)
    writer = stuck.writer
    answers: list[requests.Answer] = []
    writer.submit(requests.ListHeadings(), answers.append)
    deadline = time.monotonic() + 10
    while writer._waiting and time.monotonic() < deadline:
        time.sleep(0.001)
    for number, body in enumerate(['{"a":1} ', "{}", "{}"]):
        writer.submit(requests.Save(PROGRAM, f"p{number}", body, 0, ANN), answers.append)
    refused = [answer for answer in answers if isinstance(answer, StoreBusy)]
    assert [says in str(answer) for answer in refused] == [True]
    stuck.go_on.set()
    assert writer.close()
    assert len([answer for answer in answers if isinstance(answer, Heading)]) == 2


def test_closing_does_what_waits_and_refuses_what_comes_later(
    path: Path, writer: StoreWriter
) -> None:
    answers: list[requests.Answer] = []
    for number in range(50):
        writer.submit(requests.Save(PROGRAM, f"p{number}", "{}", 0, ANN), answers.append)
    assert writer.close()
    writer.submit(requests.ListHeadings(), answers.append)
    assert [type(answer) for answer in answers] == [Heading] * 50 + [StoreBusy]
    with opened(path) as store:
        assert len(store.headings()) == 50


def test_a_disk_that_hangs_does_not_keep_the_server_from_ending(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(writer_module, "_FAREWELL", 0.01)
    stuck = Stuck(path)
    writer = stuck.writer
    writer.submit(requests.ListHeadings(), lambda _: None)
    assert not writer.close()
    assert "did not take" in caplog.text
    stuck.go_on.set()
    writer._thread.join(10)


def test_an_answer_that_nobody_waits_for_harms_nothing(path: Path) -> None:
    loop = asyncio.new_event_loop()
    writer = StoreWriter(lambda: open_store(path), loop.call_soon_threadsafe)
    loop.close()
    writer.submit(requests.Save(PROGRAM, "a", "{}", 0, ANN), lambda _: None)
    assert writer.close()
    with opened(path) as store:
        assert len(store.headings()) == 1


def test_a_full_disk_is_logged_once_a_time(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Promise 23: the log does not fill."""
    kept: list[SqliteStore] = []

    def open_and_keep() -> SqliteStore:
        kept.append(open_store(path))
        return kept[0]

    writer = StoreWriter(open_and_keep, at_once)
    large = requests.Save(PROGRAM, "a", '{"text": "' + "x" * 100_000 + '"}', 0, ANN)

    def limit(pages: int) -> None:
        """On the writer's thread, whose connection it is."""
        told: SimpleQueue[object] = SimpleQueue()
        say = f"PRAGMA max_page_count = {pages}"
        nothing = requests.ListHistory(PROGRAM, "nothing")
        writer.submit(nothing, lambda _: told.put(kept[0].connection.execute(say)))
        told.get(timeout=10)

    with caplog.at_level(logging.ERROR):
        for _ in range(2):
            limit(10)
            for _ in range(5):
                assert isinstance(ask(writer, large), StoreFailed)
            assert writer.is_failing
            limit(10_000)
            ask(writer, requests.Save(PROGRAM, "b", "{}", 0, ANN))
            assert not isinstance(ask(writer, requests.ListHeadings()), StoreFailed)
    assert len(caplog.records) == 2
    assert writer.close()


def test_a_fault_of_ours_is_told_and_the_next_request_is_served(
    writer: StoreWriter, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(SqliteStore, "headings", lambda *_: 1 // 0)
        answer = ask(writer, requests.ListHeadings())
        assert isinstance(answer, StoreFailed)
        assert "ZeroDivisionError" in str(answer)
    assert ask(writer, requests.ListHeadings()) == ()
    assert writer.close()
    assert "a request to the store failed" in caplog.text


def test_written_bytes_make_room_for_others(
    writer: StoreWriter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, "MOST_WAITING_BYTES", 5_000)
    body = f'{{"text": "{"x" * 3_000}"}}'
    for number in range(4):
        assert isinstance(ask(writer, requests.Save(PROGRAM, f"p{number}", body, 0, ANN)), Heading)
    assert writer.close()
