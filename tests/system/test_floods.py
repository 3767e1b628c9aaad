"""Pendants that send what is dearest at full rate, beside robots that move (promise 53)."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rigs.processes import flooding_pendants

from openpendant.tools.bench.cells import running_room
from openpendant.tools.bench.jogging_pendants import ANYWHERE

pytestmark = [pytest.mark.realtime, pytest.mark.soak, pytest.mark.timeout(900)]

SECONDS, JOG_LEAD, LATE_MS, RATIO = 60.0, 0.1, 10.0, 1.5


def jogging(server: dict[str, Any], cells: list[str], seconds: float) -> dict[str, Any]:
    """Have a pendant jog in each cell; return their account of it and of the server's ticks."""
    command = [sys.executable, "-m", "openpendant.tools.bench.jogging_pendants"]
    command += [str(server["pendant"]), str(server["pid"]), str(seconds), ANYWHERE, *cells]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    account: dict[str, Any] = json.loads(done.stdout)
    return account


@pytest.mark.parametrize("robots", [2, 30])
def test_promise_53_no_flood_ends_a_motion_or_makes_a_tick_late(robots: int) -> None:
    """Thirty robots in motion take two cores whole, so the room waits for what is late."""
    room = running_room(robots, is_pinned=False, jog_lead=JOG_LEAD, is_unhurried=robots > 2)
    with room as (server, cells):
        for kind, count in (("viewer", 1), ("stranger", 1), ("viewer", 10), ("stranger", 10)):
            quiet = jogging(server, cells, SECONDS / 4)
            flood = [sys.executable, str(Path(flooding_pendants.__file__))]
            flood += [str(server["pendant"]), str(SECONDS + 10), str(count), kind, cells[0]]
            with subprocess.Popen(flood, stdout=subprocess.PIPE, text=True) as flooding:
                flooded = jogging(server, cells, SECONDS)
                sent, _ = flooding.communicate(timeout=120)
            told = f"{count} of {kind}: {sent.strip()} bytes, {flooded}, quiet: {quiet}"
            assert int(sent) > 1_000_000 or kind == "stranger", told
            assert not flooded["latched"], told
            assert not flooded["ended"], told
            assert flooded["late_p99"] <= max(LATE_MS, RATIO * quiet["late_p99"]), told
