"""Promise 54 with real processes: a flood of other hosts, each with an address of its own.

The network is one of its own, which not every machine lets one have: then these tests are skipped,
and say so.
"""

import json
from pathlib import Path
from subprocess import Popen

import pytest
from promises.promise_figures import Figures, tell
from promises.promise_table import figure
from rigs.peers.own_network import begun_in_own_network

pytestmark = pytest.mark.realtime

NETWORK = Path(__file__).parents[1] / "rigs" / "peers" / "crowded_network.py"
LOGIN, STOP = figure(54, "login"), figure(54, "stop")


def tried(network: Popen[str]) -> dict[str, float]:
    assert network.stdin is not None
    assert network.stdout is not None
    network.stdin.write("\n")
    network.stdin.flush()
    line = network.stdout.readline()
    if not line:
        raise AssertionError(network.communicate()[1])
    found: dict[str, float] = json.loads(line)
    return found


# Not in `make test`: a flood takes the processors from whatever runs beside it.
@pytest.mark.soak
@pytest.mark.parametrize("hosts", [1, 5])
def test_promise_54_a_teacher_logs_in_and_a_stranger_stops_beside_a_flood(
    hosts: int,
) -> None:
    trials = STOP.trials
    stops = Figures(f"promise 54, a stop beside {hosts} hosts")
    logins = Figures(f"promise 54, a login beside {hosts} hosts, without its check")
    checks = list[float]()
    with begun_in_own_network(NETWORK) as network:
        assert network.stdin is not None
        network.stdin.write(f"{hosts}\n")
        while stops.need_more(trials, STOP.ms) or logins.need_more(trials, LOGIN.ms):
            found = tried(network)
            began = round(found["began"])
            stops.take(began, found["stop"])
            logins.take(began, found["login"] - found["check"])
            checks.append(found["check"])
            for each in (stops, logins):
                each.idle.append(max(found["idle"], 0.01))
    tell(f"one check beside them: {min(checks):.0f} to {max(checks):.0f} ms")
    stops.judge(STOP.ms)
    logins.judge(LOGIN.ms)
