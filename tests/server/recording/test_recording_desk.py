"""Recordings as pendants ask for them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from surrounded_cell import SurroundedCell, robot

from openpendant.server.store.errors import StoreFailed
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


def test_playing_needs_the_motion_authority(cell: SurroundedCell) -> None:
    _record(cell)
    assert cell.refused("recordings.play", name="arc")[0] is V.NOT_IN_CONTROL


@pytest.mark.parametrize("factor", [0.05, 4.5, float("inf")])
def test_a_factor_out_of_bounds_is_refused(cell: SurroundedCell, factor: float) -> None:
    code, text = cell.refused("recordings.play", name="arc", factor=factor)
    assert code is V.BAD_ARGUMENT
    assert "factor" in text


def test_a_store_that_fails_is_told(cell: SurroundedCell) -> None:
    cell.refuse_with = StoreFailed("no disk")
    assert cell.refused("recordings.start", name="arc")[0] is V.STORE_FAILED


def test_a_recording_that_a_crash_cut_off_counts_its_samples(cell: SurroundedCell) -> None:
    cell.ask("recordings.start", name="arc")
    for _ in range(60):
        cell.report()
    about = cell.ask("recordings.describe", name="arc")
    assert not about["finished"]
    assert about["samples"] == 51
