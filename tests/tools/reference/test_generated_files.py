from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from openpendant.tools.reference.__main__ import main
from openpendant.tools.reference.files import generated_files, stale_files, write_files

DOCS = Path(__file__).parents[3] / "docs"
FILES = generated_files()


def test_no_generated_file_is_stale() -> None:
    stale = stale_files(DOCS)
    assert not stale, f"{'; '.join(stale)}. Run: make reference"


def test_generating_twice_gives_the_same_bytes() -> None:
    assert generated_files() == FILES


@pytest.mark.parametrize("path", FILES)
def test_a_generated_file_says_so_at_its_top(path: str) -> None:
    top = FILES[path][:400]
    assert "Generated from the declarations" in top or "openpendant's own encoder" in top


@pytest.fixture(name="written", scope="module")
def _written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    assert main(["--out", str(folder)]) == 0
    return folder


def test_what_was_written_is_not_stale(written: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check", "--out", str(written)]) == 0
    assert capsys.readouterr().err == ""


def _change(file: Path) -> None:
    file.write_text(file.read_text() + "\n")


def _remove(file: Path) -> None:
    file.unlink()


def _add(file: Path) -> None:
    file.with_name("another.lua").write_text("")


@pytest.mark.parametrize(
    ("harm", "complaint"),
    [
        (_change, "generated/openpendant.lua is stale"),
        (_remove, "generated/openpendant.lua is missing"),
        (_add, "generated/another.lua is generated no longer"),
    ],
)
def test_a_stale_file_is_named_with_the_way_to_mend_it(
    harm: Callable[[Path], None],
    complaint: str,
    written: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    harm(written / "generated" / "openpendant.lua")
    assert main(["--check", "--out", str(written)]) == 1
    assert capsys.readouterr().err.splitlines() == [complaint, "run: make reference"]
    write_files(written)
    assert stale_files(written) == []


def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file")]) == 2
    assert "file" in capsys.readouterr().err
