"""A public class has a name of its own in the product, so that a search finds one."""

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("simplemsg", "motion", "server", "controller_emulator", "tools")

MOST_DOUBLE = 40
"""Class names that stand in two modules or more; this may only fall."""


def public_classes(source: str) -> list[str]:
    return [
        node.name
        for node in ast.parse(source).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]


def double_names() -> list[str]:
    found = Counter(
        name
        for room in ROOMS
        for file in (ROOT / room).rglob("*.py")
        for name in set(public_classes(file.read_text("utf-8")))
    )
    return sorted(name for name, modules in found.items() if modules > 1)


def test_no_more_classes_share_a_name_than_before() -> None:
    double = double_names()
    assert len(double) <= MOST_DOUBLE, f"one more of {', '.join(double)}"
    assert len(double) == MOST_DOUBLE, f"lower MOST_DOUBLE to {len(double)}"


def test_private_and_inner_classes_do_not_count() -> None:
    source = "class Seen:\n    class Inner: ...\nclass _Hidden: ...\ndef f():\n    class In: ...\n"
    assert public_classes(source) == ["Seen"]
