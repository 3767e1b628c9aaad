"""The page for app authors: what it shows is in an example that runs, and it leaves nothing out."""

import inspect
import re
from pathlib import Path

import pytest

from openpendant.simplemsg.pendant import PENDANT_MESSAGES
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient
from openpendant.tools.reference.operations import published_operations

ROOT = Path(__file__).parent.parent.parent
PAGE = (ROOT / "docs" / "pendant-apps.md").read_text("utf-8")
EXAMPLES = [path.read_text("utf-8") for path in sorted((ROOT / "examples").glob("*.py"))]


def test_every_python_block_is_part_of_an_example() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert blocks
    assert [block for block in blocks if not any(block in text for text in EXAMPLES)] == []


def test_every_pendant_example_is_listed() -> None:
    found = {*(ROOT / "examples").glob("*.py"), *(ROOT / "examples").glob("pendant.*")}
    assert [path.name for path in found if f"(../examples/{path.name})" not in PAGE] == []


@pytest.mark.parametrize("client", [PendantClient, RoboAnalyzerClient])
def test_every_call_is_named(client: type) -> None:
    inside = {"close", "abort", "login", "subscribe", "take_control", "release_control"}
    calls = [name for name, _ in inspect.getmembers(client, callable) if name[0] != "_"]
    missing = [name for name in calls if not re.search(rf"\b{name}\b", PAGE)]
    assert set(missing) <= inside


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_call_of_a_group_is_named_beside_it(name: str) -> None:
    operation = published_operations()[name]
    group = f"`pendant.{operation.group}`" if operation.group else "the client itself"
    rows = [line for line in PAGE.splitlines() if line.startswith("| ") and "see below" not in line]
    (row,) = [line for line in rows if group in line or f", `{operation.group}`" in line]
    assert f"`{operation.call}`" in row


def test_the_numbers_of_the_messages_are_right() -> None:
    numbers = {kind.__name__: kind.PLACE.msg_type for kind in PENDANT_MESSAGES}
    named = re.findall(r"\*{0,2}\b([A-Z]+(?:_[A-Z]+)*)\*{0,2} \((65\d{3})\)", PAGE)
    assert len(named) >= 12
    for name, number in named:
        assert numbers["".join(part.capitalize() for part in name.split("_"))] == int(number), name
