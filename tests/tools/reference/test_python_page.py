"""The page of the Python client names every public call, with all its arguments."""

import inspect
import re
from functools import cache
from pathlib import Path

from rigs.data.case_table import every

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.reference.operations import PublishedOperation, published_operations
from openpendant.tools.reference.python_page import python_page

DOCS = Path(__file__).parents[3] / "docs"


@cache
def page() -> str:
    return python_page()


def section(path: str) -> str:
    return page().partition(f"\n### {path}\n")[2].partition("\n### ")[0].partition("\n## ")[0]


def test_every_call_of_the_client_itself_has_a_section() -> None:
    names = [name for name, _ in inspect.getmembers(PendantClient) if not name.startswith("_")]
    assert len(names) > 40
    assert [name for name in names if not section(f"pendant.{name}")] == []


def test_every_call_of_a_group_has_its_arguments_and_the_keys_of_its_reply() -> None:
    every(published_operations().items(), _has_its_arguments)


def _has_its_arguments(operation: PublishedOperation) -> None:
    told = section(".".join(part for part in ("pendant", operation.group, operation.call) if part))
    assert f"[`{operation.name}`](operations.md#{operation.name.replace('.', '')})" in told
    for each in operation.arguments:
        assert re.search(rf"^\| `{each.name}` \| \S.* \| .* \| \S.* \|$", told, re.MULTILINE)
    refused = operation.told.section("Raises").get("Refused", "")
    for code in re.findall(r"\b[A-Z]+_[A-Z_]+\b", refused):
        assert f"[{code}](../errors.md#code-{VerdictCode[code].value})" in told


def test_a_call_is_written_as_python_writes_it() -> None:
    assert "`await pendant.move_joints(joints, *, speed=0.1) -> MotionHandle`" in page()
    saving = "name, body, expected_revision, *, format='text', part=1, parts=1"
    assert f"`await pendant.programs.save({saving}) -> ProgramSaved`" in page()
    assert "| `part` | `int`, 1 to 1000 | `1` | Which part this is, from 1. |" in page()
    assert "`await pendant.retreat() -> list[Hold]`" in page()
    assert section("pendant.recordings.play").splitlines()[1].endswith("-> PlaybackHandle`")


def test_the_page_is_linked_from_the_guide() -> None:
    assert "(generated/python-client.md)" in (DOCS / "pendant-apps.md").read_text("utf-8")
