"""`openpendant why`: its table, its exit codes, and what it says where nobody answers."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools import why
from openpendant.tools.pendants.client import Refused

Answer = Callable[[dict[str, Any]], None]

HOLDS = {"condition": "link", "meaning": "the controller is connected", "holds": True}
BROKEN = {
    "condition": "stop",
    "meaning": "no stop is latched",
    "holds": False,
    "code": 20,
    "name": "STOP_LATCHED",
    "text": "software stop by anna: tea",
    "cause": "The software stop is latched.",
    "remedy": "Reset it.",
}


def answer(*conditions: dict[str, Any]) -> dict[str, Any]:
    broken = next((each["condition"] for each in conditions if not each["holds"]), "")
    return {
        "cell": "left",
        "kind": "move",
        "ready": not broken,
        "broken": broken,
        "conditions": list(conditions),
        "ended": None,
    }


@pytest.fixture
def server_says(monkeypatch: pytest.MonkeyPatch) -> Answer:
    def put(said: dict[str, Any]) -> None:
        async def ask(*_: object) -> dict[str, Any]:
            return said

        monkeypatch.setattr(why, "_ask", ask)

    return put


def test_a_ready_cell_is_exit_code_0(
    server_says: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    server_says(answer(HOLDS))
    assert why.main([]) == 0
    assert "cell left is ready for a move" in capsys.readouterr().out


def test_the_first_broken_condition_is_marked_with_cause_and_remedy(
    server_says: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    server_says(answer(HOLDS, BROKEN, {**BROKEN, "condition": "limits"}))
    assert why.main([]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line.startswith(">")] == [
        "> NO  stop        no stop is latched"
    ]
    assert "remedy: Reset it." in lines
    assert any("software stop by anna: tea" in line for line in lines)


def test_json_is_the_whole_answer(server_says: Answer, capsys: pytest.CaptureFixture[str]) -> None:
    server_says(answer(HOLDS, BROKEN))
    assert why.main(["--json"]) == 1
    assert json.loads(capsys.readouterr().out) == answer(HOLDS, BROKEN)


def test_nobody_there_is_one_sentence(
    capsys: pytest.CaptureFixture[str], unused_tcp_port: int
) -> None:
    assert why.main([f"127.0.0.1:{unused_tcp_port}"]) == 69
    shown = capsys.readouterr().err
    assert shown.startswith("openpendant why: nobody listens at")
    assert "openpendant serve" in shown
    assert shown.count("\n") == 1


def test_where_several_cells_are_served_the_option_and_their_names_are_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def ask(*_: object) -> dict[str, Any]:
        raise Refused(VerdictCode.UNKNOWN_CELL, "name a cell; here: left, right", -1, 0.0, 0.0)

    monkeypatch.setattr(why, "_ask", ask)
    assert why.main([]) == 69
    shown = capsys.readouterr().err
    assert shown.endswith("name a cell; here: left, right; say which by --cell NAME\n")


@pytest.mark.parametrize("option", [[], ["--server"]], ids=["bare", "behind its option"])
def test_the_server_is_given_bare_or_behind_its_option(
    capsys: pytest.CaptureFixture[str], unused_tcp_port: int, option: list[str]
) -> None:
    assert why.main([*option, f"127.0.0.1:{unused_tcp_port}"]) == 69
    assert f"nobody listens at 127.0.0.1:{unused_tcp_port}" in capsys.readouterr().err


def test_two_servers_are_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        why.main(["127.0.0.1:1", "--server", "127.0.0.1:2"])
    assert ended.value.code == 2
    assert "both name a server" in capsys.readouterr().err


@pytest.mark.parametrize("address", ["host:", ":1", "host:0", "host:70000", "host:x"])
def test_an_address_that_is_none_is_wrong_usage(address: str) -> None:
    with pytest.raises(SystemExit) as ended:
        why.main([address])
    assert ended.value.code == 2


def test_a_certificate_that_is_none_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert why.main(["--ca", str(tmp_path / "none.pem")]) == 2
    assert "none.pem" in capsys.readouterr().err


def test_a_user_that_nobody_types_a_password_for_is_wrong_usage(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody(_: str) -> str:
        raise EOFError

    monkeypatch.delenv("OPENPENDANT_PASSWORD", raising=False)
    monkeypatch.setattr("getpass.getpass", nobody)
    assert why.main(["--user", "ann"]) == 2
    assert "OPENPENDANT_PASSWORD may hold it" in capsys.readouterr().err


def test_a_password_is_no_argument(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        why.main(["--password", "x"])
    assert "--password" in capsys.readouterr().err


def test_the_help_says_every_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        why.main(["--help"])
    assert ended.value.code == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "0 it could move, 1 a condition is broken, 2 wrong usage, 69 no server" in shown


def test_a_refusal_comes_with_its_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    refused = Refused(VerdictCode.LOGIN_NEEDED, "log in first", -1, 0.0, 0.0)

    async def ask(*_: object) -> dict[str, Any]:
        raise refused

    monkeypatch.setattr(why, "_ask", ask)
    assert why.main([]) == 69
    assert capsys.readouterr().err.endswith(f"log in first -> {refused.remedy}\n")


def test_of_a_cell_that_is_ready_it_says_why_the_last_motion_ended(
    server_says: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    ended = {"code": 149, "name": "SERVER_LATE", "text": "away for 300 ms", "cause": "late"}
    server_says(answer(HOLDS) | {"ended": ended | {"remedy": "read the log"}})
    assert why.main([]) == 0
    out = capsys.readouterr().out
    assert "the last motion ended before its goal: away for 300 ms" in out
    assert "late (SERVER_LATE, 149)" in out
    assert "remedy: read the log" in out
