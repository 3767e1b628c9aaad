import json
import logging
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from rigs.cells.server_rig import LIMITS

from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.server.planning import plan_store
from openpendant.server.planning.jobs import CertifiedTrajectory
from openpendant.server.planning.plan_store import PlanStore, StoredMotion


def _certified() -> CertifiedTrajectory:
    trajectory = plan_joint_move((0.0, 0.0), (0.1, 0.1), LIMITS)
    return CertifiedTrajectory(trajectory, certify(trajectory, LIMITS))


CERTIFIED = _certified()


def motion(number: int) -> StoredMotion:
    return StoredMotion(number, 0, 0.0, CERTIFIED)


class SlowDisk:
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.is_asked = threading.Event()
        self.goes_on = threading.Event()
        self._savez = np.savez
        monkeypatch.setattr(np, "savez", self._wait)

    def _wait(self, *given: object, **samples: object) -> None:
        self.is_asked.set()
        assert self.goes_on.wait(30)
        self._savez(*given, **samples)  # type: ignore[arg-type]


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> SlowDisk:
    return SlowDisk(monkeypatch)


def kept(folder: Path) -> list[int]:
    return sorted(json.loads(path.read_text())["number"] for path in folder.glob("*.json"))


def test_what_was_kept_is_written_when_the_store_is_closed(tmp_path: Path) -> None:
    store = PlanStore(tmp_path)
    for number in (1, 2, 3):
        store.keep(motion(number))
    store.close()
    assert kept(tmp_path) == [1, 2, 3]


def test_motions_that_a_hanging_disk_has_no_room_for_are_dropped_and_named(
    tmp_path: Path, disk: SlowDisk, caplog: pytest.LogCaptureFixture
) -> None:
    store = PlanStore(tmp_path, most_waiting=2)
    store.keep(motion(1))
    assert disk.is_asked.wait(30)
    with caplog.at_level(logging.WARNING):
        for number in range(2, 8):
            store.keep(motion(number))
    disk.goes_on.set()
    store.close()
    assert kept(tmp_path) == [1, 2, 3]
    (told,) = caplog.messages
    assert "not kept from 0004 on" in told


def test_a_disk_that_takes_motions_again_is_told_with_the_missing_ones(
    tmp_path: Path, disk: SlowDisk, caplog: pytest.LogCaptureFixture
) -> None:
    store = PlanStore(tmp_path, most_waiting=1)
    store.keep(motion(1))
    assert disk.is_asked.wait(30)
    for number in (2, 3, 4):
        store.keep(motion(number))
    disk.goes_on.set()
    while store.waiting:
        time.sleep(0.001)
    with caplog.at_level(logging.WARNING):
        store.keep(motion(5))
    store.close()
    assert kept(tmp_path) == [1, 2, 5]
    assert "kept again from 0005 on; 0003 to 0004 are missing" in caplog.messages[-1]


def test_a_disk_that_hangs_does_not_hold_up_the_end_of_the_server(
    tmp_path: Path,
    disk: SlowDisk,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(plan_store, "_FAREWELL", 0.01)
    store = PlanStore(tmp_path)
    for number in (1, 2, 3):
        store.keep(motion(number))
    assert disk.is_asked.wait(30)
    store.close()
    disk.goes_on.set()
    assert "the last 3 motions" in caplog.messages[-1]
