"""Frames and tools that do not fit one answer, told in parts."""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.surrounded_cell import SurroundedCell

from openpendant.motion.frames.frame_file import SCHEMA, frames_to_json
from openpendant.simplemsg.verdicts import VerdictCode as V

TOOLS, FRAMES = 400, 500
LONGEST = "\N{MATHEMATICAL DOUBLE-STRUCK CAPITAL A}" * 60
"""Of a name, but for its number; four bytes a character."""

POSE = {"xyz": [0.123456789012, -0.1, 1 / 3], "quat": [0.0, 0.0, 0.0, 1.0]}


def imported(cell: SurroundedCell, tools: int, frames: int) -> None:
    tool_entries = [{"name": f"{LONGEST}{at:04}"} | POSE for at in range(tools)]
    chosen = tool_entries[0]["name"]
    content = {"schema": SCHEMA, "tools": tool_entries, "selected_tool": chosen}
    cell.ask("tools.import", content=content, expected_revision=0)
    parents = ["base", *(f"{LONGEST[1:]}f{at:04}" for at in range(frames))]
    frame_entries = [{"name": name, "parent": parent} | POSE for parent, name in pairwise(parents)]
    content = {"schema": SCHEMA, "frames": frame_entries}
    cell.ask("frames.import", content=content, expected_revision=0)


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    yield made
    made.store.close()


def parts(cell: SurroundedCell) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    following: int | None = 0
    while following is not None:
        found.append(cell.ask("frames.show", first=following))
        following = found[-1]["next"]
    return found


def joined(found: list[dict[str, Any]], key: str) -> list[Any]:
    return [each for part in found for each in part["content"][key]]


def test_500_frames_and_400_tools_are_told_in_parts(cell: SurroundedCell) -> None:
    imported(cell, TOOLS, FRAMES)
    code, text = cell.refused("frames.show")
    assert code is V.TOO_LARGE
    assert "accepted by a frame: 65468" in text
    found = parts(cell)
    assert len(found) == (TOOLS + FRAMES) // 50
    whole = json.loads(frames_to_json(cell.mathematics.frames))
    assert joined(found, "tools") == whole["tools"]
    assert joined(found, "frames") == whole["frames"]
    for part in found:
        assert part["content"]["selected_tool"] == whole["selected_tool"]
        assert (part["frames_revision"], part["tools_revision"]) == (1, 1)
        assert part["total"] == TOOLS + FRAMES


def test_a_part_holds_tools_and_frames_where_it_spans_both(cell: SurroundedCell) -> None:
    imported(cell, 30, 30)
    first, last = parts(cell)
    assert [len(first["content"][key]) for key in ("tools", "frames")] == [30, 20]
    assert [len(last["content"][key]) for key in ("tools", "frames")] == [0, 10]
    names = [each["name"] for key in ("tools", "frames") for each in first["content"][key]]
    assert first["names"] == names


def test_a_part_behind_the_last_entry_is_refused_with_the_numbers(cell: SurroundedCell) -> None:
    imported(cell, 30, 20)
    assert parts(cell)[-1]["next"] is None
    code, text = cell.refused("frames.show", first=50)
    assert code is V.BAD_ARGUMENT
    assert "50; there are 50 tools and frames" in text


def test_a_cell_without_frames_has_one_empty_part(cell: SurroundedCell) -> None:
    (part,) = parts(cell)
    assert (part["content"]["tools"], part["content"]["frames"]) == ([], [])
    assert (part["names"], part["total"], part["next"]) == ([], 0, None)


def test_what_fits_an_answer_is_told_as_ever(cell: SurroundedCell) -> None:
    assert list(cell.ask("frames.show")) == [
        *("content", "names", "frames_revision", "tools_revision", "problems"),
    ]
