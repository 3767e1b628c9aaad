from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.server.refusal import Refusal
from openpendant.server.shell import robot_kinematics
from openpendant.server.shell.robot_kinematics import MOST_PAIRS
from openpendant.simplemsg.verdicts import VerdictCode as V

SHAPES_THAT_MOVE = 8  # of a UR5
MOST_BALLS = MOST_PAIRS // SHAPES_THAT_MOVE


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    made.report()
    yield made
    made.store.close()


def ball(number: int) -> dict[str, Any]:
    place = [2.0 + 0.1 * number, 0, 0]
    return {"name": f"b{number}", "shape": {"type": "sphere", "radius": 0.01}, "position": place}


def balls(count: int) -> dict[str, Any]:
    return {"schema": "openpendant-scene/1", "objects": [ball(number) for number in range(count)]}


def test_a_scene_of_too_many_pairs_is_refused_and_the_one_in_force_stays(
    cell: SurroundedCell,
) -> None:
    cell.ask("scene.import", content=balls(MOST_BALLS), expected_revision=0)
    code, text = cell.refused("scene.add", object=ball(MOST_BALLS), expected_revision=1)
    assert code is V.TOO_LARGE
    assert f"{(MOST_BALLS + 1) * SHAPES_THAT_MOVE} pairs" in text
    assert f"{MOST_PAIRS} at most" in text
    assert len(cell.mathematics.scene.objects) == MOST_BALLS
    cell.ask("scene.remove", name="b0", expected_revision=1)


def test_a_program_takes_no_object_that_makes_too_many_pairs(cell: SurroundedCell) -> None:
    cell.ask("scene.import", content=balls(MOST_BALLS), expected_revision=0)
    refused = cell.around.world.carry("b0", robot().home_position, cell.now)
    assert isinstance(refused, Refusal)
    assert refused.code is V.TOO_LARGE
    assert cell.mathematics.scene.get("b0").link is None


@pytest.fixture
def again(
    cell: SurroundedCell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[SurroundedCell]:
    cell.ask("scene.import", content=balls(20), expected_revision=0)
    cell.store.close()
    monkeypatch.setattr(robot_kinematics, "MOST_PAIRS", 100)
    again = SurroundedCell(tmp_path)
    again.report()
    yield again
    again.store.close()


def test_a_stored_scene_that_is_too_large_is_not_in_force_after_a_start_and_that_is_told(
    again: SurroundedCell,
) -> None:
    problems = again.ask("frames.show")["problems"]
    assert "160 pairs" in problems["scene"]
    assert "100 at most" in problems["scene"]
    assert again.mathematics.scene.objects == ()


def test_nothing_moves_by_a_stored_scene_that_is_not_in_force_until_another_is_saved(
    again: SurroundedCell,
) -> None:
    assert "160 pairs" in again.cell.unread
    again.ask("scene.import", content=balls(3), expected_revision=1)
    assert again.cell.unread == ""
    assert again.ask("frames.show")["problems"] == {}


def test_another_tool_needs_no_new_model_of_the_same_scene(
    cell: SurroundedCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell.ask("scene.import", content=balls(2), expected_revision=0)
    built: list[object] = []
    monkeypatch.setattr(robot_kinematics, "CollisionModel", lambda *_, **__: built.append(1))
    cell.ask("tools.add", name="g", tcp={"position": [0, 0, 0.1]}, expected_revision=0)
    cell.ask("tools.select", name="g", expected_revision=1)
    assert not built
    nearest = cell.mathematics.nearest(robot().home_position)
    assert nearest is not None
    assert not nearest.touching


def test_a_tool_is_calibrated_from_twenty_positions_at_most(cell: SurroundedCell) -> None:
    positions = [list(robot().home_position)] * 21
    code, text = cell.refused("tools.calibrate", positions=positions)
    assert code is V.BAD_ARGUMENT
    assert "20" in text
    code, _ = cell.refused("tools.calibrate", positions=positions[:20])
    assert code is V.POOR_GEOMETRY
