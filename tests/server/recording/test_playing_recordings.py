import json
import re
from collections import deque
from collections.abc import Callable
from math import ceil
from typing import Any, TypeVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import only, refusal_from
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.pending import Pending, Steps
from openpendant.server.recording import recording_playback
from openpendant.server.recording.recording_playback import Pieces, part_samples
from openpendant.server.recording.recording_service import count_rows
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import MOST_CHUNK_BYTES, DocumentKind, Extent
from openpendant.server.store.recording_format import RowCount, chunks_together, pack_rows
from openpendant.server.store.requests import Answer, LoadChunks, MeasureRecording, Request
from openpendant.server.store.store_errors import NotFound, StoreError
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import Management, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

COLUMNS = ("t", *(f"j{number}" for number in range(1, 7)))
STOP_PROGRAM = messages.MotionControlAction.PROGRAM_STOP
PLAY = b'{"op": "recordings.play", "name": "arc"}'

at_each_step = pytest.mark.parametrize("answered", range(4))
"""The description, the extent, the samples, the description again: what has come by then."""


@pytest.fixture
def bare() -> EmulatedCell:
    made = EmulatedCell(has_surroundings=True)
    made.wait(100)
    return made


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


@pytest.fixture
def cell(bare: EmulatedCell) -> EmulatedCell:
    _keep(bare, robot="ur5")
    return bare


def _loading(cell: EmulatedCell, answered: int) -> Pendant:
    holder = cell.holder()
    cell.held = deque()
    holder.send(Management(holder._next(), PLAY))
    cell.answer(answered)
    return holder


MODES = (OperatingMode.MANUAL_REDUCED, OperatingMode.AUTOMATIC)

Stop = Callable[[EmulatedCell, Pendant], list[object]]

STOPS: dict[str, tuple[Stop, V]] = {
    "stop": (lambda _, holder: [holder.stop(), holder.reset()], V.STOPPED),
    "another's stop": (lambda cell, holder: [cell.pendant().stop(), holder.reset()], V.STOPPED),
    "mode": (lambda _, holder: [holder.mode(mode) for mode in MODES], V.MODE_CHANGED),
    "release": (lambda _, holder: [holder.release(), holder.take()], V.AUTHORITY_LOST),
    "take-over": (lambda cell, it: [it.release(), cell.pendant().take()], V.AUTHORITY_LOST),
    "program stop": (lambda _, holder: [holder.control(STOP_PROGRAM)], V.PROGRAM_STOPPED),
    "ROS-I STOP": (lambda cell, _: [cell.ros().point(-4, *cell.position)], V.STOPPED),
}


@at_each_step
@pytest.mark.parametrize(("stop", "code"), STOPS.values(), ids=STOPS)
def test_what_is_loaded_is_refused_at_once_and_does_not_begin_afterwards(
    cell: EmulatedCell, answered: int, stop: Stop, code: V
) -> None:
    holder = _loading(cell, answered)
    stood = cell.position
    assert set(stop(cell, holder)) <= {V.ACCEPTED, ReplyCode.SUCCESS}
    (told,) = holder.answers()
    assert told["code"] == code
    cell.answer_all()
    cell.wait(500)
    assert holder.answers() == [told]
    assert (cell.core.cell.activity, cell.position) == (messages.Activity.IDLE, stood)


def test_a_pendant_that_is_gone_leaves_nothing_that_begins(cell: EmulatedCell) -> None:
    holder = _loading(cell, 2)
    stood = cell.position
    holder.close()
    cell.answer_all()
    cell.wait(500)
    assert cell.position == stood


@at_each_step
def test_a_speed_override_of_0_ends_what_is_loaded_and_raised_again_begins_nothing(
    cell: EmulatedCell, answered: int
) -> None:
    holder = _loading(cell, answered)
    stood = cell.position
    for override in (0.0, 1.0):
        assert holder.speed(override, 0.0) is V.ACCEPTED
        cell.wait(10)
    (told,) = holder.answers()
    assert "code" in told
    cell.answer_all()
    cell.wait(500)
    assert cell.position == stood


def test_a_program_stop_of_whoever_is_not_in_control_ends_nothing(cell: EmulatedCell) -> None:
    holder = _loading(cell, 1)
    other = cell.pendant("other")
    assert other.control(STOP_PROGRAM) is V.HELD_BY_OTHER
    cell.answer_all()
    assert "code" not in holder.answers()[0]


def test_a_second_recording_is_refused_while_one_is_loaded(cell: EmulatedCell) -> None:
    holder = _loading(cell, 1)
    holder.send(Management(holder._next(), PLAY))
    (told,) = holder.answers()
    assert (told["code"], told["text"]) == (V.PLANNING, "'arc' is being loaded to be played")
    cell.answer_all()
    assert ["code" in each for each in holder.answers()] == [True, False]


def test_what_was_made_anew_under_its_name_meanwhile_is_not_played(cell: EmulatedCell) -> None:
    holder = _loading(cell, 2)
    kind = DocumentKind.RECORDING
    body = cell.store.load(kind, "arc").body
    cell.store.delete(kind, "arc", expected_revision=1, author="bob")
    cell.store.save(kind, "arc", body, expected_revision=0, author="bob")
    cell.answer_all()
    (told,) = holder.answers()
    assert told["code"] == V.REVISION_CONFLICT


T = TypeVar("T")

EIGHT = (*COLUMNS, "j7")
WIDTH = len(EIGHT)
ROW_BYTES = 8 * WIDTH


def _chunk(begins: float, rows: int) -> bytes:
    """Return rows 10 ms apart."""
    return pack_rows((begins + 0.01 * n, *[0.0] * (WIDTH - 1)) for n in range(rows))


def _recording(rows_in_chunk: int, chunks: int) -> list[bytes]:
    return [_chunk(0.01 * rows_in_chunk * n, rows_in_chunk) for n in range(chunks)]


@pytest.fixture(scope="module")
def too_large() -> list[bytes]:
    rows = np.zeros((16_384 * 65, WIDTH), "<f8")
    rows[:, 0] = 0.01 * np.arange(len(rows))
    return [part.tobytes() for part in np.split(rows, 65)]


class Kept:
    def __init__(self, chunks: list[bytes], error: StoreError | None = None) -> None:
        self.chunks = chunks
        self.error = error
        self.answered: list[int] = []

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        return tuple(self.chunks[first : first + most])

    def _answer(self, request: Request) -> Answer:
        if self.error is not None:
            return self.error
        if isinstance(request, MeasureRecording):
            return Extent(len(self.chunks), sum(map(len, self.chunks)))
        assert isinstance(request, LoadChunks)
        # Has what is used of it.
        answer = chunks_together(self, request.name, request.first, request.most)  # type: ignore[arg-type]
        self.answered.append(sum(map(len, answer)))
        return answer

    def load(self, begins: float = 0.0, ends: float | None = None) -> Pieces | Refusal:
        return self.run(part_samples("arc", WIDTH, begins, ends))

    def run(self, steps: Steps[T]) -> T:
        answer: Answer | None = None
        while True:
            try:
                request = steps.send(answer)
            except StopIteration as end:
                told: T = end.value
                return told
            assert isinstance(request, MeasureRecording | LoadChunks)
            answer = self._answer(request)


CHUNKINGS = [(51, 700), (16_384, 5), (12_000, 5)]
"""Rows of a chunk, and chunks: as recorded, as imported, and what does not divide a portion."""


@pytest.mark.parametrize(("rows", "chunks"), CHUNKINGS)
def test_no_answer_and_no_piece_is_larger_than_one_chunk_may_be(rows: int, chunks: int) -> None:
    kept = Kept(_recording(rows, chunks))
    pieces = kept.load()
    assert not isinstance(pieces, Refusal)
    assert b"".join(pieces) == b"".join(kept.chunks)
    assert max(map(len, pieces)) <= MOST_CHUNK_BYTES
    assert max(kept.answered) <= MOST_CHUNK_BYTES
    assert len(kept.answered) <= 2 * ceil(sum(kept.answered) / MOST_CHUNK_BYTES) + chunks // 128


def test_what_is_counted_comes_in_portions_too() -> None:
    kept = Kept(_recording(16_384, 5))
    kept.run(count_rows("arc", EIGHT))
    assert max(kept.answered) <= MOST_CHUNK_BYTES


def test_of_a_part_no_more_than_its_chunks_are_kept_and_nothing_behind_it_is_read() -> None:
    kept = Kept(_recording(100, 1_000))
    pieces = kept.load(begins=2.5, ends=4.5)
    assert not isinstance(pieces, Refusal)
    assert b"".join(pieces) == b"".join(kept.chunks[2:5])
    assert sum(kept.answered) <= MOST_CHUNK_BYTES


def test_a_whole_that_is_too_large_is_refused_before_any_is_loaded(too_large: list[bytes]) -> None:
    kept = Kept(too_large)
    refused = refusal_from(kept.load())
    assert (refused.code, refused.value) == (V.TOO_LARGE, 65 << 20)
    assert "begins and ends" in refused.text
    assert kept.answered == []


@pytest.mark.parametrize("load", [lambda kept: kept.load(1.0), lambda kept: kept.load(0.0, 1e6)])
def test_a_part_that_is_too_large_is_refused_as_soon_as_that_is_known(
    load: Callable[[Kept], Pieces | Refusal],
    too_large: list[bytes],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(recording_playback, "MOST_PLAYED_BYTES", 3 << 20)
    kept = Kept(too_large[:20])
    assert refusal_from(load(kept)).code is V.TOO_LARGE
    assert sum(kept.answered) == 4 << 20


def test_a_part_of_what_is_too_large_as_a_whole_is_played(too_large: list[bytes]) -> None:
    kept = Kept(too_large)
    pieces = kept.load(begins=600.0, ends=610.0)
    assert not isinstance(pieces, Refusal)
    assert sum(map(len, pieces)) == MOST_CHUNK_BYTES


@pytest.mark.parametrize("read", [Kept.load, lambda kept: kept.run(count_rows("arc", EIGHT))])
def test_a_chunk_of_half_rows_is_refused_with_its_size(read: Callable[[Kept], object]) -> None:
    refused = refusal_from(read(Kept([bytes(3 * ROW_BYTES), bytes(ROW_BYTES + 4)])))
    assert refused.code is V.BAD_DOCUMENT
    assert f"{ROW_BYTES + 4} bytes" in refused.text


MARKED = ("t", "j1", "gap")
rows = st.lists(st.tuples(st.floats(0.001, 1.0), st.booleans()), max_size=60).map(
    lambda steps: [
        (sum(step for step, _ in steps[: n + 1]), 0.0, float(marked))
        for n, (_, marked) in enumerate(steps)
    ]
)


def test_rate_and_longest_gap_leave_the_time_in_gaps_out() -> None:
    count = RowCount()
    for time, after_gap in ((1.0, True), (1.1, False), (1.9, True), (2.0, False), (2.4, True)):
        count.take(time, after_gap=after_gap)
    assert (count.rows, count.gaps) == (5, 2)
    assert count.duration == pytest.approx(1.4)
    assert count.longest_gap == pytest.approx(0.8)
    assert count.rate == pytest.approx(10.0)


@pytest.mark.parametrize("times", [(), (0.0,), (0.0, 0.0)])
def test_too_few_rows_have_no_rate(times: tuple[float, ...]) -> None:
    count = RowCount()
    for time in times:
        count.take(time)
    assert count.rate == 0.0


@given(rows, st.integers(1, 7))
def test_chunks_are_counted_as_rows_are(kept: list[tuple[float, float, float]], most: int) -> None:
    wanted = RowCount()
    for time, _, mark in kept:
        wanted.take(time, after_gap=mark != 0.0)
    chunks = [pack_rows(kept[n : n + most]) for n in range(0, len(kept), most)]
    assert Kept(chunks).run(count_rows("arc", MARKED)) == wanted


def test_a_recording_without_marks_has_no_gaps() -> None:
    kept = Kept([pack_rows([(0.0, 1.0), (9.0, 1.0)])])
    assert kept.run(count_rows("arc", ("t", "j1"))) == RowCount(rows=2, last=9.0)


def test_what_the_store_cannot_is_told() -> None:
    kept = Kept([], NotFound("recording", "arc"))
    assert refusal_from(kept.run(count_rows("arc", MARKED))).code is V.NOT_FOUND


def test_nothing_is_told_of_what_was_dropped() -> None:
    pending, told = Pending(), []

    def take(pieces: Pieces | Refusal, now: int) -> list[Effect]:
        told.append(pieces)
        return []

    steps = part_samples("arc", WIDTH, 0.0, None)
    asked = only(Ask, pending.run(steps, take, 0))
    pending.drop(steps)
    assert pending.resume(asked, Extent(1, 3 * ROW_BYTES), 0) == []
    assert told == []


TO_J5 = COLUMNS[1:6]


def test_playing_needs_the_motion_authority(cell: EmulatedCell) -> None:
    told = cell.pendant().ask("recordings.play", name="arc")
    assert told["code"] == V.NOT_IN_CONTROL


def test_a_recording_that_was_cut_off_is_played_as_far_as_it_goes(bare: EmulatedCell) -> None:
    _keep(bare, robot="ur5", finished=False)
    told = bare.holder().ask("recordings.play", name="arc")
    assert (told["samples"], told["recorded"]) == (201, pytest.approx(2.0))


@pytest.mark.parametrize(
    ("about", "code", "why"),
    [
        ({}, V.RECORDING_WRONG_ROBOT, r"of which robot it is; this robot is 'ur5'.*--robot ur5"),
        ({"robot": "ur10"}, V.RECORDING_WRONG_ROBOT, r"was made with 'ur10'; this robot is 'ur5'"),
        ({"columns": ["t", *TO_J5, "temperature"]}, V.BAD_DOCUMENT, r"columns\[6\]: is 'temp"),
        ({"columns": ["t", *TO_J5, "j5"]}, V.BAD_DOCUMENT, r"columns\[6\]: is 'j5' once more"),
        ({"columns": ["j6", *TO_J5, "t"]}, V.BAD_DOCUMENT, r"\[0\]: is 'j6'; accepted: 't' first"),
    ],
    ids=["of none", "of another", "no joint", "a joint twice", "no time first"],
)
def test_a_recording_of_another_robot_or_of_other_columns_is_refused(
    bare: EmulatedCell, about: dict[str, Any], code: V, why: str
) -> None:
    if "columns" in about:
        about = about | {"robot": "ur5"}
    _keep(bare, **about)
    told = bare.holder().ask("recordings.play", name="arc")
    assert told["code"] == code
    assert re.search(why, told["text"])


def test_joints_in_another_order_are_played_as_they_are_named(bare: EmulatedCell) -> None:
    _keep(bare, robot="ur5", columns=["t", "j6", "j2", "gap", "j1", "j4", "j5", "j3"])
    told = bare.holder().ask("recordings.play", name="arc")
    assert told["approach"] == 0.0  # the robot stands at the first sample


def test_a_recording_under_way_is_not_played_and_that_is_said(bare: EmulatedCell) -> None:
    holder = bare.holder()
    holder.ask("recordings.start", name="arc")
    told = holder.ask("recordings.play", name="arc")
    assert told["code"] == V.RECORDING_RUNNING
    assert told["text"].startswith("'arc' is still being recorded")
