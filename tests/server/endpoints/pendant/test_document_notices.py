"""Change notices: each acknowledged change reaches everybody of the cell who wants to know."""

import json
from collections import deque
from itertools import count
from typing import Any

import pytest
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import only
from rigs.cells.server_rig import MS
from rigs.peers.server_clients import Pendant

from openpendant.server.endpoints.pendant.document_notices import SIGNALS_PERIOD_NS
from openpendant.server.environment import CellEnvironment
from openpendant.server.events.effects import Effect, Notify
from openpendant.server.events.events import NoticesMissed, Tick
from openpendant.server.store.requests import Delete
from openpendant.server.store.store_errors import StoreBusy
from openpendant.simplemsg.pendant import (
    Change,
    Declare,
    DocumentChanged,
    Management,
    NoticeKind,
    Notices,
)

BOX = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [9, 9, 9]}
POSE = {"position": [0.1, 0.2, 0.3]}


@pytest.fixture
def cell() -> EmulatedCell:
    cell = EmulatedCell(has_surroundings=True, controller={"signals": "openpendant"})
    cell.wait(50)
    return cell


def wanting(cell: EmulatedCell, name: str = "watcher") -> Pendant:
    pendant = cell.pendant(name)
    pendant.send(Declare(1, 0.0, Notices.WANTED, "en"))
    pendant.got.clear()
    return pendant


def told(pendant: Pendant) -> list[tuple[NoticeKind, Change, int, str, str, int, str]]:
    return [
        (
            NoticeKind(each.kind),
            Change(each.what),
            each.revision,
            each.name,
            each.from_name,
            each.session,
            each.client,
        )
        for each in pendant.all(DocumentChanged)
        if each.kind != NoticeKind.SIGNALS
    ]


def asked(cell: EmulatedCell, pendant: Pendant, op: str, **fields: Any) -> dict[str, Any]:
    before = len(pendant.answers())
    pendant.send(_request(op, fields))
    for _ in range(100):
        if len(pendant.answers()) > before:
            break
        cell.wait(10)
    answer = pendant.answers()[-1]
    assert "code" not in answer, answer
    return answer


_numbers = count(100)


def _request(op: str, fields: dict[str, Any]) -> Management:
    return Management(next(_numbers), json.dumps({"op": op, **fields}).encode())


CHANGES: dict[str, tuple[str, dict[str, Any], tuple[Any, ...]]] = {
    "a program is made": (
        "programs.create",
        {"name": "new"},
        (NoticeKind.PROGRAM, Change.NEW, 1, "new", ""),
    ),
    "a program is saved": (
        "programs.edit",
        {
            "name": "main",
            "edit": {"edit": "describe", "comment": "better"},
            "expected_revision": 1,
        },
        (NoticeKind.PROGRAM, Change.CHANGED, 2, "main", ""),
    ),
    "a program is renamed": (
        "programs.rename",
        {"name": "main", "new_name": "first", "expected_revision": 1},
        (NoticeKind.PROGRAM, Change.RENAMED, 1, "first", "main"),
    ),
    "a program is deleted": (
        "programs.delete",
        {"name": "main", "expected_revision": 1},
        (NoticeKind.PROGRAM, Change.DELETED, 0, "main", ""),
    ),
    "a frame is added": (
        "frames.add",
        {"name": "f", "pose": POSE, "expected_revision": 0},
        (NoticeKind.FRAMES, Change.NEW, 1, "cell", ""),
    ),
    "a tool is added": (
        "tools.add",
        {"name": "t", "tcp": POSE, "expected_revision": 0},
        (NoticeKind.TOOLS, Change.NEW, 1, "cell", ""),
    ),
    "an object is added": (
        "scene.add",
        {"object": BOX, "expected_revision": 0},
        (NoticeKind.SCENE, Change.NEW, 1, "cell", ""),
    ),
    "a position is saved": (
        "positions.save",
        {"name": "park", "expected_revision": 0},
        (NoticeKind.POSITIONS, Change.NEW, 1, "cell", ""),
    ),
    "a recording is begun": (
        "recordings.start",
        {"name": "swing"},
        (NoticeKind.RECORDING, Change.NEW, 1, "swing", ""),
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_each_change_is_told_once_to_its_maker_and_to_others(
    cell: EmulatedCell, change: str
) -> None:
    op, fields, expected = CHANGES[change]
    maker, other = wanting(cell, "maker"), wanting(cell, "other")
    asked(cell, maker, "programs.create", name="main")
    maker.got.clear()
    other.got.clear()
    asked(cell, maker, op, **fields)
    cell.wait(200)
    assert told(maker) == told(other) == [(*expected, maker.session, "maker")]


def test_a_recording_is_told_as_it_is_begun_ended_renamed_and_deleted(cell: EmulatedCell) -> None:
    watcher, maker = wanting(cell), cell.pendant("maker")
    asked(cell, maker, "recordings.start", name="swing")
    cell.wait(200)
    revision = 0
    asked(cell, maker, "recordings.stop")
    asked(cell, maker, "recordings.trim", name="swing", new_name="part")
    revision = told(watcher)[1][2]
    asked(
        cell, maker, "recordings.rename", name="swing", new_name="arc", expected_revision=revision
    )
    asked(cell, maker, "recordings.delete", name="part", expected_revision=told(watcher)[2][2])
    found = [(what, name, before) for _, what, _, name, before, _, _ in told(watcher)]
    assert found == [
        (Change.NEW, "swing", ""),
        (Change.CHANGED, "swing", ""),
        (Change.NEW, "part", ""),
        (Change.RENAMED, "arc", "swing"),
        (Change.DELETED, "part", ""),
    ]
    assert {kind for kind, *_ in told(watcher)} == {NoticeKind.RECORDING}
    assert {each[5] for each in told(watcher)} == {maker.session}


def test_whoever_did_not_ask_for_notices_gets_none(cell: EmulatedCell) -> None:
    older, silent, recanting = cell.stranger(), cell.pendant("silent"), wanting(cell)
    older.hello("older", version=2)
    recanting.send(Declare(2, 0.0, Notices.UNWANTED, "en"))
    maker = wanting(cell, "maker")
    asked(cell, maker, "programs.create", name="new")
    assert len(told(maker)) == 1
    assert not [*told(older), *told(silent), *told(recanting)]


def test_a_refused_change_is_told_to_nobody(cell: EmulatedCell) -> None:
    maker = wanting(cell, "maker")
    refused = maker.ask("programs.delete", name="nothing", expected_revision=3)
    assert refused["code"] > 0
    assert maker.ask("frames.add", name="f", pose=POSE, expected_revision=7)["code"] > 0
    cell.wait(200)
    assert told(maker) == []


def test_the_answer_leaves_before_the_notice(cell: EmulatedCell) -> None:
    maker = wanting(cell, "maker")
    asked(cell, maker, "programs.create", name="new")
    kinds = [type(each).__name__ for each in maker.got]
    assert kinds.index("Management") < kinds.index("DocumentChanged")


def test_promise_39_a_change_is_told_in_the_turn_of_its_acknowledgement(
    cell: EmulatedCell,
) -> None:
    watcher, maker = wanting(cell), cell.pendant("maker")
    cell.held = deque()
    for number in range(20):
        maker.send(_request("programs.create", {"name": f"p{number}"}))
    cell.wait(100)
    assert told(watcher) == []
    for number in range(20):
        cell.answer(1)
        assert [name for _, _, _, name, *_ in told(watcher)] == [
            f"p{each}" for each in range(number + 1)
        ]


def test_a_rename_whose_old_name_stays_is_told_as_a_new_program(cell: EmulatedCell) -> None:
    watcher, maker = wanting(cell), cell.pendant("maker")
    asked(cell, maker, "programs.create", name="old")
    watcher.got.clear()
    cell.held = deque()
    fields = {"name": "old", "new_name": "new", "expected_revision": 1}
    maker.send(_request("programs.rename", fields))
    while not isinstance(cell.held[0].question, Delete):
        cell.answer(1)
    assert told(watcher) == []
    cell.answered(cell.held.popleft(), StoreBusy("another program holds it"))
    (notice,) = told(watcher)
    assert notice[:5] == (NoticeKind.PROGRAM, Change.NEW, 1, "new", "")


# Slow readers.


class Clogged(EmulatedCell):
    """A cell some of whose pendants read nothing."""

    clogged: frozenset[int] = frozenset()

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        written: list[Effect] = []
        missed: list[int] = []
        for effect in outgoing:
            if isinstance(effect, Notify) and self.clogged & set(effect.sessions):
                missed += [each for each in effect.sessions if each in self.clogged]
                others = tuple(each for each in effect.sessions if each not in self.clogged)
                written.append(Notify(others, effect.message))
            else:
                written.append(effect)
        done = super().perform(written)
        if missed:
            done += self.perform(self.core.handle(NoticesMissed(tuple(missed)), self.now))
        return done


def test_promise_39_whoever_reads_too_slowly_is_told_once_to_look_at_everything() -> None:
    cell = Clogged(has_surroundings=True)
    cell.wait(50)
    slow, quick, maker = wanting(cell, "slow"), wanting(cell, "quick"), cell.pendant("maker")
    cell.clogged = frozenset({slow.session})
    for number in range(5):
        asked(cell, maker, "programs.create", name=f"p{number}")
    cell.wait(200)
    assert told(slow) == []
    assert len(told(quick)) == 5
    cell.clogged = frozenset()
    cell.wait(10)
    notice = only(DocumentChanged, slow.all(DocumentChanged))
    assert (notice.kind, notice.revision, notice.session) == (NoticeKind.EVERYTHING, 0, 0)
    asked(cell, maker, "programs.create", name="later")
    assert [each[0] for each in told(slow)] == [NoticeKind.EVERYTHING, NoticeKind.PROGRAM]
    assert len(told(quick)) == 6


def test_whoever_left_before_it_read_is_forgotten() -> None:
    cell = Clogged(has_surroundings=True)
    cell.wait(50)
    slow, maker = wanting(cell, "slow"), cell.pendant("maker")
    cell.clogged = frozenset({slow.session})
    asked(cell, maker, "programs.create", name="p")
    slow.close()
    assert not any(isinstance(each, Notify) for each in cell.core.handle(Tick(), cell.now + MS))


def surroundings(cell: EmulatedCell) -> CellEnvironment:
    assert cell.core.environment is not None
    return cell.core.environment


def test_what_a_program_takes_and_puts_down_is_told_within_a_tick(cell: EmulatedCell) -> None:
    """With the revision of the document, which it leaves as it is."""
    maker = cell.pendant("maker")
    environment = surroundings(cell)
    tip = environment.world._view.flange(cell.position).position.tolist()
    asked(cell, maker, "scene.add", object={**BOX, "position": tip}, expected_revision=0)
    watcher = wanting(cell)
    for change in (environment.attach, environment.detach):
        before = len(told(watcher))
        cell.perform(change("box", cell.now, lambda refused: None))
        cell.wait(10)
        found = told(watcher)[before:]
        assert found == [(NoticeKind.SCENE, Change.CHANGED, 1, "cell", "", 0, "")]


def test_a_grasp_that_misses_is_told_to_nobody(cell: EmulatedCell) -> None:
    maker = cell.pendant("maker")
    asked(cell, maker, "scene.add", object=BOX, expected_revision=0)
    watcher = wanting(cell)
    missed: list[object] = []
    cell.perform(surroundings(cell).attach("box", cell.now, missed.append))
    cell.wait(50)
    assert missed[0] is not None
    assert told(watcher) == []


# Signals.


def signals(pendant: Pendant) -> list[DocumentChanged]:
    return [each for each in pendant.all(DocumentChanged) if each.kind == NoticeKind.SIGNALS]


def test_promise_39_signals_are_told_within_a_tick_and_ten_times_a_second(
    cell: EmulatedCell,
) -> None:
    """And the last of them always."""
    cell.wait(300)
    watcher, maker = wanting(cell), cell.holder("maker")
    maker.send(_request("signals.set", {"output": 1, "value": False}))
    maker.send(_request("signals.set", {"output": 1, "value": True}))
    assert signals(watcher) == []
    cell.wait(10 * figure(39, "signals").count)
    assert len(signals(watcher)) == 1
    watcher.got.clear()
    cell.wait(100)
    for number in range(100):
        maker.send(_request("signals.set", {"output": 1, "value": number % 2 == 0}))
        cell.wait(10)
    found = len(signals(watcher))
    most = figure(39, "rate").count
    assert most - 1 <= found <= most == 1_000 * MS // SIGNALS_PERIOD_NS
    cell.wait(200)
    assert len(signals(watcher)) == found + 1
    revisions = [each.revision for each in signals(watcher)]
    assert revisions == sorted(set(revisions))
    cell.wait(500)
    assert len(signals(watcher)) == found + 1


def test_unchanged_signals_are_not_told(cell: EmulatedCell) -> None:
    cell.wait(300)
    watcher = wanting(cell)
    cell.wait(1_000)
    assert signals(watcher) == []


# Other cells.


def test_nothing_of_another_cell_is_told() -> None:
    here, there = EmulatedCell(has_surroundings=True), EmulatedCell(has_surroundings=True)
    for each in (here, there):
        each.wait(50)
    watcher, maker = wanting(there), here.pendant("maker")
    asked(here, maker, "programs.create", name="mine")
    there.wait(200)
    assert told(watcher) == []
