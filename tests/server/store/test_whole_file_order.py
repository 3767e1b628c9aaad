from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from openpendant.server.store.database_file import atomic_file


@pytest.mark.parametrize("replace", [False, True])
def test_the_disk_has_the_file_before_its_name_and_the_name_before_it_counts(
    replace: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "copy.db"
    if replace:
        target.write_bytes(b"old")
    told: list[str] = []
    calls = {name: getattr(os, name) for name in ("fsync", "link", "replace")}

    def fsync(descriptor: int) -> None:
        is_folder = os.path.sameopenfile(descriptor, folder)
        told.append("the folder is kept" if is_folder else f"{target_now()} is kept")
        calls["fsync"](descriptor)

    def target_now() -> str:
        return "the whole file" if beside.read_bytes() == b"new" else "half a file"

    def named(name: str) -> Any:
        def call(*args: Any) -> None:
            told.append("it gets its name")
            calls[name](*args)

        return call

    folder = os.open(tmp_path, os.O_RDONLY)
    try:
        with atomic_file(target, replace=replace) as beside:
            beside.write_bytes(b"new")
            monkeypatch.setattr(os, "fsync", fsync)
            for name in ("link", "replace"):
                monkeypatch.setattr(os, name, named(name))
        monkeypatch.undo()
    finally:
        os.close(folder)
    assert told == ["the whole file is kept", "it gets its name", "the folder is kept"]
    assert target.read_bytes() == b"new"
