"""Pages that show a command say how it is typed, each in the same words."""

import re
from pathlib import Path

import pytest

from openpendant.tools.cli import COMMANDS

CHECKOUT = Path(__file__).parents[2]

SAID = (
    "Commands stand as `openpendant`: activate the environment first, `. .venv/bin/activate`, or"
    " type `.venv/bin/openpendant`."
)

_COMMAND = re.compile(rf"\bopenpendant (?:{'|'.join(COMMANDS)})\b")


def pages() -> list[Path]:
    """Return the pages for users that are written by hand."""
    written = [each for each in (CHECKOUT / "docs").glob("*.md") if each.name != "moved-files.md"]
    found = [CHECKOUT / "README.md", *written]
    return [page for page in found if not page.read_text().startswith("<!-- Generated")]


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_a_page_with_commands_says_how_they_are_typed(page: Path) -> None:
    text = page.read_text()
    assert (SAID in " ".join(text.split())) == bool(_COMMAND.search(text))


def test_commands_stand_in_one_way_only() -> None:
    for page in pages():
        text = " ".join(page.read_text().split()).replace(SAID, "")
        assert ".venv/bin/openpendant" not in text, page.name
