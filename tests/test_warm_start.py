import asyncio
import signal
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.processes.warm_start import WarmProcess

pytestmark = pytest.mark.realtime

EMULATOR = "openpendant.controller_emulator"
PORTS = ("--motion-port", "0", "--state-port", "0", "--json")


def test_a_forked_program_says_and_ends_what_one_of_its_own_interpreter_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    process = WarmProcess(EMULATOR, "--robot", "nobody.yaml", log=Path("log"))
    assert process.line() == b""
    process.end(PATIENCE)
    assert process.returncode == 2
    assert "nobody.yaml" in Path("log").read_text(encoding="utf-8")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGKILL, -9)])
async def test_a_forked_program_is_ended_by_a_signal_of_its_own(
    number: signal.Signals, code: int
) -> None:
    first, other = (WarmProcess(EMULATOR, "--robot", "ur5", *PORTS) for _ in range(2))
    assert first.line()
    assert other.line()
    first.send_signal(number)
    assert await asyncio.wait_for(first.wait(), PATIENCE) == code
    assert other.returncode is None
    other.end(0.0)
    assert other.returncode == -signal.SIGKILL
