"""A broken store is set aside as it was: neither it nor its log is written to or removed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from rigs.data.stored_documents import opened, save

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


DAMAGES: list[Callable[[bytes, bytes], tuple[bytes, bytes]]] = [
    lambda file, log: (NO_STORE, log[:1_000]),
    lambda file, log: (NO_STORE, b"what the broken one wrote last\n" * 40),
    lambda file, log: (file[:6_000], log),
    lambda file, log: (file[:6_000], bytes(32) + log[32:]),
]


@pytest.mark.parametrize("damage", DAMAGES)
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
