"""What the user of `record` is told when the arguments are wrong."""

import argparse
import socket
from pathlib import Path

import pytest

from openpendant.tools.packets import faults
from openpendant.tools.packets.live.endpoints import Endpoint, listen_endpoint, target_endpoint
from openpendant.tools.packets.record import main

PAIR = ["--listen", "0", "--to", "1"]


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        ([], 2, "required: --listen, --to, -o"),
        ([*PAIR, "--listen", "0", "-o", "x"], 2, "2 --listen need as many --to, not 1"),
        ([*PAIR, "-o", "/nowhere/x"], 2, "/nowhere/x: No such file or directory"),
        ([*PAIR, "-o", "x", "--max-size", "many"], 2, "'many' is no size such as"),
        (["--listen", "70000", "--to", "1", "-o", "x"], 2, "a port is 0 to 65535"),
        (["--listen", "0", "--to", "0", "-o", "x"], 2, "a port is 1 to 65535"),
        (["--listen", "192.0.2.1:0", "--to", "1", "-o", "FILE"], 3, "cannot listen on"),
    ],
)
def test_a_wrong_argument_is_named(
    arguments: list[str], code: int, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "trace")
    assert main([file if argument == "FILE" else argument for argument in arguments]) == code
    assert reason in capsys.readouterr().err


def test_a_port_in_use_is_the_peers_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["--listen", str(port), "--to", "1", "-o", str(tmp_path / "x")]) == 3
    assert capsys.readouterr().err == f"cannot listen on 127.0.0.1:{port}: Address already in use\n"
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("tool", ["record", "faults"])
def test_a_file_is_as_it_was_when_the_port_is_taken(tool: str, tmp_path: Path) -> None:
    file = tmp_path / "trace"
    file.write_text("an hour's recording")
    script = tmp_path / "script"
    script.write_text("rule = []")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        pair = ["--listen", str(taken.getsockname()[1]), "--to", "1"]
        if tool == "record":
            assert main([*pair, "-o", str(file)]) == 3
        else:
            assert faults.main([str(script), *pair, "--log", str(file)]) == 3
    assert file.read_text() == "an hour's recording"


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("11000", Endpoint("127.0.0.1", 11000)),
        (":11000", Endpoint("127.0.0.1", 11000)),
        ("robot:11000", Endpoint("robot", 11000)),
        ("[::1]:11000", Endpoint("::1", 11000)),
    ],
)
def test_addresses_are_read_as_people_write_them(text: str, endpoint: Endpoint) -> None:
    assert listen_endpoint(text) == target_endpoint(text) == endpoint


@pytest.mark.parametrize("text", ["", "robot", "robot:", "1:2:x", "-1", "99999", "١٢", "9" * 5000])
def test_what_is_no_address_is_said(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="is no"):
        listen_endpoint(text)
