"""What Python declares, as the reference tells it: docstrings taken apart, and models of replies.

The client library knows only the standard library, so its types are plain `TypedDict`s; a schema
needs a model. A key that may be missing has a default that no schema shows.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import UnionType
from typing import (
    Any,
    Literal,
    NotRequired,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

from pydantic import BaseModel, ConfigDict, Field, create_model

_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns):$")
_ENTRY = re.compile(r"^    (\w+): (.*)$")


@dataclass(frozen=True, slots=True)
class Docstring:
    """A docstring in parts."""

    about: str
    entries: Mapping[str, Mapping[str, str]]

    @classmethod
    def of(cls, documented: object) -> Docstring:
        """Take apart what an object says of itself."""
        about: list[str] = []
        entries: dict[str, dict[str, str]] = {}
        section, name = "", ""
        for line in (inspect.getdoc(documented) or "").splitlines():
            begins, entry = _SECTION.match(line), _ENTRY.match(line)
            if begins:
                section, name = begins[1], ""
                entries[section] = {}
            elif not section:
                about.append(line)
            elif entry:
                name = entry[1]
                entries[section][name] = entry[2]
            elif name and line.strip():
                entries[section][name] += f" {line.strip()}"
        return cls("\n".join(about).strip(), entries)

    def section(self, name: str) -> Mapping[str, str]:
        """Return the entries of a section; none where it is missing."""
        return self.entries.get(name, {})


def told_of(request: type) -> Docstring:
    """Return what a declared request says of itself, and below its fields of each of them."""
    meanings = _below_fields(request.__module__)[request.__name__]
    told = Docstring.of(request)
    return replace(told, entries={**told.entries, "Args": meanings})


def meanings_of(declared: type) -> Mapping[str, str]:
    """Return what a class and its bases say of their fields, in docstrings or below the fields."""
    found: dict[str, str] = {}
    for base in reversed(declared.__mro__):
        if base.__module__ == declared.__module__:
            found |= Docstring.of(base).section("Attributes")
            found |= _below_fields(base.__module__).get(base.__name__, {})
    return found


@cache
def _below_fields(module: str) -> Mapping[str, Mapping[str, str]]:
    """Return the texts below the fields of the classes of a module, by class and field."""
    found: dict[str, dict[str, str]] = {}
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    for declared in tree.body:
        if isinstance(declared, ast.ClassDef):
            texts = found[declared.name] = {}
            for field, text in zip(declared.body, declared.body[1:], strict=False):
                match field, text:
                    case (
                        ast.AnnAssign(target=ast.Name(id=name)),
                        ast.Expr(value=ast.Constant(value=str(told))),
                    ):
                        texts[name] = " ".join(told.split())
    return found


_CLOSED = ConfigDict(extra="forbid")


def with_models(kind: Any) -> Any:
    """Return an annotation in which models stand in the place of typed dictionaries."""
    if is_typeddict(kind):
        return model_of(kind)
    origin, arguments = get_origin(kind), get_args(kind)
    if not arguments or origin is Literal:
        return kind
    inner = tuple(with_models(each) for each in arguments)
    return Union[inner] if origin in (Union, UnionType) else origin[inner]  # noqa: UP007


@cache
def model_of(data: type) -> type[BaseModel]:
    """Return the model of a typed dictionary, with what it says of its keys."""
    told = Docstring.of(data)
    meanings = told.section("Attributes")
    fields: dict[str, tuple[Any, Any]] = {}
    for name, kind in get_type_hints(data, include_extras=True).items():
        optional = get_origin(kind) is NotRequired
        inner = with_models(get_args(kind)[0] if optional else kind)
        default = None if optional else ...
        fields[name] = (inner, Field(default, description=meanings.get(name)))
    return closed_model(data.__name__, fields, told.about)


def closed_model(
    name: str, fields: Mapping[str, tuple[Any, Any]], about: str = ""
) -> type[BaseModel]:
    """Return a model that refuses unknown keys."""
    define: Any = create_model
    model: type[BaseModel] = define(name, __config__=_CLOSED, __doc__=about or None, **fields)
    return model


def is_optional(data: type, name: str) -> bool:
    """Return True if a key of a typed dictionary may be missing."""
    return get_origin(get_type_hints(data, include_extras=True)[name]) is NotRequired
