"""Controller dialects of the server: the table of them; each is a file of this folder."""

from __future__ import annotations

from ..settings.cell_settings import ControllerLink
from .generic import GENERIC
from .uplink import ControllerDialect

DIALECTS: dict[str, ControllerDialect] = {"generic": GENERIC}
"""The dialects by name."""


def dialect_of(link: ControllerLink) -> ControllerDialect:
    """Return how a controller is spoken to; one dialect serves all links so far."""
    return DIALECTS["generic"]
