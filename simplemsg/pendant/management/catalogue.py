"""Operation on the protocol itself: its codes, messages and operations as data."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Any, Literal, TypedDict

from ..roles import Permission
from .declaration import Count, Request, operation


class CatalogueChunk(TypedDict):
    """Some entries of one part of the catalogue.

    Attributes:
        version: of the protocol.
        part: which part they are of.
        offset: number of the first of them.
        total: entries of the part in all.
        entries: as in `docs/generated/catalogue.json`, as many as fit 48 kB.
        next: offset to ask for next; None behind the last.
    """

    version: int
    part: str
    offset: int
    total: int
    entries: list[dict[str, Any]]
    next: int | None


@operation("catalogue", needs=Permission.OBSERVE, since=3)
class ReadCatalogue(Request[CatalogueChunk]):
    """Return codes with cause and remedy, or messages, or operations of the protocol, in chunks.

    Raises:
        Refused: BAD_ARGUMENT.
    """

    part: Literal["codes", "messages", "operations"]
    """what is wanted."""
    offset: Annotated[int, Count(0)] = field(default=0)
    """number of the first entry that is wanted."""
