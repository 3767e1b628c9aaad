"""The page of the Python client: every public call with its arguments, results and refusals.

Of the client's own calls signature and docstring are the source, of the calls for management
operations the declarations.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from openpendant.simplemsg.pendant.management.declaration import NeedsAuthority

from ..pendants import client
from ..pendants.client import PendantClient
from .docstrings import Docstring
from .messages import NOTICE
from .operations import GROUPS, PublishedOperation, published_operations
from .operations_page import linked, meaning_of, reply_cells, table
from .schemas import field_rows, request_schema

_OPENING = """\
# The Python client

Every public call of `openpendant.tools.pendants.client.PendantClient`, here called `pendant`.
`SyncPendantClient` has the same calls with the same arguments; they wait, so leave out `await`,
and `async` before `with` and `for`. [pendant-apps.md](../pendant-apps.md) shows both at work.

- Lengths are m, angles rad, times s, quaternions x, y, z, w. Joints, statements and signals count
  from 0, lines of a text from 1.
- What the server refuses raises `Refused`, a motion that ends before its goal `Aborted`; both have
  the code of the [catalogue](../errors.md), cause, remedy and the numbers.
- A call that needs a role which the connection has not raises `Refused` with LOGIN_NEEDED or
  ROLE_TOO_LOW, one that needs the motion authority while another has it, or nobody, with
  HELD_BY_OTHER or NOT_IN_CONTROL: call it inside `async with pendant.control()`. One that sends
  anything may raise `ConnectionLost`.
- Arguments behind `*` are given by name. A reply is a dictionary with the keys that stand there.
- `pendant.programs.run` is `pendant.run_program`.
"""

_RETURNED = {"recordings.play": "PlaybackHandle"}
"""What calls return that wait for the end of a motion; its `account` is the reply."""

_ARGUMENTS = ("argument", "type", "default", "meaning")


def python_page() -> str:
    """Return the page as Markdown."""
    parts = [f"<!-- {NOTICE} -->", "", _OPENING]
    parts += ["## Connection, state, authority and motion", ""]
    for kind in reversed(PendantClient.__mro__):
        parts += _members(kind, "pendant")
    operations = published_operations()
    for group in GROUPS:
        parts += [f"## {GROUPS[group].title}", ""]
        for operation in operations.values():
            if operation.group == group:
                parts += _operation(operation)
    for name in client.__all__:
        handed_out = getattr(client, name)
        if _is_handle(handed_out):
            about = Docstring.of(handed_out).about.partition("\n")[0]
            parts += [f"## {name}", "", about, "", *_members(handed_out, name)]
    return "\n".join(parts).rstrip() + "\n"


def _is_handle(found: object) -> bool:
    """Return True for a class of objects that calls return, with calls of their own."""
    if not isinstance(found, type) or found is PendantClient or is_dataclass(found):
        return False
    is_ours = found.__module__.startswith(PendantClient.__module__.rpartition(".")[0])
    return is_ours and not issubclass(found, Exception)


def _members(kind: type, path: str) -> Iterator[str]:
    """Yield the sections of the public members that one of our classes defines."""
    if kind.__module__.startswith(PendantClient.__module__.rpartition(".")[0]):
        for name, member in vars(kind).items():
            if not name.startswith("_"):
                yield from _member(f"{path}.{name}", member)


def _member(path: str, found: object) -> Iterator[str]:
    """Yield the section of a call or a property; nothing for anything else."""
    if isinstance(found, property):
        returned = inspect.signature(found.fget).return_annotation if found.fget else ""
        yield from (f"### {path}", "", f"`{path} -> {returned}`", "")
        yield from (Docstring.of(found).about, "")
        return
    function = found.__func__ if isinstance(found, classmethod) else found
    if not inspect.isfunction(function):
        return
    written = inspect.signature(function)
    kept = [each for each in written.parameters.values() if each.name not in ("self", "cls")]
    is_awaited = inspect.iscoroutinefunction(inspect.unwrap(function))
    returned = written.return_annotation
    yield from _call(path, kept, is_awaited, returned)
    told = Docstring.of(function)
    yield from (told.about, "")
    meanings = told.section("Args")
    rows = [
        (
            f"`{each.name}`",
            _code(each.annotation),
            _default(each),
            _capital(meanings.get(each.name, "")),
        )
        for each in kept
    ]
    if rows:
        yield from (*table(_ARGUMENTS, rows), "")
    yield from (f"- Raises `{name}`: {text}" for name, text in told.section("Raises").items())
    if told.section("Raises"):
        yield ""


def _operation(operation: PublishedOperation) -> Iterator[str]:
    path = ".".join(part for part in ("pendant", operation.group, operation.call) if part)
    arguments = list(operation.arguments)
    hints = get_type_hints(operation.request)
    returned = _RETURNED.get(operation.name) or _spelled(_reply_of(operation))
    yield from _call(path, arguments, True, returned)
    yield from (operation.told.about, "")
    role = "anybody" if operation.role is None else operation.role.value
    anchor = operation.name.replace(".", "")
    yield f"- Operation: [`{operation.name}`](operations.md#{anchor}). Role: {role}."
    if operation.authority is not NeedsAuthority.NEVER:
        yield f"- Needs the motion authority {operation.authority.value}."
    refused = operation.told.section("Raises").get("Refused")
    if refused:
        yield f"- May be refused: {linked(refused)}"
    yield ""
    kinds = {row.path: row.kind for row in field_rows(request_schema(operation), meaning_of)}
    meanings = operation.told.section("Args")
    rows = [
        (
            f"`{each.name}`",
            _bounded(_spelled(hints[each.name]), kinds[each.name]),
            _default(each),
            _capital(meanings[each.name]),
        )
        for each in arguments
    ]
    if rows:
        yield from (*table(_ARGUMENTS, rows), "")
    answered = reply_cells(operation)
    if answered:
        yield from ("Reply:", "", *table(("key", "type", "meaning"), answered), "")


def _reply_of(operation: PublishedOperation) -> Any:
    """Return the type that a call returns: the reply, or the part of it that is meant."""
    request = vars(GROUPS[operation.group].calls)[operation.call].request
    (returned,) = get_args(request.__annotations__["return"])
    return returned


def _capital(text: str) -> str:
    """Return a meaning with a capital at its beginning; None stays None."""
    return text[:1].upper() + text[1:]


def _call(
    path: str, arguments: list[inspect.Parameter], is_awaited: bool, returned: str
) -> Iterator[str]:
    written: list[str] = []
    for each in arguments:
        if each.kind is each.KEYWORD_ONLY and "*" not in written:
            written.append("*")
        is_needed = each.default is each.empty
        written.append(each.name if is_needed else f"{each.name}={_value(each.default)}")
    before = "await " if is_awaited else ""
    yield from (f"### {path}", "", f"`{before}{path}({', '.join(written)}) -> {returned}`", "")


def _default(told: inspect.Parameter) -> str:
    return "" if told.default is told.empty else f"`{_value(told.default)}`"


def _value(value: object) -> str:
    # Of an enumeration its name, as whoever calls writes it.
    return re.sub(r"<(\w+\.\w+): [^>]*>", r"\1", repr(value))


def _code(annotation: str) -> str:
    return f"`{annotation}`".replace("|", "\\|")


def _bounded(spelled: str, kind: str) -> str:
    """Return a type, and behind it the bounds that its schema tells."""
    _, comma, bounds = kind.removesuffix(" or null").partition(", ")
    is_number = kind.startswith(("integer", "number"))
    code = _code(spelled)
    return f"{code}, {bounds}" if comma and is_number else code


def _spelled(hint: Any) -> str:
    """Return a type as Python writes it, without modules."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is type(None):
        return "None"
    if origin in (Union, UnionType):
        return " | ".join(map(_spelled, arguments))
    if origin is Literal:
        return f"Literal[{', '.join(map(repr, arguments))}]"
    if origin is not None:
        return f"{origin.__name__}[{', '.join(map(_spelled, arguments))}]"
    return str(getattr(hint, "__name__", hint))
