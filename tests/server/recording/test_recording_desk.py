from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.server.endpoints.pendant.management import snapshot
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows
from openpendant.server.store.store_errors import DiskFull, StoreFailed
from openpendant.simplemsg.pendant import OutcomeKind
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    yield made
    made.store.close()


def _record(cell: SurroundedCell, name: str = "arc", reports: int = 100) -> dict[str, Any]:
    cell.ask("recordings.start", name=name)
    home = robot().home_position
    for step in range(reports):
        cell.report((home[0] + 0.001 * step, *home[1:]))
    return cell.ask("recordings.stop")


def _import(cell: SurroundedCell, about: dict[str, Any], rows: list[tuple[float, ...]]) -> None:
    columns = ["t", *(f"j{number}" for number in range(1, 7))]
    body = json.dumps({"columns": columns} | about)
    cell.store.save(DocumentKind.RECORDING, "csv", body, expected_revision=0, author="ann")
    cell.store.append_chunk("csv", 0, pack_rows(rows))


def _problem_in_snapshot(cell: SurroundedCell) -> str:
    settings = make_settings({}, "test")
    return snapshot(cell.cell, settings, cell.now, cell.around).recording_problem


def test_a_recording_is_begun_ended_and_described(cell: SurroundedCell) -> None:
    assert _record(cell)["samples"] == 100
    about = cell.ask("recordings.describe", name="arc")
    assert (about["robot"], about["samples"], about["revision"]) == ("ur5", 100, 2)
    assert about["joints"] == list(robot().limits.names)
    assert about["rate"] == pytest.approx(100.0)


def test_the_list_shows_the_recording_under_way(cell: SurroundedCell) -> None:
    _record(cell)
    cell.ask("recordings.start", name="bow")
    cell.report()
    listed = cell.ask("recordings.list")
    assert [each["name"] for each in listed["recordings"]] == ["arc", "bow"]
    assert listed["recording"]["name"] == "bow"


def test_a_recording_is_cut_renamed_and_deleted(cell: SurroundedCell) -> None:
    _record(cell)
    cell.ask("recordings.trim", name="arc", new_name="part", begins=0.2, ends=0.4)
    assert cell.ask("recordings.describe", name="part")["samples"] == 21
    cell.ask("recordings.rename", name="part", new_name="bit", expected_revision=2)
    cell.ask("recordings.delete", name="arc", expected_revision=2)
    left = [each["name"] for each in cell.ask("recordings.list")["recordings"]]
    assert left == ["bit"]


def test_what_is_being_recorded_is_neither_deleted_nor_renamed(cell: SurroundedCell) -> None:
    cell.ask("recordings.start", name="arc")
    refused = cell.refused("recordings.delete", name="arc", expected_revision=1)
    assert refused[0] is V.RECORDING_RUNNING


@pytest.mark.parametrize("factor", [0.05, 4.5, float("inf")])
def test_a_factor_out_of_bounds_is_refused(cell: SurroundedCell, factor: float) -> None:
    code, text = cell.refused("recordings.play", name="arc", factor=factor)
    assert code is V.BAD_ARGUMENT
    assert "factor" in text


def test_a_store_that_fails_is_told(cell: SurroundedCell) -> None:
    cell.refuse_with = StoreFailed("no disk")
    assert cell.refused("recordings.start", name="arc")[0] is V.STORE_FAILED


def _crashed(cell: SurroundedCell, folder: Path, reports: int) -> SurroundedCell:
    cell.ask("recordings.start", name="arc")
    home = robot().home_position
    for step in range(reports):
        cell.report((home[0] + 0.001 * step, *home[1:]))
    return SurroundedCell(folder)


def test_of_a_recording_that_a_crash_cut_off_the_rows_are_counted(
    cell: SurroundedCell, tmp_path: Path
) -> None:
    after = _crashed(cell, tmp_path, 154)
    about = after.ask("recordings.describe", name="arc")
    assert not about["finished"]
    assert about["samples"] == 153
    assert about["duration"] == pytest.approx(1.52)
    assert about["rate"] == pytest.approx(100.0)
    assert "the server ended before it was stopped" in about["problem"]
    (line,) = after.ask("recordings.list")["recordings"]
    assert line["duration"] == about["duration"]
    assert line["problem"] == about["problem"]
    after.store.close()


def test_a_recording_under_way_has_no_problem(cell: SurroundedCell) -> None:
    cell.ask("recordings.start", name="arc")
    for _ in range(60):
        cell.report()
    about = cell.ask("recordings.describe", name="arc")
    assert (about["finished"], about["samples"], about["problem"]) == (False, 60, "")
    assert _problem_in_snapshot(cell) == ""
    assert about["duration"] == pytest.approx(0.59)


def test_who_records_hears_of_a_full_disk_by_an_outcome_and_at_the_stop(
    cell: SurroundedCell,
) -> None:
    cell.ask("recordings.start", name="arc")
    for _ in range(60):
        cell.report()
    cell.refuse_with = DiskFull("no room")
    for _ in range(60):
        cell.report()
    (told,) = cell.outcomes
    assert (told.request_id, told.outcome) == (7, OutcomeKind.ABORTED)
    assert told.code == V.DISK_FULL
    assert told.text == "recording 'arc' ended by itself, 51 samples kept: no room"
    assert cell.refused("recordings.stop") == (V.DISK_FULL, told.text)
    cell.refuse_with = None
    assert cell.ask("recordings.list")["problem"] == told.text
    assert _problem_in_snapshot(cell) == told.text
    about = cell.ask("recordings.describe", name="arc")
    assert (about["samples"], about["problem"]) == (51, told.text)


def test_a_damaged_recording_hides_no_other_in_the_list(cell: SurroundedCell) -> None:
    _record(cell)
    cell.store.save(DocumentKind.RECORDING, "bad", "{}", expected_revision=0, author="ann")
    arc, bad = cell.ask("recordings.list")["recordings"]
    assert (arc["samples"], arc["problem"]) == (100, "")
    assert "columns" in bad["problem"]


def test_an_imported_recording_is_counted(cell: SurroundedCell) -> None:
    _import(cell, {"robot": "ur5"}, [(0.1 * n, *robot().home_position) for n in range(11)])
    about = cell.ask("recordings.describe", name="csv")
    assert (about["samples"], about["finished"], about["problem"]) == (11, True, "")
    assert about["duration"] == pytest.approx(1.0)
    assert about["rate"] == pytest.approx(10.0)
