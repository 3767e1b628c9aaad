import json
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from openpendant.server.cli.serve import main, say_ready
from openpendant.server.shell.listening import Ports, RosPorts

Capture = pytest.CaptureFixture[str]

FREE_PORTS = ("--pendant-port", "0", "--ros-motion-port", "0", "--ros-state-port", "0")


def test_a_port_in_use_is_named_with_exit_code_3(capsys: Capture) -> None:
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


COMES_TO_HAVE_MORE = """
import gc, os, signal
from openpendant.server.cli import serve

def ready(*_, **__):
    before = gc.get_stats()[0]["collections"]
    kept = [[] for _ in range(40_000)]
    print(gc.get_stats()[0]["collections"] - before, flush=True)
    os.kill(os.getpid(), signal.SIGTERM)

serve.say_ready = ready
raise SystemExit(serve.main(ARGUMENTS))
"""


@pytest.mark.realtime
def test_what_a_room_of_robots_comes_to_have_is_not_searched_for_cycles() -> None:
    program = COMES_TO_HAVE_MORE.replace("ARGUMENTS", repr(list(FREE_PORTS)))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.stdout, done.returncode) == ("0\n", 0), done.stderr


ROOM = """
listen.pendant_port = 0
[[cells]]
name = "left"
controller.motion_port = 1
[[cells]]
name = "right"
"""


@pytest.mark.parametrize(
    "argument",
    [
        ("--robot", "ur5"),
        ("--controller", "127.0.0.1:12000:12002"),
        ("--ros-motion-port", "0"),
        ("--points", "simple"),
    ],
)
def test_an_argument_that_speaks_of_one_cell_is_refused_beside_several(
    argument: tuple[str, str], tmp_path: Path, capsys: Capture
) -> None:
    file = tmp_path / "room.toml"
    file.write_text(ROOM, encoding="utf-8")
    assert main(["--config", str(file), *argument]) == 2
    assert f"arguments: {argument[0]}: speaks of one cell" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [((), "false"), (("--emulated",), "true"), (("--no-emulated",), "false")],
)
def test_only_who_says_so_has_an_emulated_controller(
    arguments: tuple[str, ...], shown: str, capsys: Capture
) -> None:
    assert main([*arguments, "--print-config"]) == 0
    assert f"\nemulated = {shown}\n" in capsys.readouterr().out


@pytest.mark.parametrize("port", ["--ros-motion-port", "--ros-state-port"])
def test_the_ports_of_ros_i_are_turned_off_by_argument_as_by_file(
    port: str, capsys: Capture
) -> None:
    assert main([port, "off", "--print-config"]) == 0
    assert f'{port[2:].replace("-", "_")} = "off"\n' in capsys.readouterr().out


@pytest.mark.parametrize(
    ("port", "says"),
    [
        ("none", "accepted: a TCP port, 0 for any free one, or off; got 'none'"),
        ("65536", "less than or equal to 65535"),
    ],
)
def test_a_port_of_ros_i_that_is_none_is_refused(port: str, says: str, capsys: Capture) -> None:
    assert main(["--ros-motion-port", port]) == 2
    assert says in capsys.readouterr().err


def test_a_file_of_several_cells_is_printed_as_one(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "room.toml"
    file.write_text(ROOM.replace("motion_port = 1", "state_port = 1"), encoding="utf-8")
    assert main(["--config", str(file), "--print-config"]) == 2
    assert "controller.motion_port of cell 'right'" in capsys.readouterr().err
    other = ROOM.replace("motion_port = 1", "host = '10.0.0.2'")
    file.write_text(other, encoding="utf-8")
    assert main(["--config", str(file), "--pendant-port", "11", "--print-config"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("[[cells]]") == 2
    assert "pendant_port = 11\n" in printed


def told_ready(capsys: Capture, **cells: RosPorts) -> tuple[str, dict[str, Any]]:
    for json_output in (False, True):
        say_ready(Ports(11010, cells), json_output=json_output)
    text, line = capsys.readouterr().out.splitlines()
    return text, json.loads(line)


def test_the_ready_line_of_several_cells_names_them(capsys: Capture) -> None:
    text, ready = told_ready(capsys, left=RosPorts(11000, 11002), right=RosPorts(None, None))
    assert "cell='left' ros_motion=11000 ros_state=11002 cell='right' ros_motion=off" in text
    assert (ready["event"], ready["pendant"]) == ("ready", 11010)
    assert ready["cells"]["left"] == {"ros_motion": 11000, "ros_state": 11002}
    assert ready["cells"]["right"] == {"ros_motion": None, "ros_state": None}


def test_the_ready_line_of_one_cell_has_its_ports_beside_the_pendants(capsys: Capture) -> None:
    text, ready = told_ready(capsys, cell=RosPorts(11000, 11002))
    assert text.startswith("server ready pendant=11010 ros_motion=11000 ros_state=11002 pid=")
    assert ready.items() >= {"ros_motion": 11000, "ros_state": 11002}.items()
