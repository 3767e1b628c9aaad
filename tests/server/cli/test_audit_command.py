import json
from pathlib import Path

import pytest

from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.access.audit_file import AuditFile, Stamped, all_files
from openpendant.server.cli.audit_commands import main

Capture = pytest.CaptureFixture[str]

TIME = "2026-01-02T03:04:05.678+00:00"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "audit.jsonl"
    file = AuditFile(path, most_bytes=600)
    for n, who in enumerate(["ann", "otto", "b\x1b[2J\n‮d", "ann"]):
        entry = AuditEntry(AuditEvent.JOG_BEGAN, n, who=who, role="admin", detail={"joint": n})
        file.append(Stamped(entry, TIME))
    file.append(Stamped(AuditEntry(AuditEvent.STOP, 4, who="ann", source="192.0.2.1"), TIME))
    file.close()
    assert len(all_files(path)) > 1
    return path


def test_a_log_is_shown_in_words_without_control_characters(log: Path, capsys: Capture) -> None:
    """Promise 30: what was escaped in the file is escaped on the terminal."""
    assert main(["show", str(log)]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[0] == f"{TIME} jog-began ann (admin) joint=0"
    assert shown[2] == f"{TIME} jog-began b\\x1b[2J\\n\\u202ed (admin) joint=2"
    assert shown[-1] == f"{TIME} stop ann from 192.0.2.1"
    assert all(line.isprintable() for line in shown)


@pytest.mark.parametrize(
    ("options", "numbers"),
    [
        ([], [1, 2, 3, 4, 5]),
        (["--who", "ann"], [1, 4, 5]),
        (["--event", "stop"], [5]),
        (["--last", "2"], [4, 5]),
        (["--who", "ann", "--last", "1"], [5]),
    ],
)
def test_entries_can_be_chosen(
    log: Path, capsys: Capture, options: list[str], numbers: list[int]
) -> None:
    assert main(["show", str(log), "--json", *options]) == 0
    shown = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [record["n"] for record in shown] == numbers


def test_an_intact_log_is_told_with_its_last_hash(log: Path, capsys: Capture) -> None:
    assert main(["verify", str(log), "--json"]) == 0
    verdict = json.loads(capsys.readouterr().out)
    assert (verdict["intact"], verdict["lines"], verdict["last"]) == (True, 5, 5)
    assert main(["verify", str(log), "--anchor", verdict["hash"]]) == 0
    assert main(["verify", str(log), "--anchor", "00" * 32]) == 1


def test_an_edited_log_is_told_with_the_line(log: Path, capsys: Capture) -> None:
    oldest = all_files(log)[0]
    oldest.write_bytes(oldest.read_bytes().replace(b'"who":"otto"', b'"who":"ann"'))
    assert main(["verify", str(log)]) == 1
    assert "line 2 is torn or was altered" in capsys.readouterr().out


def test_a_log_without_its_oldest_file_is_broken_unless_that_is_meant(log: Path) -> None:
    all_files(log)[0].unlink()
    assert main(["verify", str(log)]) == 1
    assert main(["verify", str(log), "--from-the-middle"]) == 0


@pytest.mark.parametrize(
    "arguments", [["verify", "nowhere.jsonl"], ["show", "nowhere.jsonl"], ["show"], ["wrong"]]
)
def test_a_missing_log_and_wrong_usage_are_one_line(arguments: list[str], capsys: Capture) -> None:
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
