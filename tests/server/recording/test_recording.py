import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs.cells.expectations import expect, known, only, refusal_from
from rigs.cells.recorded_cell import RecordedCell
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.server.endpoints.pendant.management import snapshot
from openpendant.server.recording import recorder
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.store import documents, recording_format
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import RecordingDocument, pack_rows, read_document
from openpendant.server.store.store_errors import DiskFull, StoreBusy, StoreFailed
from openpendant.simplemsg.pendant import OutcomeKind
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[RecordedCell]:
    made = RecordedCell(tmp_path)
    yield made
    made.store.close()


def _ended(cell: RecordedCell) -> RecordingDocument:
    return expect(RecordingDocument, cell.told[-1])


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
    assert (document.robot, document.joints) == ("two-joints", ("shoulder", "elbow"))
    assert (document.columns, document.finished) == (("t", "j1", "j2", "gap"), True)
    assert document.samples == 15_000
    assert document.rate == pytest.approx(250.0)
    assert len(cell.rows()) == 15_000


def test_rows_are_on_the_disk_half_a_second_later(cell: RecordedCell) -> None:
    cell.start()
    cell.reports(60)
    status = known(cell.recorder.status)
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


def test_a_second_recording_is_refused_and_names_the_first(cell: RecordedCell) -> None:
    cell.start("first")
    refused = refusal_from(cell.start("second"))
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
    cell.reports(60)
    assert cell.stop() == cell.lost[0]
    cell.refuse_with = None
    cell.start("bow")
    assert not isinstance(cell.stop(), Refusal)
    assert _code(cell.stop()) is V.NOT_RECORDING


def test_a_disk_that_fills_as_the_last_rows_are_written_is_told_to_all(cell: RecordedCell) -> None:
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
    cell.reports(60)
    cell.answer()
    cell.refuse_with = None
    cell.answer()
    kept = read_document("arc", cell.store.load(DocumentKind.RECORDING, "arc").body)
    document = expect(RecordingDocument, kept)
    assert not document.finished
    assert "input/output error" in document.problem


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of at most 100 rows of two joints."""
    for module in (documents, recording_format):
        monkeypatch.setattr(module, "MOST_CHUNK_BYTES", 100 * 4 * 8)


@pytest.mark.usefixtures("small_chunks")
@pytest.mark.parametrize("is_busy", [True, False], ids=["busy", "slow"])
def test_rows_that_waited_for_a_disk_are_kept_however_many_chunks_they_take(
    cell: RecordedCell, is_busy: bool
) -> None:
    cell.start()
    cell.refuse_with = StoreBusy("busy") if is_busy else None
    cell.answers_at_once = is_busy
    for step in range(500):
        cell.report((step / 500, 0.0))
    cell.refuse_with, cell.answers_at_once = None, True
    if not is_busy:
        cell.answer()
        assert known(cell.recorder.status).kept >= 450
    cell.report((1.0, 0.0))
    cell.stop()
    assert cell.lost == []
    assert [row[1] for row in cell.rows()] == pytest.approx([n / 500 for n in range(501)])


@pytest.mark.usefixtures("small_chunks")
@pytest.mark.parametrize("answered", [True, False])
def test_all_that_waits_is_written_as_the_server_ends(cell: RecordedCell, answered: bool) -> None:
    cell.start()
    cell.answers_at_once = False
    cell.reports(500)
    if answered:
        cell.answer()
    cell.perform(cell.recorder.flush())
    cell.answer_all()
    assert len(cell.rows()) == 500


def _stopped_at_a_busy_disk(cell: RecordedCell, is_description: bool) -> None:
    cell.start()
    cell.reports(10)
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
def test_the_end_of_a_recording_waits_for_a_disk(cell: RecordedCell, is_description: bool) -> None:
    _stopped_at_a_busy_disk(cell, is_description)
    cell.ticks(2_900)
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
    cell.ticks(3_001)
    (why,) = cell.lost
    assert why.code is V.STORE_BUSY
    assert (cell.told[1:], cell.recorder.status) == ([why], None)


def test_a_busy_disk_is_asked_one_thing_at_a_time(cell: RecordedCell) -> None:
    _stopped_at_a_busy_disk(cell, is_description=False)
    cell.answers_at_once = False
    cell.ticks(3)
    assert len(cell.asked) == 1


def test_a_disk_that_never_answers_ends_the_recording(
    cell: RecordedCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "MOST_WAITING_ROWS", 100)
    cell.start()
    cell.answers_at_once = False
    cell.reports(200)
    assert cell.recorder.status is None
    assert _code(cell.lost[0]) is V.RECORDING_FELL_BEHIND


def test_a_stop_while_a_chunk_is_under_way_keeps_every_row(cell: RecordedCell) -> None:
    cell.start()
    cell.answers_at_once = False
    cell.reports(70)
    cell.stop()
    assert cell.told[1:] == []
    cell.answer_all()
    assert _ended(cell).samples == len(cell.rows()) == 70


@pytest.mark.usefixtures("small_chunks")
def test_all_of_a_recording_that_waits_for_a_busy_disk_is_written_when_the_server_goes_down(
    cell: RecordedCell,
) -> None:
    cell.start()
    cell.answers_at_once = False
    cell.reports(500)
    cell.stop()
    cell.refuse_with = StoreBusy("busy")
    cell.answer()
    cell.refuse_with = None
    cell.perform(cell.recorder.flush())
    cell.answer_all()
    assert len(cell.rows()) == 500
    told = only(Refusal, cell.told[1:])
    assert told.code is V.SHUTTING_DOWN


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    yield made
    made.store.close()


def _record(desk: SurroundedCell, reports: int = 100) -> None:
    desk.ask("recordings.start", name="arc")
    home = robot().home_position
    for step in range(reports):
        desk.report((home[0] + 0.001 * step, *home[1:]))


def _problem_in_snapshot(desk: SurroundedCell) -> str:
    settings = make_settings({}, "test")
    return snapshot(desk.cell, settings, desk.now, desk.around).recording_problem


def test_a_recording_is_begun_ended_and_described(desk: SurroundedCell) -> None:
    _record(desk)
    assert desk.ask("recordings.stop")["samples"] == 100
    about = desk.ask("recordings.describe", name="arc")
    assert (about["robot"], about["samples"], about["revision"]) == ("ur5", 100, 2)
    assert about["joints"] == list(robot().limits.names)
    assert about["rate"] == pytest.approx(100.0)


def test_the_list_shows_the_recording_under_way(desk: SurroundedCell) -> None:
    _record(desk)
    desk.ask("recordings.stop")
    desk.ask("recordings.start", name="bow")
    desk.report()
    listed = desk.ask("recordings.list")
    assert [each["name"] for each in listed["recordings"]] == ["arc", "bow"]
    assert listed["recording"]["name"] == "bow"


def test_a_recording_is_cut_renamed_and_deleted(desk: SurroundedCell) -> None:
    _record(desk)
    desk.ask("recordings.stop")
    desk.ask("recordings.trim", name="arc", new_name="part", begins=0.2, ends=0.4)
    assert desk.ask("recordings.describe", name="part")["samples"] == 21
    desk.ask("recordings.rename", name="part", new_name="bit", expected_revision=2)
    desk.ask("recordings.delete", name="arc", expected_revision=2)
    left = [each["name"] for each in desk.ask("recordings.list")["recordings"]]
    assert left == ["bit"]


def test_what_is_being_recorded_is_neither_deleted_nor_renamed(desk: SurroundedCell) -> None:
    desk.ask("recordings.start", name="arc")
    refused = desk.refused("recordings.delete", name="arc", expected_revision=1)
    assert refused[0] is V.RECORDING_RUNNING


@pytest.mark.parametrize("factor", [0.05, 4.5, float("inf")])
def test_a_factor_out_of_bounds_is_refused(desk: SurroundedCell, factor: float) -> None:
    code, text = desk.refused("recordings.play", name="arc", factor=factor)
    assert code is V.BAD_ARGUMENT
    assert "factor" in text


def test_a_store_that_fails_is_told(desk: SurroundedCell) -> None:
    desk.refuse_with = StoreFailed("no disk")
    assert desk.refused("recordings.start", name="arc")[0] is V.STORE_FAILED


def test_the_rows_of_what_a_crash_cut_off_are_counted(desk: SurroundedCell, tmp_path: Path) -> None:
    _record(desk, 154)
    after = SurroundedCell(tmp_path)
    about = after.ask("recordings.describe", name="arc")
    assert not about["finished"]
    assert about["samples"] == 153
    assert about["duration"] == pytest.approx(1.52)
    assert about["rate"] == pytest.approx(100.0)
    assert "the server ended before it was stopped" in about["problem"]
    (line,) = after.ask("recordings.list")["recordings"]
    assert (line["duration"], line["problem"]) == (about["duration"], about["problem"])
    after.store.close()


def test_a_recording_under_way_has_no_problem(desk: SurroundedCell) -> None:
    desk.ask("recordings.start", name="arc")
    desk.reports(60)
    about = desk.ask("recordings.describe", name="arc")
    assert (about["finished"], about["samples"], about["problem"]) == (False, 60, "")
    assert _problem_in_snapshot(desk) == ""
    assert about["duration"] == pytest.approx(0.59)


def test_who_records_hears_of_a_full_disk_by_an_outcome_and_at_a_stop(desk: SurroundedCell) -> None:
    desk.ask("recordings.start", name="arc")
    desk.reports(60)
    desk.refuse_with = DiskFull("no room")
    desk.reports(60)
    (told,) = desk.outcomes
    assert (told.request_id, told.outcome) == (7, OutcomeKind.ABORTED)
    assert told.code == V.DISK_FULL
    assert told.text == "recording 'arc' ended by itself, 51 samples kept: no room"
    assert desk.refused("recordings.stop") == (V.DISK_FULL, told.text)
    desk.refuse_with = None
    assert desk.ask("recordings.list")["problem"] == told.text
    assert _problem_in_snapshot(desk) == told.text
    about = desk.ask("recordings.describe", name="arc")
    assert (about["samples"], about["problem"]) == (51, told.text)


def test_a_damaged_recording_hides_no_other_in_the_list(desk: SurroundedCell) -> None:
    _record(desk)
    desk.ask("recordings.stop")
    desk.store.save(DocumentKind.RECORDING, "bad", "{}", expected_revision=0, author="ann")
    arc, bad = desk.ask("recordings.list")["recordings"]
    assert (arc["samples"], arc["problem"]) == (100, "")
    assert "columns" in bad["problem"]


def test_an_imported_recording_is_counted(desk: SurroundedCell) -> None:
    body = json.dumps({"columns": ["t", "j1", "j2", "j3", "j4", "j5", "j6"], "robot": "ur5"})
    desk.store.save(DocumentKind.RECORDING, "csv", body, expected_revision=0, author="ann")
    rows = [(0.1 * n, *robot().home_position) for n in range(11)]
    desk.store.append_chunk("csv", 0, pack_rows(rows))
    about = desk.ask("recordings.describe", name="csv")
    assert (about["samples"], about["finished"], about["problem"]) == (11, True, "")
    assert about["duration"] == pytest.approx(1.0)
    assert about["rate"] == pytest.approx(10.0)
