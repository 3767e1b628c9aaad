"""The page of the management operations: request, reply, role, authority, refusals of each."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from openpendant.simplemsg.pendant.management import (
    declaration,
    edits,
    frames,
    program_values,
    statements,
)
from openpendant.simplemsg.verdicts import VerdictCode

from .docstrings import Docstring, meanings_of
from .messages import NOTICE
from .operations import GROUPS, PublishedOperation, published_operations
from .schemas import FieldRow, field_rows, reply_schema, request_schema, tagged

_OPENING = """\
# Management operations

Programs, recordings, frames, tools, scene, signals, accounts: what has no fixed layout travels as
one JSON object in a [MANAGEMENT](../protocol.md#65001-management) request, with the operation in
`op` beside the fields below, and is answered by one. The Python client has a typed call for each;
every request and reply has a [JSON Schema](schemas/). [pendant-apps.md](../pendant-apps.md) shows
them at work.

- An unknown key is refused, as are a value of another type or beyond its bounds: BAD_ARGUMENT.
- A refused operation is answered with reply code 2 and [code and text](schemas/failure-reply.json),
  with `joint`, `value` and `limit` where known, and for a program's text with `line` and `column`.
- Whoever has not the role that an operation needs gets LOGIN_NEEDED or ROLE_TOO_LOW.
- Where an operation needs the motion authority of the cell, as a motion does, whoever does not hold
  it gets HELD_BY_OTHER with the name of its holder, or NOT_IN_CONTROL where nobody holds it:
  *always*; *while the robot moves*, which is also while a motion is planned or a program is under
  way; *for the selected tool*, *for what it carries* and *for a program under way*, where the
  operation is about such a one. It is judged when the operation is carried out, not when it was
  sent. A stop never needs it.
- What is kept may be refused with NO_STORE, DISK_FULL, STORE_READ_ONLY, STORE_FAILED or STORE_BUSY.
- `expected_revision` is the revision that the change was made from, 0 for something new. Where
  another is kept by now the change is refused with REVISION_CONFLICT, and nothing is lost.
- Lengths are m, angles rad, times s, quaternions x, y, z, w. Joints, statements and signals count
  from 0, lines of a text from 1.
"""

_REQUEST_HEADS = ("field", "type", "default", "meaning")

_CODE = re.compile(r"\b[A-Z]+(?:_[A-Z]+)+\b|\bMOVING\b")


def operations_page() -> str:
    """Return the page as Markdown."""
    operations = published_operations()
    parts = [f"<!-- {NOTICE} -->", "", _OPENING, *_overview(operations.values()), ""]
    for group in GROUPS:
        parts += [f"## {GROUPS[group].title}", ""]
        for operation in operations.values():
            if operation.group == group:
                parts += _operation(operation)
    parts += _tagged(request_schema(operations["programs.edit"]))
    return "\n".join(parts).rstrip() + "\n"


def _overview(operations: Iterable[PublishedOperation]) -> Iterator[str]:
    rows = (
        (
            f"[`{each.name}`](#{_anchor(each)})",
            _role(each),
            each.authority.value,
            each.told.about.splitlines()[0],
        )
        for each in operations
    )
    return table(("operation", "role", "motion authority", "what it is for"), rows)


def _anchor(operation: PublishedOperation) -> str:
    return operation.name.replace(".", "")


def _role(operation: PublishedOperation) -> str:
    return "anybody" if operation.role is None else operation.role.value


def _operation(operation: PublishedOperation) -> list[str]:
    name, needs = operation.name, operation.permission
    permission = "" if needs is None else f" (`{needs}`)"
    schemas = f"[request](schemas/{name}-request.json), [reply](schemas/{name}-reply.json)"
    lines = [
        f"### {name}",
        "",
        _in_json(operation.told.about),
        "",
        f"- Role: {_role(operation)}{permission}. Motion authority: {operation.authority.value}.",
        f"- Schemas: {schemas}.",
        f"- Client: `pendant.{operation.usage}`.",
    ]
    if operation.request.SINCE > 2:
        lines.append(f"- Since version {operation.request.SINCE} of the pendant protocol.")
    refused = operation.told.section("Raises").get("Refused")
    if refused:
        lines.append(f"- May be refused: {linked(refused)}")
    rows = [_request_cells(row) for row in field_rows(request_schema(operation), meaning_of)]
    lines += ["", "Request:" if rows else "Request: no field but `op`.", ""]
    lines += [*table(_REQUEST_HEADS, rows), ""] if rows else []
    return [*lines, *_reply(operation)]


def reply_cells(operation: PublishedOperation) -> list[tuple[str, ...]]:
    """Return the fields of a reply, with what the client's type says of them."""
    told = {
        row.path: row.meaning for row in field_rows(reply_schema(operation.returned), meaning_of)
    }
    schema = reply_schema(operation.reply)
    return [
        (
            f"`{row.path}`",
            row.kind if row.is_needed or row.default else f"{row.kind}, or missing",
            sentence(told.get(row.path) or row.meaning),
        )
        for row in field_rows(schema, meaning_of)
    ]


def _reply(operation: PublishedOperation) -> list[str]:
    rows = reply_cells(operation)
    if rows:
        return ["Reply:", "", *table(("field", "type", "meaning"), rows), ""]
    is_object = reply_schema(operation.reply).get("additionalProperties")
    return ["Reply: an object." if is_object else "Reply: empty.", ""]


def _request_cells(row: FieldRow) -> tuple[str, ...]:
    default = f"`{row.default}`" if row.default else ""
    return f"`{row.path}`", row.kind, default, sentence(row.meaning)


def sentence(text: str) -> str:
    """Return a meaning in the words of JSON, with a capital at its beginning."""
    return _in_json(text[:1].upper() + text[1:])


def _in_json(text: str) -> str:
    return text.replace("None", "null")


def linked(text: str) -> str:
    """Return a sentence in which every code of the catalogue links to its cause and remedy."""

    def link(found: re.Match[str]) -> str:
        return f"[{found[0]}](../errors.md#code-{VerdictCode[found[0]].value})"

    return _CODE.sub(link, text)


def _tagged(schema: dict[str, Any]) -> list[str]:
    """Return the sections of edits and statements."""
    lines = ["## Edits and statements", ""]
    lines += ["What `programs.edit` takes, and what a program consists of.", ""]
    for tag, inner in sorted(tagged(schema).items()):
        kind, _, value = tag.partition(" ")
        about = Docstring.of(vars(edits)[inner["title"]]).about
        rows = map(_request_cells, field_rows({**inner, "$defs": schema["$defs"]}, meaning_of))
        lines += [f'<a id="{kind}-{value}"></a>', f"### {kind} `{value}`", "", about, ""]
        lines += [*table(_REQUEST_HEADS, rows), ""]
    return lines


_TYPES = (edits, declaration, frames, statements, program_values)
"""Where the types of what requests hold are; those that clients give come first."""


@cache
def meaning_of(kind: str, name: str) -> str:
    """Return what the types of this name say of a field; empty where they say nothing."""
    types = [vars(each)[kind] for each in _TYPES if kind in vars(each)]
    return next((told[name] for told in map(meanings_of, types) if name in told), "")


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> Iterator[str]:
    """Yield the lines of a table."""
    titles = list(heads)
    yield f"| {' | '.join(titles)} |"
    yield f"| {' | '.join('---' for _ in titles)} |"
    for cells in rows:
        yield f"| {' | '.join(cells)} |"
