"""Management requests to record: those of the file, and what can be wrong with them.

The file says what is asked, in an order in which each right request has something to work on. A
new one is a line more in it, without an answer. In front of the right request of an operation stand
the same with a key too many, without a key, with values of another type or out of bounds, and from
a role that may not; none of them changes anything. Those that the file has not are made up here.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from frozen.asked_cell import VISITOR
from frozen.body_file import Question, Step, read_steps
from frozen.frozen_files import SCHEMAS

ROLES = (VISITOR, "viewer", "operator", "programmer", "admin")
RIGHT = ": right"
"""Ends the name of the right request of an operation."""


def steps(file: Path) -> Iterator[tuple[str, Step]]:
    """Yield all steps of a file and what it lacks, with the name of the cell of each."""
    listed = list(read_steps(file))
    known = {step.name for _, step, _ in listed if isinstance(step, Question)}
    for cell, step, _ in listed:
        if isinstance(step, Question) and step.name.endswith(RIGHT):
            yield from ((cell, each) for each in wrong(step) if each.name not in known)
        yield cell, step


def wrong(right: Question) -> Iterator[Question]:
    """Yield what can be wrong with a right request, by the schema of its operation."""
    fields = json.loads(right.bytes)
    op = fields["op"]

    def question(label: str, body: Mapping[str, Any], by: str = right.by) -> Question:
        text = json.dumps(body, ensure_ascii=False, separators=(",", ":"))
        return Question(f"{op}: {label}", by, text)

    below = _below(op)
    if below is not None:
        yield question(f"by who is {below}", fields, below)
    yield question("a key too many", {**fields, "colour": "red"})
    schema = json.loads((SCHEMAS / f"{op}-request.json").read_text("utf-8"))
    for key in schema.get("required", []):
        if key != "op":
            yield question(f"without {key}", {k: v for k, v in fields.items() if k != key})
    for key, about in schema["properties"].items():
        if key == "op":
            continue
        if key in fields:
            yield question(f"{key} of another type", {**fields, key: _other(about)})
        for value in _beyond(about):
            yield question(f"{key} of {value}", {**fields, key: value})


def _below(op: str) -> str | None:
    """Return the highest role that may not ask for an operation; None where there is none."""
    # Here, because it loads all of the server.
    from openpendant.tools.reference.operations import published_operations

    role = published_operations()[op].role
    return None if role is None else ROLES[ROLES.index(role.value) - 1]


def _other(about: Mapping[str, Any]) -> Any:
    """Return a value of none of the types that a field has."""
    types = {each.get("type", "object") for each in about.get("anyOf", [about])}
    if "string" in types or "integer" in types:
        return [] if "integer" not in types else "seven"
    return "seven" if types & {"number", "boolean"} else 7


def _beyond(about: Mapping[str, Any]) -> Iterator[Any]:
    """Yield values just beyond the bounds of a field."""
    for each in about.get("anyOf", [about]):
        step = 1 if each.get("type") == "integer" else 0.001
        if "minimum" in each:
            yield each["minimum"] - step
        if "maximum" in each:
            yield each["maximum"] + step
        if "maxItems" in each and each["maxItems"] <= 20:
            items: Mapping[str, Any] = each["items"]
            yield [[0.0] * items.get("minItems", 6)] * (each["maxItems"] + 1)
