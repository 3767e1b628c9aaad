from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.verdicts import VerdictCode as V

COLUMNS = ["t", *(f"j{number}" for number in range(1, 7))]


@pytest.fixture
def cell() -> Iterator[EmulatedCell]:
    made = EmulatedCell(has_surroundings=True)
    made.wait(100)
    yield made
    made.store.close()


def _keep(cell: EmulatedCell, **about: Any) -> None:
    columns = about.setdefault("columns", COLUMNS)
    body = json.dumps(about)
    cell.store.save(DocumentKind.RECORDING, "arc", body, expected_revision=0, author="ann")
    standing = dict(zip(COLUMNS[1:], cell.position, strict=True))
    rows = []
    for n in range(201):
        values = standing | {"t": 0.01 * n, "j1": standing["j1"] + 0.001 * n}
        rows.append([values.get(column, 0.0) for column in columns])
    cell.store.append_chunk("arc", 0, pack_rows(rows))


def _play(pendant: Pendant) -> tuple[bool, dict[str, Any]]:
    request = Management(70, b'{"op": "recordings.play", "name": "arc"}')
    (reply,) = [each for each in pendant.send(request) if isinstance(each, Management)]
    return reply.reply_code == ReplyCode.SUCCESS, json.loads(reply.body)


def test_playing_needs_the_motion_authority(cell: EmulatedCell) -> None:
    _keep(cell, robot="ur5")
    done, told = _play(cell.pendant())
    assert not done
    assert told["code"] == V.NOT_IN_CONTROL


def test_a_recording_that_was_cut_off_is_played_as_far_as_it_is_kept(cell: EmulatedCell) -> None:
    _keep(cell, robot="ur5", finished=False)
    done, told = _play(cell.holder())
    assert done, told
    assert (told["samples"], told["recorded"]) == (201, pytest.approx(2.0))


@pytest.mark.parametrize(
    ("about", "why"),
    [
        ({}, r"does not say of which robot it is; this robot is 'ur5'.*--robot ur5"),
        ({"robot": "ur10"}, r"was made with 'ur10'; this robot is 'ur5'"),
    ],
)
def test_a_recording_of_another_robot_or_of_none_is_refused(
    cell: EmulatedCell, about: dict[str, Any], why: str
) -> None:
    _keep(cell, **about)
    done, told = _play(cell.holder())
    assert not done
    assert told["code"] == V.RECORDING_WRONG_ROBOT
    assert re.search(why, told["text"])


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        (
            ["t", "j2", "j1", "j3", "j4", "j5", "temperature"],
            r"columns\[6\]: is 'temperature'; acc",
        ),
        (["t", "j1", "j2", "j3", "j4", "j5", "j5"], r"columns\[6\]: is 'j5' once more"),
        (["j6", "j1", "j2", "j3", "j4", "j5", "t"], r"columns\[0\]: is 'j6'; accepted: 't' first"),
    ],
)
def test_columns_that_are_no_joints_are_not_played_as_joints(
    cell: EmulatedCell, columns: list[str], why: str
) -> None:
    _keep(cell, robot="ur5", columns=columns)
    done, told = _play(cell.holder())
    assert (done, told["code"]) == (False, V.BAD_DOCUMENT)
    assert re.search(why, told["text"])


def test_joints_in_another_order_are_played_as_they_are_named(cell: EmulatedCell) -> None:
    _keep(cell, robot="ur5", columns=["t", "j6", "j2", "gap", "j1", "j4", "j5", "j3"])
    done, told = _play(cell.holder())
    assert done, told
    assert told["approach"] == 0.0  # the robot stands at the first sample


def test_a_recording_under_way_is_not_played_and_the_refusal_says_so(cell: EmulatedCell) -> None:
    holder = cell.holder()
    holder.send(Management(69, b'{"op": "recordings.start", "name": "arc"}'))
    done, told = _play(holder)
    assert not done
    assert told["code"] == V.RECORDING_RUNNING
    assert told["text"].startswith("'arc' is still being recorded")
