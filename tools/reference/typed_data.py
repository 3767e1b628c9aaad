"""Models of replies: the typed dictionaries that the client hands out, as pydantic checks them.

The client library knows only the standard library, so its types are plain `TypedDict`s; a schema
needs a model. A key that may be missing has a default that no schema shows.
"""

from __future__ import annotations

from collections.abc import Mapping
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

from .docstrings import Docstring

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
    """Tell whether a key of a typed dictionary may be missing."""
    return get_origin(get_type_hints(data, include_extras=True)[name]) is NotRequired
