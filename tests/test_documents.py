"""What the documents promise: their links lead somewhere, and their commands exist."""

import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from openpendant.tools.cli import COMMANDS

ROOT = Path(__file__).parent.parent
DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/*.md"))]

every_document = pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix()
)


@every_document
def test_every_link_inside_the_project_leads_somewhere(document: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", document.read_text("utf-8"))
    inside = [target for target in targets if "://" not in target]
    assert [target for target in inside if not (document.parent / target).exists()] == []


@every_document
def test_every_make_target_and_command_exists(document: Path) -> None:
    code = "\n".join(re.findall(r"```.*?```|`[^`\n]+`", document.read_text("utf-8"), re.DOTALL))
    targets = set(re.findall(r"(?m)^([a-z]+):", (ROOT / "Makefile").read_text("utf-8")))
    assert set(re.findall(r"\bmake (?:[A-Z]+=\S+ )?([a-z]+)\b", code)) <= targets
    assert set(re.findall(r"\bopenpendant ([a-z]+)\b", code)) <= set(COMMANDS)


def test_every_page_is_listed_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    pages = {path.name for path in ROOT.glob("docs/*.md")} - {"index.md"}
    assert {page for page in pages if f"({page})" not in index} == set()


def test_the_picture_is_well_formed() -> None:
    assert ElementTree.parse(ROOT / "docs" / "parts.svg").getroot().tag.endswith("svg")


FIELD_TERMS: dict[str, list[str]] = tomllib.loads(
    (ROOT / "tests" / "field_terms.toml").read_text("utf-8")
)


@pytest.mark.parametrize("page", FIELD_TERMS)
def test_a_term_of_the_field_stands_on_the_page_where_a_reader_looks_for_it(page: str) -> None:
    text = (ROOT / page).read_text("utf-8").lower()
    assert [term for term in FIELD_TERMS[page] if term.lower() not in text] == []
