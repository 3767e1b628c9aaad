"""Promise 22: what the disk was told before something is acknowledged, and in which order.

A test cannot cut the power; that the disk has what was acknowledged shows by the calls that ask it
to. Those of our own code are noted where they are made; those of SQLite by strace, in a process
that saves and says when it was told so.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.data.stored_documents import opened, save

from openpendant.server.cli import store_commands
from openpendant.server.store.database_file import atomic_file


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Notes what the disk is told by our own code: `sync NAME`, `link NAME`, `replace NAME`."""
    calls: list[str] = []

    def noted(word: str, call: Callable[..., None], *arguments: Any) -> None:
        last = arguments[-1]
        name = Path(os.readlink(f"/proc/self/fd/{last}") if word == "sync" else last).name
        calls.append(f"{word} {name}")
        call(*arguments)

    for word, name in (("sync", "fsync"), ("link", "link"), ("replace", "replace")):
        monkeypatch.setattr(os, name, partial(noted, word, getattr(os, name)))
    return calls


linux_only = pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")


@linux_only
@pytest.mark.parametrize(("replace", "call"), [(False, "link"), (True, "replace")])
def test_a_file_has_its_content_on_the_disk_before_its_name_and_then_the_name(
    tmp_path: Path, told: list[str], replace: bool, call: str
) -> None:
    target = tmp_path / "whole"
    with atomic_file(target, replace=replace) as beside:
        beside.write_text("content")
        assert told == []
    assert told == [f"sync {beside.name}", f"{call} whole", f"sync {tmp_path.name}"]
    assert target.read_text() == "content"


@linux_only
def test_a_new_store_has_its_name_on_disk_before_a_save(tmp_path: Path, told: list[str]) -> None:
    with opened(tmp_path / "store.db"):
        made = told.index("link store.db")
        assert re.fullmatch(r"sync store\.db\.partial-\w+", told[made - 1])
        assert told[made + 1] == f"sync {tmp_path.name}"


@linux_only
def test_a_backup_that_is_told_as_written_is_on_the_disk(tmp_path: Path, told: list[str]) -> None:
    path = tmp_path / "store.db"
    with opened(path) as store:
        save(store, "weld")
    told.clear()
    assert store_commands.main(["backup", str(tmp_path / "monday.db"), "--store", str(path)]) == 0
    assert [call.split()[0] for call in told] == ["sync", "link", "sync"]


@linux_only
def test_a_store_set_aside_has_its_new_name_on_the_disk(tmp_path: Path, told: list[str]) -> None:
    path = tmp_path / "store.db"
    path.write_bytes(b"broken" * 1_000)
    with opened(path) as store:
        assert store.set_aside is not None
    assert told.index(f"sync {tmp_path.name}") < told.index("link store.db")


SAVES = """
import os, sys
from pathlib import Path
from rigs.data.stored_documents import begin_recording, opened, save

with opened(Path(sys.argv[1])) as store:
    for number in range(5):
        save(store, f"p{number}")
        os.write(1, b"acknowledged\\n")
    begin_recording(store)
    os.write(1, b"acknowledged\\n")
    for number in range(5):
        store.append_chunk("r", number, bytes(4_000))
        os.write(1, b"acknowledged\\n")
"""

_SYNC = re.compile(r"\bf(?:data)?sync\(\d+<(?P<file>[^>]+)>\)\s*=\s*0")
_WRITE = re.compile(r"\bp?write(?:64)?\(\d+<(?P<file>[^>]+)>")


def calls_while_saving(folder: Path) -> list[str]:
    if shutil.which("strace") is None:
        pytest.skip("strace is not here: what SQLite tells the disk is not looked at")
    log = folder / "calls"
    calls = "trace=fsync,fdatasync,write,pwrite64,rename,renameat,renameat2,link,linkat"
    trace = ["strace", "-f", "-y", "-e", calls, "-o", str(log)]
    command = [*trace, sys.executable, "-c", SAVES, str(folder / "store.db")]
    tests = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    ran = subprocess.run(command, capture_output=True, env=tests, timeout=PATIENCE, check=False)
    if b"ptrace" in ran.stderr or not log.exists():
        pytest.skip("strace may not look at processes here")
    assert ran.returncode == 0, ran.stderr
    return log.read_text(encoding="utf-8").splitlines()


def test_each_acknowledgement_follows_a_sync_of_the_log_that_has_it(tmp_path: Path) -> None:
    calls = calls_while_saving(tmp_path)
    log = str(tmp_path / "store.db-wal")
    told = [number for number, call in enumerate(calls) if '"acknowledged\\n"' in call]
    assert len(told) == 11
    opened_at = max(n for n, call in enumerate(calls[: told[0]]) if "link" in call)
    for before, acknowledged in pairwise([opened_at, *told]):
        between = calls[before + 1 : acknowledged]
        written = [n for n, call in enumerate(between) if _is(_WRITE, call, log)]
        synced = [n for n, call in enumerate(between) if _is(_SYNC, call, log)]
        assert written, "acknowledged, and nothing written"
        assert synced, "acknowledged, and the disk was not told"
        assert synced[-1] > written[-1], "written after the disk was told"


def test_the_file_is_told_to_the_disk_before_its_log_begins_anew(tmp_path: Path) -> None:
    """When the store is closed its log is moved into the file, and then deleted."""
    calls = calls_while_saving(tmp_path)
    file = str(tmp_path / "store.db")
    written = [n for n, call in enumerate(calls) if _is(_WRITE, call, file)]
    synced = [n for n, call in enumerate(calls) if _is(_SYNC, call, file)]
    assert written
    assert synced[-1] > written[-1]


def _is(kind: re.Pattern[str], call: str, file: str) -> bool:
    found = kind.search(call)
    return found is not None and found["file"] == file
