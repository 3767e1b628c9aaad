"""Plan store: each executed certified trajectory with its certificate, as files.

Writing happens in a thread, because a disk may be slow; a disk that is slow, full or gone never
holds up a motion. The motions that wait for it are bounded: those beyond are not kept, and the log
names them. A disk that refuses is reported once.
"""

from __future__ import annotations

import json
import logging
import threading
from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .jobs import CertifiedTrajectory

log = logging.getLogger("openpendant.server")

MOST_WAITING = 100
"""Greatest number of a cell's motions that wait for the disk; 1 min of motion is about 1 MB."""

_FAREWELL = 2.0


@dataclass(frozen=True, slots=True)
class StoredMotion:
    """Started motion.

    Attributes:
        number: counts the motions of this server, from 1.
        started: monotonic time of its first set-point [ns].
        plan_time: wall time that planning took [s].
    """

    number: int
    started: int
    plan_time: float
    certified: CertifiedTrajectory


class PlanStore:
    """Folder with two files for each motion: `N.npz` with the samples, `N.json` with the rest."""

    def __init__(self, folder: Path, *, most_waiting: int = MOST_WAITING) -> None:
        """Make a store; the folder is made when the first motion is kept."""
        self._folder = folder
        # A second run in the same folder continues the numbers; nothing is overwritten.
        kept = [int(path.stem) for path in folder.glob("*.json") if path.stem.isdigit()]
        self._before = max(kept, default=0)
        self._most_waiting = most_waiting
        self._turn = threading.Condition()
        self._waiting: deque[StoredMotion] = deque()
        self._first_dropped: int | None = None  # since the disk last took one in time
        self._is_closing = False
        self._complained = False
        self._thread = threading.Thread(target=self._run, name="plan-store", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Number of motions that wait for the disk."""
        return len(self._waiting)

    def keep(self, motion: StoredMotion) -> None:
        """Queue a motion for writing, if there is room; returns at once."""
        number = self._before + motion.number
        with self._turn:
            waiting = len(self._waiting)
            has_room = waiting < self._most_waiting
            if has_room:
                self._waiting.append(motion)
                self._turn.notify()
        if not has_room and self._first_dropped is None:
            self._first_dropped = number
            text = "the disk is too slow: motions are not kept from %04d on; %d wait, at most %d"
            log.warning(text, number, waiting, self._most_waiting)
        elif has_room and self._first_dropped is not None:
            text = "motions are kept again from %04d on; %04d to %04d are missing"
            log.warning(text, number, self._first_dropped, number - 1)
            self._first_dropped = None

    def close(self) -> None:
        """Write what is left, for at most two seconds."""
        with self._turn:
            self._is_closing = True
            self._turn.notify()
        self._thread.join(_FAREWELL)
        if self._thread.is_alive():
            # The motion that is being written has left the queue already.
            left = len(self._waiting) + 1
            log.error("the disk did not take the last %d motions in time: they are not kept", left)

    def _run(self) -> None:
        while (motion := self._next()) is not None:
            self._write(motion)

    def _next(self) -> StoredMotion | None:
        """Wait for a motion; return None once all are written and no more comes."""
        with self._turn:
            while not self._waiting and not self._is_closing:
                self._turn.wait()
            return self._waiting.popleft() if self._waiting else None

    def _write(self, motion: StoredMotion) -> None:
        trajectory = motion.certified.trajectory.trajectory()
        number = self._before + motion.number
        about = {
            "number": number,
            "started_ns": motion.started,
            "plan_time": motion.plan_time,
            "duration": trajectory.duration,
            "certificate": motion.certified.certificate.as_dict(),
        }
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            np.savez(
                self._folder / f"{number:04d}.npz",
                times=trajectory.times,
                position=trajectory.position,
                velocity=trajectory.velocity,
                acceleration=trajectory.acceleration,
            )
            path = self._folder / f"{number:04d}.json"
            path.write_text(json.dumps(about, indent=1), encoding="utf-8")
        except OSError as error:
            if not self._complained:
                self._complained = True
                log.warning("motions are not kept: %s", error)
