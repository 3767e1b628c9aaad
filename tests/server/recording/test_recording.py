from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs.cells.recorded_cell import RecordedCell

from openpendant.server.recording import recorder
from openpendant.server.refusal import Refusal
from openpendant.server.store import documents, recording_format
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import RecordingDocument, read_document
from openpendant.server.store.store_errors import DiskFull, StoreBusy, StoreFailed
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[RecordedCell]:
    made = RecordedCell(tmp_path)
    yield made
    made.store.close()


def _ended(cell: RecordedCell) -> RecordingDocument:
    ended = cell.told[-1]
    assert isinstance(ended, RecordingDocument)
    return ended


def _code(result: object) -> V | None:
    return result.code if isinstance(result, Refusal) else None


def test_each_report_is_one_row_however_often_it_is_seen(cell: RecordedCell) -> None:
    cell.start()
    for step in range(5):
        cell.report((0.125 * step, -1.0))
    cell.stop()
    assert cell.rows() == [(round(0.01 * n, 2), 0.125 * n, -1.0, 0.0) for n in range(5)]


def test_a_minute_at_250_reports_a_second_loses_none(cell: RecordedCell) -> None:
    cell.start()
    for step in range(15_000):
        cell.report((step / 15_000, 0.0), after_ms=4)
    cell.stop()
    document = _ended(cell)
    assert document.samples == 15_000
    assert document.rate == pytest.approx(250.0)
    assert len(cell.rows()) == 15_000


def test_rows_are_on_the_disk_half_a_second_later(cell: RecordedCell) -> None:
    cell.start()
    for _ in range(60):
        cell.report((0.0, 0.0))
    status = cell.recorder.status
    assert status is not None
    assert (status.samples, status.kept) == (60, 51)
    assert len(cell.rows()) == 51


def test_a_gap_is_marked_and_not_filled(cell: RecordedCell) -> None:
    cell.start()
    for after in (10, 10, 400, 10):
        cell.report((0.0, 0.0), after)
    cell.stop()
    assert [row[3] for row in cell.rows()] == [0.0, 0.0, 1.0, 0.0]
    document = _ended(cell)
    assert document.gaps == 1
    assert document.longest_gap == pytest.approx(0.4)
    assert document.rate == pytest.approx(100.0)


def test_a_lost_state_link_is_a_gap(cell: RecordedCell) -> None:
    cell.start()
    cell.report((0.0, 0.0))
    cell.feedback.forget()
    cell.recorder.reported(cell.feedback, cell.now)
    cell.report((0.5, 0.0), 900)
    cell.stop()
    assert [row[3] for row in cell.rows()] == [0.0, 1.0]


def test_the_document_names_robot_joints_and_rate(cell: RecordedCell) -> None:
    cell.start()
    cell.report((0.0, 0.0))
    cell.stop()
    document = _ended(cell)
    assert (document.robot, document.joints) == ("two-joints", ("shoulder", "elbow"))
    assert document.columns == ("t", "j1", "j2", "gap")
    assert document.finished


def test_a_second_recording_is_refused_and_names_the_first(cell: RecordedCell) -> None:
    cell.start("first")
    refused = cell.start("second")
    assert isinstance(refused, Refusal)
    assert refused.code is V.RECORDING_RUNNING
    assert "first" in refused.text


def test_a_name_that_is_taken_is_refused(cell: RecordedCell) -> None:
    cell.start()
    cell.stop()
    cell.start()
    assert _code(cell.told[-1]) is V.REVISION_CONFLICT
    assert cell.recorder.status is None


def test_nothing_to_stop_is_refused(cell: RecordedCell) -> None:
    assert _code(cell.stop()) is V.NOT_RECORDING


def test_a_stop_after_the_end_is_told_why_it_ended(cell: RecordedCell) -> None:
    cell.start()
    cell.refuse_with = DiskFull("no room")
    for _ in range(60):
        cell.report((0.0, 0.0))
    assert cell.stop() == cell.lost[0]
    cell.refuse_with = None
    cell.start("bow")
    assert not isinstance(cell.stop(), Refusal)
    assert _code(cell.stop()) is V.NOT_RECORDING


def test_a_disk_that_fills_while_the_last_rows_are_written_is_told_to_all(
    cell: RecordedCell,
) -> None:
    cell.start()
    cell.report((0.0, 0.0))
    cell.refuse_with = DiskFull("no room")
    cell.stop()
    assert cell.told[1:] == cell.lost
    assert _code(cell.lost[0]) is V.DISK_FULL
    assert cell.recorder.status is None


def test_why_it_ended_is_kept_where_there_is_room_again(cell: RecordedCell) -> None:
    cell.start()
    cell.refuse_with = StoreFailed("input/output error")
    cell.answers_at_once = False
    for _ in range(60):
        cell.report((0.0, 0.0))
    cell.answer()
    cell.refuse_with = None
    cell.answer()
    document = read_document("arc", cell.store.load(DocumentKind.RECORDING, "arc").body)
    assert isinstance(document, RecordingDocument)
    assert not document.finished
    assert "input/output error" in document.problem


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of at most 100 rows of two joints."""
    for module in (documents, recording_format):
        monkeypatch.setattr(module, "MOST_CHUNK_BYTES", 100 * 4 * 8)


@pytest.mark.usefixtures("small_chunks")
def test_rows_that_waited_for_a_busy_disk_are_kept_however_many_chunks_they_take(
    cell: RecordedCell,
) -> None:
    cell.start()
    cell.refuse_with = StoreBusy("busy")
    for step in range(500):
        cell.report((step / 500, 0.0))
    cell.refuse_with = None
    cell.report((1.0, 0.0))
    cell.stop()
    assert cell.lost == []
    assert [row[1] for row in cell.rows()] == pytest.approx([n / 500 for n in range(501)])


@pytest.mark.usefixtures("small_chunks")
def test_rows_that_waited_for_a_slow_disk_are_kept_however_many_chunks_they_take(
    cell: RecordedCell,
) -> None:
    cell.start()
    cell.answers_at_once = False
    for step in range(500):
        cell.report((step / 500, 0.0))
    cell.answers_at_once = True
    cell.answer()
    status = cell.recorder.status
    assert status is not None
    assert status.kept >= 450
    cell.stop()
    assert len(cell.rows()) == 500


@pytest.mark.usefixtures("small_chunks")
@pytest.mark.parametrize("answered", [True, False])
def test_all_that_waits_is_written_when_the_server_goes_down(
    cell: RecordedCell, answered: bool
) -> None:
    cell.start()
    cell.answers_at_once = False
    for _ in range(500):
        cell.report((0.0, 0.0))
    if answered:
        cell.answer()
    cell.perform(cell.recorder.flush())
    while cell.asked:
        cell.answer()
    assert len(cell.rows()) == 500


def _stopped_at_a_busy_disk(cell: RecordedCell, is_description: bool) -> None:
    cell.start()
    for _ in range(10):
        cell.report((0.0, 0.0))
    busy = StoreBusy("busy")
    if not is_description:
        cell.refuse_with = busy
        cell.stop()
        return
    cell.answers_at_once = False
    cell.stop()
    cell.answer()
    cell.refuse_with = busy
    cell.answer()
    cell.answers_at_once = True


at_rows_and_description = pytest.mark.parametrize("is_description", [False, True])


@at_rows_and_description
def test_the_end_of_a_recording_waits_for_a_busy_disk(
    cell: RecordedCell, is_description: bool
) -> None:
    _stopped_at_a_busy_disk(cell, is_description)
    for _ in range(2_900):
        cell.tick()
    assert cell.told[1:] == cell.lost == []
    cell.refuse_with = None
    cell.tick()
    assert (_ended(cell).samples, _ended(cell).finished, len(cell.rows())) == (10, True, 10)
    assert cell.recorder.status is None


@at_rows_and_description
def test_a_disk_that_stays_busy_ends_the_recording_half_a_minute_after_the_stop(
    cell: RecordedCell, is_description: bool
) -> None:
    _stopped_at_a_busy_disk(cell, is_description)
    for _ in range(3_001):
        cell.tick()
    (why,) = cell.lost
    assert why.code is V.STORE_BUSY
    assert cell.told[1:] == [why]
    assert cell.recorder.status is None


def test_a_busy_disk_is_asked_one_thing_at_a_time(cell: RecordedCell) -> None:
    _stopped_at_a_busy_disk(cell, is_description=False)
    cell.answers_at_once = False
    for _ in range(3):
        cell.tick()
    assert len(cell.asked) == 1


def test_a_disk_that_never_answers_ends_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "MOST_WAITING_ROWS", 100)
    cell = RecordedCell(tmp_path, answers_at_once=False)
    cell.start()
    cell.answer()
    for _ in range(200):
        cell.report((0.0, 0.0))
    assert cell.recorder.status is None
    assert _code(cell.lost[0]) is V.RECORDING_FELL_BEHIND
    cell.store.close()


def test_a_stop_while_a_chunk_is_under_way_keeps_every_row(tmp_path: Path) -> None:
    cell = RecordedCell(tmp_path, answers_at_once=False)
    cell.start()
    cell.answer()
    for _ in range(70):
        cell.report((0.0, 0.0))
    cell.stop()
    assert cell.told[1:] == []
    while cell.asked:
        cell.answer()
    assert _ended(cell).samples == len(cell.rows()) == 70
    cell.store.close()


@pytest.mark.usefixtures("small_chunks")
def test_all_of_a_recording_that_waits_for_a_busy_disk_is_written_when_the_server_goes_down(
    cell: RecordedCell,
) -> None:
    cell.start()
    cell.answers_at_once = False
    for _ in range(500):
        cell.report((0.0, 0.0))
    cell.stop()
    cell.refuse_with = StoreBusy("busy")
    cell.answer()
    cell.refuse_with = None
    cell.perform(cell.recorder.flush())
    while cell.asked:
        cell.answer()
    assert len(cell.rows()) == 500
    (told,) = cell.told[1:]
    assert isinstance(told, Refusal)
    assert told.code is V.SHUTTING_DOWN
