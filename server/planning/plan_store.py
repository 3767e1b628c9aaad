"""Keeping what was moved: each certified trajectory with its certificate, as files.

Writing happens in a thread, because a disk may take its time; a disk that is full or gone is
reported once and never holds up a motion.
"""

from __future__ import annotations

import json
import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..driving.certified import Certified

log = logging.getLogger("openpendant.server")


@dataclass(frozen=True, slots=True)
class StoredMotion:
    """A motion that began.

    Attributes:
        number: counts the motions of this server, from 1.
        started: monotonic time of its first set-point [ns].
        plan_time: wall time that planning took [s].
        certified: its samples and certificate.
    """

    number: int
    started: int
    plan_time: float
    certified: Certified


class PlanStore:
    """A folder with two files for each motion: `N.npz` with the samples, `N.json` with the rest."""

    def __init__(self, folder: Path) -> None:
        """Make a store; the folder is made when the first motion is kept."""
        self._folder = folder
        # A second run in the same folder goes on counting; nothing is overwritten.
        kept = [int(path.stem) for path in folder.glob("*.json") if path.stem.isdigit()]
        self._before = max(kept, default=0)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="plan-store")
        self._complained = False

    def keep(self, motion: StoredMotion) -> None:
        """Write a motion some time soon; returns at once."""
        self._thread.submit(self._write, motion)

    def close(self) -> None:
        """Wait until everything is written."""
        self._thread.shutdown(wait=True)

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
