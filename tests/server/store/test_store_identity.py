"""A store that is no longer the file of its name refuses to save, and says why (promise 23)."""

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs.data.stored_documents import begin_recording, opened, save

from openpendant.server.cli import store_commands
from openpendant.server.store import sqlite_file, sqlite_store
from openpendant.server.store.database_file import NotOurFile
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.sqlite_store import SqliteStore, open_store
from openpendant.server.store.store_errors import StoreError, StoreFailed
from openpendant.simplemsg.verdicts import VerdictCode as V

PROGRAM = DocumentKind.PROGRAM
LARGE = '{"text": "' + "x" * 9_000 + '"}'


@pytest.fixture
def store(path: Path) -> Iterator[SqliteStore]:
    with opened(path) as store:
        with contextlib.closing(sqlite_store.open_for_reading(path)) as reader:
            sqlite_file.copy(reader.connection, path.with_name("older.db"))
        save(store, "weld")
        yield store


def log_merged(store: SqliteStore) -> None:
    store.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


# What becomes of it, and the words for that.


COMMANDS = {
    "deleted": "rm store.db",
    "moved away": "mv store.db elsewhere.db",
    "folder moved away": 'mv "$PWD" "$PWD-elsewhere"',
    "a directory now": "rm store.db && mkdir store.db",
    "a link now": "mv store.db elsewhere.db && ln -s elsewhere.db store.db",
    "a link to nothing now": "rm store.db && ln -s nowhere.db store.db",
    "a pipe now": "rm store.db && mkfifo store.db",
    "an older copy put there": "mv older.db store.db",
    "an older copy written over it": "cat older.db > store.db",
    "log deleted": "rm store.db-wal",
    "log replaced": "cp store.db-wal copy-wal && mv copy-wal store.db-wal",
    "index deleted": "rm store.db-shm",
}


def change(path: Path, how: str) -> None:
    """Do to a store's file, its folder, its log or its index what is told in words."""
    subprocess.run(COMMANDS[how], shell=True, check=True, cwd=path.parent)


CHANGES = {
    "deleted": r"store\.db: is not there any more",
    "moved away": r"store\.db: is not there any more",
    "folder moved away": r"store\.db: is not there any more",
    "a directory now": r"store\.db: is a directory now",
    "a link now": r"store\.db: is a link to elsewhere\.db now",
    "a link to nothing now": r"store\.db: is a link to nowhere\.db now",
    "a pipe now": r"store\.db: is a pipe now",
    "an older copy put there": r"store\.db: is another file now",
    "log deleted": r"store\.db-wal: is not there any more",
    "log replaced": r"store\.db-wal: is another file now",
    "index deleted": r"store\.db-shm: is not there any more",
}
changes = pytest.mark.parametrize(("how", "words"), CHANGES.items(), ids=CHANGES)


@changes
def test_the_next_change_is_refused_and_says_what_became_of_the_file(
    store: SqliteStore, path: Path, how: str, words: str
) -> None:
    change(path, how)
    for _ in range(3):
        with pytest.raises(NotOurFile, match=words) as refused:
            save(store, "more")
        assert refused.value.refusal().code == V.STORE_FAILED
    with pytest.raises(NotOurFile, match=words):
        store.delete(PROGRAM, "weld", expected_revision=1, author="ann")
    assert store.load(PROGRAM, "weld").body == "{}"


@changes
def test_a_change_that_was_under_way_is_not_acknowledged(
    store: SqliteStore, path: Path, how: str, words: str
) -> None:
    with contextlib.ExitStack() as under_way:
        under_way.enter_context(pytest.raises(NotOurFile, match=words))
        under_way.enter_context(store.together())
        save(store, "more")
        change(path, how)


@pytest.mark.parametrize("size", ["{}", LARGE], ids=["in the log", "larger than the log"])
def test_an_older_copy_that_is_written_over_the_file_is_noticed_before_the_next_acknowledgement(
    store: SqliteStore, path: Path, size: str
) -> None:
    """Its name and inode stay, so that only its content tells."""
    for number in range(60):
        save(store, f"p{number}", size)
    log_merged(store)
    save(store, "after")
    change(path, "an older copy written over it")
    for _ in range(3):
        with pytest.raises(NotOurFile, match="holds an older state"):
            save(store, "more")


def test_an_older_copy_that_lacks_only_chunks_is_noticed(path: Path) -> None:
    older = path.with_name("before.db")
    with opened(path) as store:
        begin_recording(store)
        store.append_chunk("r", 0, bytes(16))
        sqlite_file.copy(store.connection, older)
        store.append_chunk("r", 1, bytes(16))
        log_merged(store)
        store.append_chunk("r", 2, bytes(16))
        shutil.copyfile(older, path)
        with pytest.raises(NotOurFile, match="holds an older state"):
            store.append_chunk("r", 3, bytes(16))


def test_rubbish_that_is_written_over_the_file_is_noticed(store: SqliteStore, path: Path) -> None:
    log_merged(store)
    save(store, "after")
    path.write_bytes(b"not a database" * 1_000)
    with pytest.raises(NotOurFile, match="is no store any more"):
        save(store, "more")


def test_a_file_that_was_moved_back_is_saved_in_again(store: SqliteStore, path: Path) -> None:
    away = path.with_name("elsewhere.db")
    path.rename(away)
    with pytest.raises(NotOurFile):
        save(store, "more")
    away.rename(path)
    assert save(store, "more") == 1


# What is no reason to refuse.


def test_what_the_store_does_itself_alarms_nobody(path: Path) -> None:
    with opened(path) as store:
        for number in range(30):
            save(store, f"p{number}", LARGE)
        for revision in range(1, 40):
            save(store, "p0", LARGE, revision)
        begin_recording(store)
        for number in range(20):
            store.append_chunk("r", number, bytes(60_000))
        store.delete(DocumentKind.RECORDING, "r", expected_revision=1, author="ann")
        log_merged(store)
        store.connection.execute("VACUUM")
        assert save(store, "after") == 1


def test_another_process_that_saves_and_merges_the_log_alarms_nobody(path: Path) -> None:
    with opened(path) as server, opened(path) as command:
        for number in range(40):
            save(command, f"c{number}", LARGE)
            save(server, f"s{number}", LARGE)
        log_merged(command)
        save(server, "after")
        log_merged(command)
        save(command, "again")
        assert len(server.headings()) == 82


def test_a_store_behind_a_link_from_the_start_is_served(path: Path) -> None:
    with opened(path) as store:
        save(store, "weld")
    link = path.with_name("link.db")
    link.symlink_to(path.name)
    with opened(link) as store:
        assert save(store, "more") == 1
        other = path.with_name("other.db")
        shutil.copy(path, other)
        link.unlink()
        link.symlink_to(other.name)
        with pytest.raises(NotOurFile, match="is a link to other"):
            save(store, "again")


# The start after it.


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("a directory now", "is a directory; a store is a file"),
        ("a link to nothing now", r"is a link to nowhere\.db, which is not there"),
        ("a pipe now", "is a pipe; a store is a file"),
    ],
)
def test_a_start_names_what_is_no_file_and_leaves_it_alone(
    path: Path, how: str, words: str
) -> None:
    with opened(path) as store:
        save(store, "weld")
    change(path, how)
    kind = path.lstat().st_mode
    for open_it in (open_store, sqlite_store.open_for_reading):
        with pytest.raises(StoreFailed, match=words):
            open_it(path)
    assert store_commands.main(["list", "--store", str(path)]) == 3
    assert path.lstat().st_mode == kind
    assert not list(path.parent.glob("*broken*"))


def test_a_store_behind_a_link_whose_target_is_replaced_is_noticed(path: Path) -> None:
    link = path.with_name("link.db")
    link.symlink_to(path.name)
    with opened(path) as store:
        save(store, "weld")
    with opened(link) as store:
        copy = path.with_name("copy.db")
        shutil.copy(path, copy)
        os.replace(copy, path)
        with pytest.raises(NotOurFile, match="which is not the file that was opened"):
            save(store, "more")


KILLED = """
import os, shutil, sys
from pathlib import Path
from rigs.data.stored_documents import opened, save
from openpendant.server.store import sqlite_file

path, older = Path(sys.argv[1]), Path(sys.argv[2])
with opened(path) as store:
    save(store, "kept")
    sqlite_file.copy(store.connection, older)
    for number in range(100):
        save(store, f"p{number}")
    os._exit(0)
"""


def killed(path: Path) -> None:
    command = [sys.executable, "-c", KILLED, str(path), str(path.with_name("older.db"))]
    tests = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run(command, env=tests, check=True)
    assert path.with_name("store.db-wal").stat().st_size


@pytest.mark.parametrize("is_killed", [False, True], ids=["closed", "killed"])
@pytest.mark.parametrize("how", ["deleted", "moved away"])
def test_a_start_without_the_file_is_the_first_and_takes_no_log_of_a_killed_server(
    path: Path, how: str, is_killed: bool
) -> None:
    if is_killed:
        killed(path)
    else:
        with opened(path) as store:
            save(store, "weld")
    change(path, how)
    with opened(path) as store:
        assert store.headings() == ()
        assert save(store, "weld") == 1
    assert len(list(path.parent.glob("store.db.lost-*-wal"))) == int(is_killed)
    assert sqlite_store.check_store(path).problems == ()


def test_an_older_copy_beside_a_killed_servers_log_is_served_or_set_aside_whole(path: Path) -> None:
    killed(path)
    change(path, "an older copy put there")
    with opened(path) as store:
        names = [heading.name for heading in store.headings()]
        assert names == [] if store.set_aside else "kept" in names
        assert save(store, "weld") == 1
    assert sqlite_store.check_store(path).problems == ()


@pytest.mark.parametrize("how", ["an older copy written over it", "an older copy put there"])
def test_a_start_serves_an_older_copy_whole(path: Path, how: str) -> None:
    """However the server that was open ended: the log of the lost file is mixed into no other."""
    older = path.with_name("older.db")
    with opened(path) as store:
        save(store, "kept")
        sqlite_file.copy(store.connection, older)
        for number in range(60):
            save(store, f"p{number}", LARGE)
        log_merged(store)
        save(store, "after")
        change(path, how)
        with pytest.raises(NotOurFile):
            save(store, "more")
    with opened(path) as store:
        assert [heading.name for heading in store.headings()] == ["kept"]
        assert save(store, "more") == 1
    assert sqlite_store.check_store(path).problems == ()


def test_the_saves_in_the_log_of_a_lost_file_are_kept_beside(path: Path) -> None:
    older = path.with_name("older.db")
    with opened(path) as store:
        save(store, "kept")
        sqlite_file.copy(store.connection, older)
        save(store, "after")
        log_merged(store)
        save(store, "in the log")
        change(path, "an older copy written over it")
        with pytest.raises(StoreError):
            save(store, "more")
    (log,) = path.parent.glob("store.db.lost-*-wal")
    assert b"in the log" in log.read_bytes()
