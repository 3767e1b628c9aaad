"""What server and emulator did in twelve conversations, to the byte, they do today.

Another version says another name in its hello: before a version is changed, the journals are
recorded anew (`record.py`) with what is behind it unchanged.
"""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest
from frozen.conversations import CONVERSATIONS
from frozen.frozen_files import JOURNALS

from openpendant.simplemsg import __version__
from openpendant.tools.packets.rerun import main as rerun

EVENTS = {
    *("opened", "closed", "in", "up", "down", "tick", "operate", "planned", "stored"),
    *("accounts", "checked", "account", "shut-down", "hang-up"),
}
QUESTIONS = {"gone", "paired", "stopped"}


def unpacked(folder: Path) -> list[Path]:
    """Write the frozen journals to a folder, as `packets rerun` reads them."""
    files = []
    for packed in sorted(JOURNALS.glob("*.journal.gz")):
        files.append(folder / packed.stem)
        files[-1].write_bytes(gzip.decompress(packed.read_bytes()))
    return files


def run_again(files: list[Path], capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    code = rerun([*map(str, files), "--json"])
    told = capsys.readouterr()
    assert told.err == ""
    reports = [json.loads(line) for line in told.out.splitlines()]
    assert code == (0 if all(report["identical"] for report in reports) else 1)
    return reports


def test_every_conversation_runs_again_without_a_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = unpacked(tmp_path)
    assert [file.name for file in files] == [
        f"{name}.{kind}.journal"
        for name in sorted(CONVERSATIONS)
        for kind in ("emulator", "server")
    ]
    reports = run_again(files, capsys)
    assert {report["version"] for report in reports} == {__version__}
    found = {
        Path(report["file"]).name: report["difference"]
        for report in reports
        if not report["identical"]
    }
    assert not found, "\n".join(f"{name}: {how}" for name, how in found.items())
    # None was left out, and none ended early.
    lines = [list(map(json.loads, file.read_text("ascii").splitlines())) for file in files]
    assert [report["events"] for report in reports] == [
        sum("on" in line for line in each) for each in lines
    ]
    assert [report["bytes_out"] for report in reports] == [
        sum(len(line["hex"]) // 2 for line in each if "out" in line) for each in lines
    ]


def test_the_conversations_hold_every_kind_of_event() -> None:
    lines = [
        json.loads(line)
        for packed in JOURNALS.glob("*.journal.gz")
        for line in gzip.decompress(packed.read_bytes()).splitlines()
    ]
    assert {line["on"] for line in lines if "on" in line} == EVENTS
    assert {line["ask"] for line in lines if "ask" in line} == QUESTIONS


@pytest.mark.parametrize("kind", ["emulator", "server"])
def test_a_single_byte_that_differs_is_told(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (file,) = [each for each in unpacked(tmp_path) if each.name == f"jog.{kind}.journal"]
    lines = file.read_text("ascii").splitlines(keepends=True)
    at = [number for number, line in enumerate(lines) if line.startswith('{"out"')][100]
    noted = json.loads(lines[at])
    data = bytearray.fromhex(noted["hex"])
    data[-1] ^= 1
    lines[at] = json.dumps({**noted, "hex": data.hex()}) + "\n"
    file.write_text("".join(lines), "ascii")
    (report,) = run_again([file], capsys)
    assert not report["identical"]
    assert report["difference"]["event"] == sum('"on": ' in line for line in lines[:at])
