from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs.data.stored_documents import opened

from openpendant.server.store.sqlite_store import SqliteStore


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "store.db"


@pytest.fixture
def store(path: Path) -> Iterator[SqliteStore]:
    with opened(path) as store:
        yield store
