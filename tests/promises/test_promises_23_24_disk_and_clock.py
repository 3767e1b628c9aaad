"""Promises 23 and 24: neither a failing disk nor a jumping wall clock changes a set-point."""

from __future__ import annotations

import ast
import datetime
import itertools
import json
import struct
import time
from pathlib import Path

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.motion.jog_pad import EmulatedPad

from openpendant.server.store.database_file import NotOurFile
from openpendant.server.store.store_errors import DiskFull, ReadOnly, StoreError
from openpendant.simplemsg import PENDANT, ByteOrder, Codec, ReplyCode
from openpendant.simplemsg.pendant import Activity, Management, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

ROOT = Path(__file__).parent.parent.parent
DAY = 86_400.0
_CODEC = Codec(PENDANT, ByteOrder.LITTLE, 4)


class Story(EmulatedPad):
    """A motion and a jog, with a program saved again and again meanwhile."""

    def __init__(self, failure: StoreError | None = None) -> None:
        super().__init__(EmulatedCell("ur5"))
        self.cell.store.failure = failure
        self.saves: list[int] = []

    def save(self) -> None:
        body = {"op": "programs.create", "name": f"p{len(self.saves)}"}
        request = Management(self._request(), json.dumps(body).encode())
        (answer,) = [each for each in self.pendant.send(request) if isinstance(each, Management)]
        code = json.loads(answer.body).get("code", 0)
        assert (answer.reply_code == ReplyCode.SUCCESS) == (code == 0)
        self.saves.append(code)

    def run(self) -> list[bytes]:
        cell = self.cell
        self.turn_to(OperatingMode.AUTOMATIC)
        goal = (cell.position[0] + 0.5, *cell.position[1:])
        assert self.pendant.move(*goal, speed=0.5) is V.ACCEPTED
        while cell.core.cell.activity is not Activity.IDLE:
            self.save()
            self.hold(50)
        self.turn_to(OperatingMode.MANUAL_REDUCED)
        assert self.press(0.0, 0.5, -0.5, 0.0, 0.0, 0.0, deadline=0.2) is V.ACCEPTED
        for _ in range(12):
            self.save()
            self.hold(50)
        self.release()
        self.finish()
        assert cell.controller.referee.total == 0
        return [_CODEC.encode(message) for message in cell.sent]


@pytest.fixture(scope="module")
def undisturbed() -> list[bytes]:
    story = Story()
    frames = story.run()
    assert len(frames) > 100
    assert set(story.saves) == {0}
    return frames


@pytest.mark.parametrize(
    "failure",
    [
        DiskFull("no space left"),
        ReadOnly("a read-only disk"),
        NotOurFile("store.db: is a directory now, and not the file that was opened"),
    ],
)
def test_promise_23_a_disk_that_fails_refuses_each_save_and_moves_nothing_differently(
    failure: StoreError, undisturbed: list[bytes]
) -> None:
    story = Story(failure)
    assert story.run() == undisturbed
    (code,) = set(story.saves)
    assert V(code) in (V.STORE_FAILED, V.DISK_FULL, V.STORE_READ_ONLY)


@pytest.mark.parametrize("jump", [DAY, -DAY, 0.5, -3_600.0])
def test_promise_24_a_wall_clock_that_jumps_leaves_every_set_point_bit_for_bit(
    jump: float, undisturbed: list[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each look at the wall clock finds it moved once more, forth or back."""
    looks = itertools.count()

    class Jumping(datetime.datetime):
        @classmethod
        def now(cls, tz: datetime.tzinfo | None = None) -> Jumping:
            return cls.fromtimestamp(1.8e9 + jump * next(looks), tz)

    monkeypatch.setattr(time, "time", lambda: 1.8e9 + jump * next(looks))
    monkeypatch.setattr(time, "time_ns", lambda: round(1e9 * (1.8e9 + jump * next(looks))))
    monkeypatch.setattr(datetime, "datetime", Jumping)
    assert Story().run() == undisturbed


WALL_CLOCK = {
    "server/cli/serve.py",  # the head of a journal
    "server/access/audit_file.py",  # the stamp of an audit line
    "server/store/sqlite_store.py",  # the stamp of a revision
    "controller_emulator/shell/cli.py",  # the head of a journal
}
"""Who may look at the wall clock: stamps for people, made outside the cores."""


def test_promise_24_only_stamps_for_people_look_at_the_wall_clock() -> None:
    readers = set()
    for room in ("server", "motion", "simplemsg", "controller_emulator"):
        for file in sorted((ROOT / room).rglob("*.py")):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                    name = f"{node.value.id}.{node.attr}"
                    if name in ("time.time", "time.time_ns", "datetime.now", "datetime.today"):
                        readers.add(file.relative_to(ROOT).as_posix())
    assert readers == WALL_CLOCK


def test_the_frames_of_the_story_are_the_same_in_each_run(undisturbed: list[bytes]) -> None:
    """Guards the comparisons above."""
    assert Story().run() == undisturbed
    (length,) = struct.unpack_from("<i", undisturbed[0])
    assert len(undisturbed[0]) == length + 4
