"""The table of faults can be trusted: `make mutants` plants them, this only reads."""

from pathlib import Path

import pytest
from mutants.mutant_table import BadTable, Mutant, parse_rows, problems, read_rows


def test_every_row_can_be_planted_and_names_tests_that_exist() -> None:
    assert problems(read_rows()) == []


def test_second_tries_can_be_switched_off_by_the_name_of_their_plugin(
    pytestconfig: pytest.Config,
) -> None:
    assert pytestconfig.pluginmanager.has_plugin("attempts")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "product.py").write_text("def least(a, b):\n    return min(a, b)\n")
    (tmp_path / "test_product.py").write_text("def test_least():\n    pass\n")
    return tmp_path


def row(**changed: object) -> Mutant:
    values: dict[str, object] = {
        "name": "least-is-greatest",
        "file": "product.py",
        "before": "min(",
        "after": "max(",
        "tests": ("test_product.py::test_least",),
        "room": "room",
    }
    return Mutant(**{**values, **changed})  # type: ignore[arg-type]  # whatever a test spoils


def test_a_sound_row_has_no_problem(project: Path) -> None:
    assert problems([row()], project) == []


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [
        ({"before": "sum("}, "stands 0 times in product.py, not once"),
        ({"before": "a"}, "times in product.py, not once"),
        ({"after": "min( "}, "the change means nothing"),
        ({"after": "min(("}, "does not compile"),
        ({"file": "nowhere.py"}, "nowhere.py is no Python file"),
        ({"name": "Least Is Greatest"}, "small letters"),
        ({"tests": ()}, "no test is named"),
        ({"tests": ("test_nowhere.py",)}, "test_nowhere.py is not there"),
        ({"tests": ("test_product.py::test_most",)}, "no test_most in test_product.py"),
        ({"equivalent": "so"}, "the reason why it is equivalent is missing"),
    ],
)
def test_a_row_that_cannot_be_trusted_is_told(
    project: Path, spoilt: dict[str, object], said: str
) -> None:
    (told,) = problems([row(**spoilt)], project)
    assert told.startswith("room/")
    assert said in told


def test_a_name_that_stands_twice_is_told(project: Path) -> None:
    assert problems([row(), row()], project) == ["least-is-greatest: stands 2 times"]


@pytest.mark.parametrize(
    "text",
    [
        "[[mutant]",
        "[[mutants]]",
        '[[mutant]]\nname = "a"\n',
        '[[mutant]]\nname = "a"\nfile = "f"\nbefore = "b"\nafter = "c"\ntests = []\nwhy = "x"\n',
        '[[mutant]]\nname = "a"\nfile = "f"\nbefore = "b"\nafter = "c"\ntests = "t"\n',
        '[[mutant]]\nname = "a"\nfile = "f"\nbefore = 1\nafter = "c"\ntests = []\n',
    ],
)
def test_a_file_that_is_no_table_is_refused_by_its_name(text: str) -> None:
    with pytest.raises(BadTable, match=r"room\.toml"):
        parse_rows(text, "room")
