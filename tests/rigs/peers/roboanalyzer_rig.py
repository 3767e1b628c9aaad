"""A scripted server of two cells, as the calls of RoboAnalyzer need it."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.simplemsg.pendant import OperatingMode
from openpendant.tools.pendants.loop_thread import LoopThread

ARM = {"name": "j", "unit": "rad", "lower": -math.pi, "upper": math.pi}
RAIL = {"name": "rail", "unit": "m", "lower": 0.0, "upper": 2.0}
SNAPSHOT = {"cell": "left", "robot": "ur5", "joints": [RAIL, *[ARM] * 5]}
CELLS = {
    "cells": [
        {"cell": "left", "robot": "ur5", "dof": 6},
        {"cell": "right", "robot": "puma560", "dof": 6},
    ]
}


@contextmanager
def roboanalyzer_server() -> Iterator[ScriptedPendantServer]:
    """Run the server on a thread; its robot stands in AUTOMATIC."""
    thread = LoopThread("scripted server")
    with thread.entered(scripted_server()) as running:
        running.mode = OperatingMode.AUTOMATIC
        running.answers = {"snapshot": SNAPSHOT, "cells": CELLS, "trace.clear": {}}
        yield running
    thread.end()
