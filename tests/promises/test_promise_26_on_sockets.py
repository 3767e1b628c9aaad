"""Promise 26: a server that stands still while its robot moves is stopped for by another process.

Measured from the signal that stops the server to the STOP that reaches the controller.
"""

import os
import signal
import time
from pathlib import Path

import pytest
from promises.promise_figures import Figures, Void
from promises.promise_table import Figure, figure
from rigs.peers.recording_controller import Arrival
from rigs.peers.wire_pendant import WirePendant
from rigs.processes.promise_rig import PromiseRig, promise_rig

from openpendant.simplemsg.pendant import StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V

REAL, EMULATED = figure(26, "stopped"), figure(26, "emulated_stopped")
EXPLICIT = {"deadline": figure(26, "stop").seconds}

pytestmark = [pytest.mark.realtime, pytest.mark.soak, pytest.mark.timeout(3_600)]


def is_stop(arrival: Arrival) -> bool:
    return arrival.is_stop


def moves(arrival: Arrival) -> bool:
    return bool(arrival.joint_velocity)


def stop_after_freeze(rig: PromiseRig) -> tuple[int, Arrival | None]:
    frozen = time.monotonic_ns()
    os.kill(rig.server_pid, signal.SIGSTOP)
    try:
        return frozen, rig.controller.first(is_stop, frozen, 2.0)
    finally:
        os.kill(rig.server_pid, signal.SIGCONT)


def come_back(pendant: WirePendant) -> None:
    pendant.beats = False
    pendant.wait_until(lambda state: state.stop != StopKind.NONE)
    pendant.come_to_rest()
    assert pendant.reset() is V.ACCEPTED
    pendant.wait_until(lambda state: state.stop == StopKind.NONE)


@pytest.mark.parametrize(("settings", "stopped"), [(EXPLICIT, REAL), ({}, EMULATED)])
def test_promise_26_a_frozen_server_is_stopped_for_within_200_ms(
    tmp_path: Path, settings: dict[str, float], stopped: Figure
) -> None:
    figures = Figures("promise 26, server frozen to STOP at the controller")
    void = Void(figures, stopped.trials)
    with promise_rig(tmp_path, watchdog=settings) as rig:
        pendant = rig.pendant("frozen out")
        pendant.take_control()
        while figures.need_more(stopped.trials, stopped.ms):
            pendant.hold_anew()
            pressed = pendant.press(0.3 if len(figures.delays) % 2 else -0.3, 0.25)
            pendant.listen(0.08)
            if rig.controller.first(moves, pressed, 0.0) is None:
                void.add()
                pendant.come_to_rest()
                continue
            frozen, stop = stop_after_freeze(rig)
            assert stop is not None, "nobody stopped the robot"
            figures.take(frozen, (stop.time - frozen) / 1e6)
            figures.idle.append(rig.idle_delay())
            come_back(pendant)
        pendant.close()
    figures.judge(stopped.ms)
