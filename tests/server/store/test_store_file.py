"""Opening: sound files open, older ones are upgraded, all others are left as they are."""

import contextlib
import errno
import logging
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest.mock import Mock

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.data.stored_documents import opened, save

from openpendant.server.cli import store_commands
from openpendant.server.store import sqlite_file, store_errors
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.sqlite_file import MIGRATIONS, Migration
from openpendant.server.store.sqlite_store import open_for_reading, open_store

LATEST = MIGRATIONS[-1].version
NEXT = Migration(LATEST + 1, ("ALTER TABLE revision ADD COLUMN note TEXT NOT NULL DEFAULT ''",))
BROKEN_STEP = Migration(LATEST + 2, ("CREATE TABLE other (a)", "CREATE TABLE other (a)"))

PROGRAM = DocumentKind.PROGRAM


def fill(path: Path) -> None:
    with opened(path) as store:
        for number in range(20):
            save(store, f"p{number}", f'{{"text": "{"x" * 2_000}"}}')


def names(path: Path) -> list[str]:
    beside = ("store.db-wal", "store.db-shm")  # readers may leave them behind, empty
    return sorted(file.name for file in path.parent.iterdir() if file.name not in beside)


def test_a_new_file_and_its_folder_are_made_for_the_owner_only(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "store.db"
    with opened(path):
        assert path.stat().st_mode & 0o777 == 0o600
        log = path.with_name("store.db-wal")
        assert not log.exists() or log.stat().st_mode & 0o777 == 0o600


def test_a_name_with_signs_of_an_address_is_a_file_name_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "a?b#c%20 d.db"
    fill(path)
    assert path.is_file()


def test_an_older_file_is_upgraded_after_a_copy_was_made(path: Path) -> None:
    fill(path)
    store = open_store(path, migrations=[*MIGRATIONS, NEXT])
    assert store.connection.execute("PRAGMA user_version").fetchone() == (NEXT.version,)
    assert store.connection.execute("SELECT note FROM revision LIMIT 1").fetchone() == ("",)
    assert len(store.headings()) == 20
    kept = store.before_upgrade
    store.close()
    assert kept == path.with_name(f"store.db.version-{LATEST}-1")
    assert kept is not None
    with opened(kept) as before:
        assert len(before.headings()) == 20


def test_an_upgrade_that_fails_leaves_the_older_file_as_it_was(path: Path) -> None:
    fill(path)
    with pytest.raises(store_errors.StoreFailed, match="already exists"):
        open_store(path, migrations=[*MIGRATIONS, NEXT, BROKEN_STEP])
    with opened(path) as store:
        assert len(store.headings()) == 20
        columns = store.connection.execute("PRAGMA table_info(revision)").fetchall()
        assert "note" not in [column[1] for column in columns]


def test_a_file_of_a_later_version_is_refused_and_left_alone(path: Path) -> None:
    fill(path)
    open_store(path, migrations=[*MIGRATIONS, NEXT]).close()
    before = path.read_bytes()
    for open_it in (open_store, open_for_reading):
        with pytest.raises(store_errors.StoreTooNew) as refused:
            open_it(path)
        assert (refused.value.found, refused.value.known) == (NEXT.version, LATEST)
    assert path.read_bytes() == before


def test_a_database_of_another_program_is_refused_and_left_alone(path: Path) -> None:
    with contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("CREATE TABLE theirs (a)")
    before = path.read_bytes()
    for open_it in (open_store, open_for_reading):
        with pytest.raises(store_errors.ForeignFile, match="another program"):
            open_it(path)
    assert path.read_bytes() == before
    assert names(path) == ["store.db"]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda content: content[: len(content) // 2],
    # From the second page on: that is where the tables begin.
    "garbage in the middle": lambda content: (
        content[:4096] + random.Random(1).randbytes(8192) + content[12288:]
    ),
    "zeros": lambda content: bytes(len(content)),
    "garbage at the begin": lambda content: random.Random(2).randbytes(100) + content[100:],
    "a begin alone": lambda content: content[:100],
    "another file": lambda content: b"no database at all\n",
    "0 bytes": lambda content: b"",
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_broken_file_is_set_aside_aloud_and_an_empty_store_begins(
    path: Path, damage: Callable[[bytes], bytes], caplog: pytest.LogCaptureFixture
) -> None:
    """Promise 22: nothing is ever overwritten; of an empty one nobody knows who had an account."""
    fill(path)
    broken = damage(path.read_bytes())
    path.write_bytes(broken)
    with caplog.at_level(logging.ERROR), opened(path) as store:
        assert store.set_aside == path.with_name("store.db.broken-1")
        assert store.headings() == ()
        assert save(store, "after") == 1
    assert path.with_name("store.db.broken-1").read_bytes() == broken
    assert "store.db.broken-1" in caplog.text
    assert broken or "0 bytes" in caplog.text
    assert len(caplog.records) == 1


def test_every_broken_file_is_kept(path: Path) -> None:
    for number in range(1, 4):
        path.write_bytes(b"broken %d" % number)
        with opened(path) as store:
            assert store.set_aside == path.with_name(f"store.db.broken-{number}")
    for number in range(1, 4):
        assert path.with_name(f"store.db.broken-{number}").read_bytes() == b"broken %d" % number


@pytest.mark.parametrize(
    ("content", "words"), [(b"broken", "not a database"), (b"", "0 bytes"), (None, "no such file")]
)
def test_what_is_unreadable_is_left_as_it_is(path: Path, content: bytes | None, words: str) -> None:
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(store_errors.StoreFailed, match=words):
        open_for_reading(path)
    assert names(path) == ([] if content is None else ["store.db"])
    assert content is None or path.read_bytes() == content


def test_a_log_cut_anywhere_loses_no_earlier_change(path: Path) -> None:
    """Promise 22: as after a loss of power in the middle of a write."""
    copies = []
    with opened(path) as store:
        for number in range(10):
            save(store, f"p{number}")
        main, log = path.read_bytes(), path.with_name("store.db-wal").read_bytes()
        rng = random.Random(3)
        sizes = [0, 31, len(log), *(rng.randrange(len(log)) for _ in range(5))]
        for number, size in enumerate(sizes):
            copy = path.with_name(f"copy{number}.db")
            copy.write_bytes(main)
            copy.with_name(f"{copy.name}-wal").write_bytes(log[:size])
            copies.append((size, copy))
    kept = []
    for _, copy in sorted(copies):
        with opened(copy) as store:
            assert store.set_aside is None
            kept.append(len(store.headings()))
            found = [heading.name for heading in store.headings()]
            assert found == [f"p{number}" for number in range(kept[-1])]
    assert kept == sorted(kept)
    assert kept[-1] == 10


@pytest.mark.parametrize("target", ["folder", "missing/parent/is/a/file"])
def test_what_cannot_be_opened_is_told_with_the_system_s_words(path: Path, target: str) -> None:
    (path.parent / "folder").mkdir()
    (path.parent / "missing").write_text("")
    with pytest.raises(store_errors.StoreError, match=r"open|directory|exists"):
        open_store(path.parent / target)


def test_two_processes_may_make_the_file_at_once(path: Path) -> None:
    ready = threading.Barrier(4)

    def run(_: int) -> None:
        ready.wait()
        open_store(path).close()

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(run, range(4)))
    assert names(path) == ["store.db", "store.db-reserve"]


def test_a_copy_of_a_store_in_use_is_a_store_of_its_own(path: Path) -> None:
    copy = path.with_name("copy.db")
    with opened(path) as writer:
        save(writer, "weld", '{"speed": 1}')
        reader = open_for_reading(path)
        sqlite_file.copy(reader.connection, copy)
        reader.close()
        save(writer, "weld", '{"speed": 2}', 1)
    assert copy.stat().st_mode & 0o777 == 0o600
    with opened(copy) as store:
        assert store.load(PROGRAM, "weld").body == '{"speed": 1}'


def test_a_copy_overwrites_nothing(path: Path) -> None:
    with opened(path) as store:
        path.with_name("copy.db").write_text("mine")
        with pytest.raises(store_errors.StoreFailed, match=r"copy\.db: File exists"):
            sqlite_file.copy(store.connection, path.with_name("copy.db"))
    assert path.with_name("copy.db").read_text() == "mine"
    assert names(path) == ["copy.db", "store.db", "store.db-reserve"]


@pytest.fixture(params=["links", "no links, as on a USB stick"])
def has_links(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param != "links":
        not_permitted = PermissionError(errno.EPERM, "Operation not permitted")
        monkeypatch.setattr(os, "link", Mock(side_effect=not_permitted))


@pytest.mark.usefixtures("has_links")
def test_of_two_copies_of_one_name_the_later_is_refused_and_the_first_is_whole(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = path.with_name("copy.db")
    fill(path)
    look = sqlite_file.integrity

    def other_is_faster(connection: sqlite3.Connection, *, thorough: bool) -> list[str]:
        with monkeypatch.context() as patch, contextlib.closing(open_for_reading(path)) as other:
            patch.setattr(sqlite_file, "integrity", look)
            sqlite_file.copy(other.connection, copy)
        return look(connection, thorough=thorough)

    with contextlib.closing(open_for_reading(path)) as store:
        monkeypatch.setattr(sqlite_file, "integrity", other_is_faster)
        with pytest.raises(store_errors.StoreFailed, match=r"copy\.db: File exists"):
            sqlite_file.copy(store.connection, copy)
    monkeypatch.undo()
    assert names(path) == ["copy.db", "store.db", "store.db-reserve"]
    with opened(copy) as store:
        assert len(store.headings()) == 20


@pytest.mark.usefixtures("has_links")
def test_a_failed_copy_leaves_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(path)
    monkeypatch.setattr(sqlite_file, "integrity", lambda connection, thorough: ["page 7 is torn"])
    with contextlib.closing(open_for_reading(path)) as store:
        with pytest.raises(store_errors.StoreFailed, match="page 7 is torn"):
            sqlite_file.copy(store.connection, path.with_name("copy.db"))
    assert names(path) == ["store.db", "store.db-reserve"]


KILLS = """
import os, signal, sys
from pathlib import Path
from openpendant.server.cli import store_commands
from openpendant.server.store import sqlite_file, sqlite_store

def kill(*arguments, **named):
    os.kill(os.getpid(), signal.SIGKILL)

where, store, *copy = sys.argv[1:]
setattr(os if where == "link" else sqlite_file, where, kill)
if copy:
    store_commands.main(["backup", *copy, "--store", store])
else:
    sqlite_store.open_store(Path(store))
"""


def kill_at(where: str, *paths: Path) -> None:
    """Kill a backup of a store into a copy, or the start of a store alone."""
    command = [sys.executable, "-c", KILLS, where, *map(str, paths)]
    killed = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
    assert killed.returncode == -signal.SIGKILL, killed.stderr


@pytest.mark.parametrize("where", ["integrity", "link"])
def test_a_killed_backup_takes_no_name_and_the_next_succeeds(path: Path, where: str) -> None:
    fill(path)
    copy = path.with_name("monday.db")
    kill_at(where, path, copy)
    assert not copy.exists()
    assert store_commands.main(["backup", str(copy), "--store", str(path)]) == 0
    with opened(copy) as store:
        assert len(store.headings()) == 20


def test_what_is_opened_for_reading_cannot_be_changed(path: Path) -> None:
    fill(path)
    before = path.read_bytes()
    with contextlib.closing(open_for_reading(path)) as store:
        assert len(store.headings()) == 20
        with pytest.raises(store_errors.ReadOnly, match="reading only"):
            save(store, "more")
    assert path.read_bytes() == before


def test_a_first_start_that_is_killed_is_a_first_start_again(path: Path) -> None:
    kill_at("_upgrade", path)
    with opened(path) as store:
        assert store.set_aside is None
        assert save(store, "weld") == 1


NO_STORE = b"no database at all\n" * 400


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    path = tmp_path_factory.mktemp("left") / "store.db"
    with opened(path) as store:
        for number in range(20):
            save(store, f"p{number}", f'{{"text": "{"x" * 2_000}"}}')
        log = path.with_name("store.db-wal")
        copies = [shutil.copy(each, each.with_suffix(".copy")) for each in (path, log)]
        file, kept = (Path(copy).read_bytes() for copy in copies)
    assert kept
    return file, kept


DAMAGES_WITH_LOG: list[Callable[[bytes, bytes], tuple[bytes, bytes]]] = [
    lambda file, log: (NO_STORE, log[:1_000]),
    lambda file, log: (NO_STORE, b"what the broken one wrote last\n" * 40),
    lambda file, log: (file[:6_000], log),
    lambda file, log: (file[:6_000], bytes(32) + log[32:]),
]


@pytest.mark.parametrize("damage", DAMAGES_WITH_LOG)
def test_a_broken_store_and_its_log_are_kept_byte_for_byte(
    left: tuple[bytes, bytes], damage: Callable[[bytes, bytes], tuple[bytes, bytes]], tmp_path: Path
) -> None:
    path = tmp_path / "store.db"
    file, log = damage(*left)
    path.write_bytes(file)
    path.with_name("store.db-wal").write_bytes(log)
    with opened(path) as store:
        assert store.set_aside == path.with_name("store.db.broken-1")
        assert store.headings() == ()
    assert path.with_name("store.db.broken-1").read_bytes() == file
    assert path.with_name("store.db.broken-1-wal").read_bytes() == log
