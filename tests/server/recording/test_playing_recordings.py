from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import (
    Activity,
    Management,
    MotionControl,
    MotionControlAction,
    OperatingMode,
    SetMode,
    SetSpeed,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

COLUMNS = ["t", *(f"j{number}" for number in range(1, 7))]
PLAY = b'{"op": "recordings.play", "name": "arc"}'

at_each_step = pytest.mark.parametrize("answered", range(4))
"""The description, the extent, the samples, the description again: what has come by then."""


class SlowCell(EmulatedCell):
    def __init__(self) -> None:
        self.held: list[Ask] | None = None
        super().__init__(has_surroundings=True)

    def _run(self, asked: Ask) -> None:
        if self.held is None:
            super()._run(asked)
        else:
            self.held.append(asked)

    def answer(self, requests: int) -> None:
        for _ in range(requests):
            assert self.held
            super()._run(self.held.pop(0))

    def answer_all(self) -> None:
        held, self.held = self.held or [], None
        for asked in held:
            super()._run(asked)

    def played(self, pendant: Pendant) -> list[dict[str, Any]]:
        return [
            {"done": each.reply_code == ReplyCode.SUCCESS} | json.loads(each.body)
            for each in pendant.all(Management)
        ]


@pytest.fixture
def cell() -> Iterator[SlowCell]:
    made = SlowCell()
    made.wait(100)
    body = json.dumps({"columns": COLUMNS, "robot": "ur5"})
    made.store.save(DocumentKind.RECORDING, "arc", body, expected_revision=0, author="ann")
    first, *others = made.position
    rows = [(0.01 * n, first + 0.001 * n, *others) for n in range(201)]
    made.store.append_chunk("arc", 0, pack_rows(rows))
    yield made
    made.store.close()


def _number(pendant: Pendant) -> int:
    pendant.last_request += 1
    return pendant.last_request


def _loading(cell: SlowCell, answered: int) -> Pendant:
    holder = cell.holder()
    cell.held = []
    holder.send(Management(_number(holder), PLAY))
    cell.answer(answered)
    return holder


def _stop(cell: SlowCell, holder: Pendant) -> None:
    assert holder.stop() is V.ACCEPTED
    assert holder.reset() is V.ACCEPTED


def _stop_by_another(cell: SlowCell, holder: Pendant) -> None:
    assert cell.pendant("passer-by").stop() is V.ACCEPTED
    assert holder.reset() is V.ACCEPTED


def _change_mode(cell: SlowCell, holder: Pendant) -> None:
    for mode in (OperatingMode.MANUAL_REDUCED, OperatingMode.AUTOMATIC):
        assert holder.code(SetMode(_number(holder), mode)) is V.ACCEPTED


def _release(cell: SlowCell, holder: Pendant) -> None:
    assert holder.release() is V.ACCEPTED
    assert holder.take() is V.ACCEPTED


def _take_over(cell: SlowCell, holder: Pendant) -> None:
    assert holder.release() is V.ACCEPTED
    assert cell.pendant("other").take() is V.ACCEPTED


def _program_stop(pendant: Pendant) -> MotionControl:
    return MotionControl(_number(pendant), MotionControlAction.PROGRAM_STOP)


def _stop_program(cell: SlowCell, holder: Pendant) -> None:
    assert holder.code(_program_stop(holder)) is V.ACCEPTED


def _stop_over_ros(cell: SlowCell, holder: Pendant) -> None:
    cell.ros().point(-4, *cell.position)


STOPS = [
    (_stop, V.STOPPED),
    (_stop_by_another, V.STOPPED),
    (_change_mode, V.MODE_CHANGED),
    (_release, V.AUTHORITY_LOST),
    (_take_over, V.AUTHORITY_LOST),
    (_stop_program, V.PROGRAM_STOPPED),
    (_stop_over_ros, V.STOPPED),
]


@at_each_step
@pytest.mark.parametrize(("stop", "code"), STOPS)
def test_what_is_loaded_is_refused_at_once_and_does_not_begin_afterwards(
    cell: SlowCell, answered: int, stop: Callable[[SlowCell, Pendant], None], code: V
) -> None:
    holder = _loading(cell, answered)
    stood = cell.position
    stop(cell, holder)
    (told,) = cell.played(holder)
    assert (told["done"], told["code"]) == (False, code)
    cell.answer_all()
    cell.wait(500)
    assert cell.played(holder) == [told]
    assert cell.core.cell.activity is Activity.IDLE
    assert cell.position == stood


def test_a_pendant_that_is_gone_leaves_nothing_that_begins(cell: SlowCell) -> None:
    holder = _loading(cell, 2)
    stood = cell.position
    holder.close()
    cell.answer_all()
    cell.wait(500)
    assert cell.position == stood


@at_each_step
def test_a_speed_override_of_0_ends_what_is_loaded_and_raised_again_begins_nothing(
    cell: SlowCell, answered: int
) -> None:
    holder = _loading(cell, answered)
    stood = cell.position
    for override in (0.0, 1.0):
        assert holder.code(SetSpeed(_number(holder), override, 0.25)) is V.ACCEPTED
        cell.wait(10)
    (told,) = cell.played(holder)
    assert not told["done"]
    cell.answer_all()
    cell.wait(500)
    assert cell.position == stood


def test_a_program_stop_of_whoever_is_not_in_control_ends_nothing(cell: SlowCell) -> None:
    holder = _loading(cell, 1)
    other = cell.pendant("other")
    assert other.code(_program_stop(other)) is V.HELD_BY_OTHER
    cell.answer_all()
    assert cell.played(holder)[0]["done"]


def test_a_second_recording_is_refused_while_one_is_loaded(cell: SlowCell) -> None:
    holder = _loading(cell, 1)
    holder.send(Management(_number(holder), PLAY))
    (told,) = cell.played(holder)
    assert (told["code"], told["text"]) == (V.PLANNING, "'arc' is being loaded to be played")
    cell.answer_all()
    assert [each["done"] for each in cell.played(holder)] == [False, True]


def test_what_was_made_anew_under_its_name_meanwhile_is_not_played(cell: SlowCell) -> None:
    holder = _loading(cell, 2)
    kind = DocumentKind.RECORDING
    body = cell.store.load(kind, "arc").body
    cell.store.delete(kind, "arc", expected_revision=1, author="bob")
    cell.store.save(kind, "arc", body, expected_revision=0, author="bob")
    cell.answer_all()
    (told,) = cell.played(holder)
    assert (told["done"], told["code"]) == (False, V.REVISION_CONFLICT)
