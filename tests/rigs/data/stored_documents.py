"""A store in a fresh file with a clock of its own, shared by the tests of the store."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from openpendant.server.store.documents import DocumentKind, Store
from openpendant.server.store.requests import Answer, Request, perform
from openpendant.server.store.sqlite_store import SqliteStore, open_store
from openpendant.server.store.store_errors import StoreError

ANN, BOB = "ann", "bob"
NOON = "2025-11-21T12:00:00+00:00"


def noon() -> str:
    return NOON


@contextlib.contextmanager
def opened(path: Path, wall_clock: Callable[[], str] = noon) -> Iterator[SqliteStore]:
    with contextlib.closing(open_store(path, wall_clock=wall_clock)) as store:
        yield store


def answer_of(store: Store, request: object) -> Answer:
    """Return what a store answers, be it why it refuses."""
    assert isinstance(request, Request)
    try:
        return perform(store, request)
    except StoreError as error:
        return error


def save(store: SqliteStore, name: str, body: str = "{}", revision: int = 0) -> int:
    """Save a program as Ann; return its new revision."""
    kind = DocumentKind.PROGRAM
    return store.save(kind, name, body, expected_revision=revision, author=ANN).revision


def begin_recording(store: SqliteStore, *, columns: str = '["t", "j1"]') -> None:
    """Save the description of a recording `r` as Ann."""
    body = f'{{"columns": {columns}, "robot": "ur5"}}'
    store.save(DocumentKind.RECORDING, "r", body, expected_revision=0, author=ANN)
