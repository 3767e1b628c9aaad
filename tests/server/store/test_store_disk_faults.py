"""Promise 23: a disk that is full or read-only refuses what is new and keeps what is there."""

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rigs.data.stored_documents import begin_recording, opened, save

from openpendant.server.store.database_file import RESERVE_BYTES
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.sqlite_store import SqliteStore, check_store, open_store
from openpendant.server.store.store_errors import DiskFull, ReadOnly, StoreFailed
from openpendant.simplemsg.verdicts import VerdictCode as V

PROGRAM = DocumentKind.PROGRAM
BODY = '{"text": "' + "x" * 8_000 + '"}'

Mount = Callable[[int], Path]


@pytest.fixture
def mount(tmp_path: Path) -> Iterator[Mount]:
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = False

    def mount(kibibytes: int) -> Path:
        nonlocal mounted
        command = ["mount", "-t", "tmpfs", "-o", f"size={kibibytes}k", "tmpfs", str(folder)]
        if shutil.which("mount") is None or subprocess.run(command, capture_output=True).returncode:
            pytest.skip("a disk cannot be mounted here")
        mounted = True
        return folder

    yield mount
    if mounted:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def fill_up(store: SqliteStore) -> int:
    for number in range(10_000):
        try:
            save(store, f"p{number:05d}", BODY)
        except DiskFull:
            return number
    raise AssertionError("the disk never became full")


def check_all_there(store: SqliteStore, count: int) -> None:
    assert [heading.name for heading in store.headings()] == [f"p{n:05d}" for n in range(count)]
    assert {store.load(PROGRAM, heading.name).body for heading in store.headings()} == {BODY}


def test_a_full_file_refuses_what_is_new_and_saves_again_once_there_is_room(tmp_path: Path) -> None:
    with opened(tmp_path / "store.db") as store:
        store.connection.execute("PRAGMA max_page_count = 40")
        saved = fill_up(store)
        assert saved > 5
        for _ in range(3):
            with pytest.raises(DiskFull, match="full") as refused:
                save(store, "more", BODY)
        assert refused.value.refusal().code == V.DISK_FULL
        check_all_there(store, saved)
        store.connection.execute("PRAGMA max_page_count = 4000")
        save(store, "more", BODY)
    assert check_store(tmp_path / "store.db").problems == ()


def test_a_full_disk_refuses_what_is_new_and_saves_again_once_there_is_room(mount: Mount) -> None:
    disk = mount(1024)
    path = disk / "store.db"
    with opened(path) as store:
        ballast = disk / "ballast"
        ballast.write_bytes(bytes(128 << 10))
        saved = fill_up(store)
        assert saved > 5
        check_all_there(store, saved)
        ballast.unlink()
        save(store, f"p{saved:05d}", BODY)
        check_all_there(store, saved + 1)
    assert check_store(path).problems == ()


def take_the_rest(disk: Path, number: int = 1) -> None:
    file = os.open(disk / f"other-{number}", os.O_CREAT | os.O_WRONLY)
    with contextlib.suppress(OSError):
        while True:
            os.write(file, bytes(4096))
    os.close(file)


@pytest.mark.parametrize("documents", [6, 25])
def test_on_a_disk_full_to_the_last_byte_all_can_be_deleted(mount: Mount, documents: int) -> None:
    """Promise 23: others filled it, so that nothing of the store's own gives room."""
    disk = mount(1024)
    path = disk / "store.db"
    with opened(path) as store:
        for number in range(documents):
            save(store, f"p{number}", BODY)
        take_the_rest(disk)
        for number in range(documents):
            store.delete(PROGRAM, f"p{number}", expected_revision=1, author="ann")
            take_the_rest(disk, number + 2)
        assert store.headings() == ()
        for other in disk.glob("other-*"):
            other.unlink()
        save(store, "new", BODY)
    assert path.with_name("store.db-reserve").stat().st_size == RESERVE_BYTES
    assert check_store(path).problems == ()


def test_a_recording_far_larger_than_the_reserve_is_deleted_on_a_full_disk(mount: Mount) -> None:
    disk = mount(12 << 10)
    with opened(disk / "store.db") as store:
        begin_recording(store)
        for number in range(8):
            store.append_chunk("r", number, bytes(1 << 20))
        take_the_rest(disk)
        store.delete(DocumentKind.RECORDING, "r", expected_revision=1, author="ann")
        assert store.headings() == ()


def test_a_store_that_was_closed_is_opened_on_a_disk_that_filled_up_since(mount: Mount) -> None:
    disk = mount(1024)
    with opened(disk / "store.db") as store:
        save(store, "p", BODY)
    take_the_rest(disk)
    with opened(disk / "store.db") as store:
        assert store.load(PROGRAM, "p").body == BODY
        store.delete(PROGRAM, "p", expected_revision=1, author="ann")
        assert store.headings() == ()


def test_a_disk_too_small_for_any_store_is_told_at_once(mount: Mount) -> None:
    disk = mount(64)
    (disk / "ballast").write_bytes(bytes(40 << 10))
    with pytest.raises(StoreFailed, match=r"full|space|I/O"):
        open_store(disk / "store.db")
    (disk / "ballast").unlink()


LIMITED = """
import resource, sys
from pathlib import Path
from rigs.data.stored_documents import opened, save
from openpendant.server.store.store_errors import StoreFailed

with opened(Path(sys.argv[1])) as store:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
    count = 0
    try:
        while True:
            save(store, f"p{count:05d}", '{"text": "' + "x" * 8_000 + '"}')
            count += 1
    except StoreFailed as error:
        print(count, error)
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    save(store, f"p{count:05d}", '{"text": "' + "x" * 8_000 + '"}')
"""


def test_a_write_that_fails_halfway_is_undone(tmp_path: Path) -> None:
    path = tmp_path / "store.db"
    command = [sys.executable, "-c", LIMITED, str(path)]
    tests = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    ran = subprocess.run(command, capture_output=True, text=True, env=tests, check=False)
    assert ran.returncode == 0, ran.stderr
    count = int(ran.stdout.split()[0])
    assert "I/O" in ran.stdout
    with opened(path) as store:
        check_all_there(store, count + 1)


def test_a_read_only_disk_refuses_changes(mount: Mount, caplog: pytest.LogCaptureFixture) -> None:
    path = mount(512) / "store.db"
    with opened(path) as store:
        save(store, "p00000", BODY)
    subprocess.run(["mount", "-o", "remount,ro", str(path.parent)], check=True)
    with opened(path) as store:
        assert store.is_read_only
        check_all_there(store, 1)
        with pytest.raises(ReadOnly) as refused:
            save(store, "more", BODY)
        assert refused.value.refusal().code == V.STORE_READ_ONLY
    assert "nothing can be saved" in caplog.text
    assert check_store(path).problems == ()


def test_a_disk_that_turns_read_only_refuses_changes_and_takes_them_again(mount: Mount) -> None:
    path = mount(512) / "store.db"
    with opened(path) as store:
        save(store, "p00000", BODY)
        # As the system does after a fault of the disk; open files may still be written then, so
        # what SQLite is told is what matters here.
        store.connection.execute("PRAGMA query_only = ON")
        with pytest.raises(ReadOnly, match="readonly"):
            save(store, "p00001", BODY)
        check_all_there(store, 1)
        store.connection.execute("PRAGMA query_only = OFF")
        save(store, "p00001", BODY)
        check_all_there(store, 2)


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_a_file_that_may_only_be_read_is_read(tmp_path: Path) -> None:
    path = tmp_path / "store.db"
    with opened(path) as store:
        save(store, "p00000", BODY)
    path.chmod(0o400)
    with opened(path) as store:
        assert store.is_read_only
        check_all_there(store, 1)
        with pytest.raises(ReadOnly):
            save(store, "more", BODY)
