"""Every declared message in the order of the reference, names that pages link to, the notice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from openpendant.simplemsg import DIALECTS, STANDARD, Dialect, Message
from openpendant.simplemsg.declaration import Array, Field

NOTICE = "Generated from the declarations in simplemsg/ by `make reference`; do not edit."


def own_messages(dialect: Dialect) -> tuple[type[Message], ...]:
    """Return the messages that a dialect adds to the standard ones."""
    if dialect is STANDARD:
        return dialect.messages
    return tuple(cls for cls in dialect.messages if cls not in STANDARD.messages)


ALL_MESSAGES: tuple[type[Message], ...] = tuple(
    cls for dialect in DIALECTS.values() for cls in own_messages(dialect)
)
"""Messages of all dialects; no number belongs to two of them."""

_NAMES_OF_REQUESTS = {cls.PLACE.name for cls in ALL_MESSAGES if not cls.PLACE.is_reply}


def every_field(fields: Mapping[str, Field]) -> Iterator[Field]:
    """Return fields, those of repeated records included."""
    for field in fields.values():
        yield field
        if isinstance(field, Array) and field.of is not None:
            yield from every_field(field.of.FIELDS)


def filter_name(cls: type[Message]) -> str:
    """Return a message's name, with `_reply` where the request of the same number has it too."""
    name = cls.PLACE.name
    return f"{name}_reply" if cls.PLACE.is_reply and name in _NAMES_OF_REQUESTS else name
