"""How a further pendant is attached to a server, as this user types it."""

from __future__ import annotations

import shlex

from ..console import as_typed
from .connection_errors import DEFAULT_PORT

_THIS_MACHINE = "127.0.0.1"


def attach_command(host: str, port: int, *options: str) -> str:
    """Return the command that starts another pendant of a server; the default address is left out.

    Args:
        options: what stands behind the address.
    """
    name = f"[{host}]" if ":" in host else host
    where = name if port == DEFAULT_PORT else f"{name}:{port}"
    default = (host, port) == (_THIS_MACHINE, DEFAULT_PORT)
    return " ".join(
        [as_typed(), "pendant", *(() if default else (where,)), *map(shlex.quote, options)]
    )
