"""Motions of RoboAnalyzer's calls: control, enabling (training), start, arrival."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator

from openpendant.simplemsg.pendant import OperatingMode, StateField
from openpendant.simplemsg.verdicts import VerdictCode

from ..connection_errors import PendantError, Refused
from ..sync_client import SyncPendantClient
from ..sync_session import SyncMotion

_READY_WITHIN = 10.0


def begun(pendant: SyncPendantClient) -> list[float]:
    """Take control of a robot; return one degree or one millimetre of each joint, in rad or m.

    Raises:
        Refused: somebody else moves it.
        PendantError: its controller reports no position.
    """
    joints = pendant.snapshot()["joints"]
    pendant.take_control()
    try:
        pendant.wait_until(
            lambda state: bool(state.valid_fields & StateField.TOOL), within=_READY_WITHIN
        )
    except TimeoutError:
        text = f"the controller did not tell within {_READY_WITHIN:g} s where the robot stands"
        raise PendantError(f"{text}; openpendant why says what is missing") from None
    return [math.radians(1.0) if joint["unit"] == "rad" else 0.001 for joint in joints]


@contextlib.contextmanager
def enabled(pendant: SyncPendantClient) -> Iterator[None]:
    """Hold the enabling device (training) in the modes that need it."""
    state = pendant.next_state()
    if state.operating_mode == OperatingMode.AUTOMATIC:
        yield
        return
    with pendant.enabling():
        yield


def arrive(move: Callable[[], SyncMotion]) -> None:
    """Start a motion and wait for its end; a robot at the target already has arrived."""
    try:
        motion = move()
    except Refused as refused:
        if refused.code != VerdictCode.NO_MOTION:
            raise
        return
    motion.done()
