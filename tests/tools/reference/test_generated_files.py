from collections.abc import Callable
from pathlib import Path

import pytest
from rigs.data.case_table import every

from openpendant.tools.reference import __main__, files
from openpendant.tools.reference.__main__ import main
from openpendant.tools.reference.files import generated_files, stale_files, write_files

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(name="generated", scope="module")
def _generated() -> dict[str, str]:
    return generated_files()


@pytest.fixture(name="once")
def _once(generated: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have what is written and compared generated once, since it comes out the same each time."""
    for module in (files, __main__):
        monkeypatch.setattr(module, "generated_files", lambda: generated)


@pytest.mark.usefixtures("once")
def test_no_generated_file_is_stale() -> None:
    stale = stale_files(DOCS)
    assert not stale, f"{'; '.join(stale)}. Run: make reference"


def test_generating_twice_gives_the_same_bytes(generated: dict[str, str]) -> None:
    assert generated_files() == generated


def test_every_generated_file_says_so_at_its_top(generated: dict[str, str]) -> None:
    every(((path, text[:400]) for path, text in generated.items()), _says_so)


def _says_so(top: str) -> None:
    assert "Generated from the declarations" in top or "openpendant's own encoder" in top


@pytest.fixture(name="written")
def _written(once: None, tmp_path: Path) -> Path:
    assert main(["--out", str(tmp_path)]) == 0
    return tmp_path


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
    harm: Callable[[Path], None], complaint: str, written: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    harm(written / "generated" / "openpendant.lua")
    assert main(["--check", "--out", str(written)]) == 1
    assert capsys.readouterr().err.splitlines() == [complaint, "run: make reference"]
    write_files(written)
    assert stale_files(written) == []


@pytest.mark.usefixtures("once")
def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file")]) == 2
    assert "file" in capsys.readouterr().err
