"""`openpendant serve` as a command: what it says and returns when it cannot run."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from openpendant.server.cli import main

FREE_PORTS = ("--pendant-port", "0", "--ros-motion-port", "0", "--ros-state-port", "0")


def test_a_port_in_use_is_named_with_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main([*FREE_PORTS, "--ros-state-port", port]) == 3
    err = capsys.readouterr().err
    assert err.startswith(f"openpendant serve: cannot listen on 127.0.0.1 port {port}: ")
    assert err.count("\n") == 1


@pytest.mark.realtime
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_ready_line_that_cannot_be_written_is_no_matter_of_ports() -> None:
    command = [sys.executable, "-m", "openpendant.tools", "serve", *FREE_PORTS]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False
        )
    said = [line for line in done.stderr.splitlines() if line.startswith("openpendant")]
    assert said == ["openpendant serve: [Errno 28] No space left on device"]
    assert "Traceback" not in done.stderr
    assert done.returncode == 1
