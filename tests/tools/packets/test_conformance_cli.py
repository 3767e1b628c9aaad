"""The command line of the conformance tester."""

import asyncio
import json
import signal
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from openpendant.tools.console import ExitCode
from openpendant.tools.packets.conformance import cli
from openpendant.tools.packets.conformance.catalogue import page_with_checks
from openpendant.tools.packets.conformance.check import (
    PASSED,
    CheckFinding,
    Judgement,
    Result,
    deviates,
    failed,
    not_applicable,
)
from openpendant.tools.packets.conformance.cli import main
from openpendant.tools.packets.conformance.server.checks import server_checks

PAGE = Path(__file__).parents[3] / "docs" / "conformance.md"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "needs HOST:MOTION"),
        (["robot"], "not HOST:MOTION"),
        (["robot:port"], "no TCP port"),
        (["robot:0"], "no TCP port"),
        (["robot:1:2:3"], "not HOST:MOTION"),
        (["robot:1", "--only", "ZZ99"], "no check on servers"),
        (["robot:1", "--only", "pendant"], "no check of this profile"),
        (["robot:1", "--robot", "no-such-robot"], "no-such-robot"),
        (["robot:1", "--amplitude", "5"], "accepted are"),
        (["robot:1", "--amplitude", "nan"], "accepted are"),
        (["robot:1", "--joint", "0"], "accepted are 1 to 10"),
        (["robot:1", "--robot", "ur5", "--joint", "7"], "accepted are 1 to 6"),
        (["robot:1", "--role", "both"], "invalid choice"),
        (["robot:1", "--pendant-port", "x"], "no TCP port"),
        (["robot:1", "--dialect", "pendant"], "no controller speaks it"),
        (["robot:1", "--junit", "/no/such/folder/report.xml"], "--junit /no/such/folder"),
        (["robot:1", "--junit", "/"], "--junit /"),
    ],
)
def test_wrong_usage_is_a_sentence_and_exit_code_2(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == ExitCode.USAGE
    assert complaint in capsys.readouterr().err


def test_a_target_that_is_not_there_is_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))
        port = reserved.getsockname()[1]
        assert main([f"127.0.0.1:{port}"]) == ExitCode.REFUSED
    assert f"127.0.0.1:{port} cannot be reached" in capsys.readouterr().err


def test_the_list_names_every_check_of_both_roles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == ExitCode.OK
    listed = capsys.readouterr().out
    for entry in server_checks():
        assert f"{entry.number}  {entry.title}" in listed
    assert "FC01" in listed


@pytest.mark.parametrize(
    ("finding", "code"),
    [
        (PASSED, ExitCode.OK),
        (failed("broken"), ExitCode.FAILED),
        (deviates("somebody: so", "seen"), ExitCode.OK),
        (not_applicable("no eyes"), ExitCode.OK),
    ],
    ids=lambda value: getattr(value, "verdict", value).name,
)
def test_only_a_failed_check_is_exit_code_1(
    finding: CheckFinding,
    code: ExitCode,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    async def judge(*_: object, **__: object) -> Judgement:
        return Judgement("server x", "server", (Result(server_checks()[0], finding),))

    monkeypatch.setattr(cli, "judge", judge)
    report = tmp_path / "report.xml"
    assert main(["robot:1", "--json", "--junit", str(report)]) == code
    (result,) = json.loads(capsys.readouterr().out)["results"]
    assert result["verdict"] == finding.verdict.value
    assert "FS01" in report.read_text(encoding="utf-8")


def test_an_interrupted_run_prints_what_it_has_and_is_exit_code_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def judge(*_: object, on_start: Callable[..., None], **__: object) -> Judgement:
        interrupted = asyncio.Event()
        on_start(interrupted.set)
        signal.raise_signal(signal.SIGTERM)
        await asyncio.wait_for(interrupted.wait(), 5)
        finding = not_applicable("interrupted")
        return Judgement("server x", "server", (Result(server_checks()[0], finding),))

    monkeypatch.setattr(cli, "judge", judge)
    assert main(["robot:1", "--yes-it-may-move", "--json"]) == ExitCode.INTERRUPTED
    captured = capsys.readouterr()
    assert json.loads(captured.out)["counts"]["not applicable"] == 1
    assert "STOP is sent" in captured.err


def test_a_hang_up_that_is_ignored_as_under_nohup_stays_ignored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def judge(*_: object, on_start: Callable[..., None], **__: object) -> Judgement:
        on_start(lambda: None)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        return Judgement("server x", "server", ())

    monkeypatch.setattr(cli, "judge", judge)
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        main(["robot:1", "--yes-it-may-move", "--json"])
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_help_tells_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == ExitCode.OK
    told = capsys.readouterr().out
    assert "3 target not reachable" in told
    assert "130 interrupted" in told


def test_the_page_lists_the_checks_that_there_are() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page_with_checks(page) == page, (
        "run python -m openpendant.tools.packets.conformance.catalogue docs/conformance.md"
    )


def test_a_page_without_the_marks_is_left_alone() -> None:
    with pytest.raises(ValueError, match="missing"):
        page_with_checks("# Nothing\n")
