"""How many files and sockets a server may need open, and whether the system allows so many.

Owns the sum and the sentence (promise 21). Asked once at start: a server that finds out only when
the last pendant of a class connects is of no use to it.
"""

from __future__ import annotations

import resource

from ..settings.config_file import ConfigurationError
from ..settings.server_settings import ServerSettings
from .accept_rate import MOST_STRANGERS
from .rejections import MOST_TURNED_AWAY

_PER_CELL = 8
"""Three connections to the controller, two listening sockets, and what it plans and keeps."""

_FOR_ALL = 64
"""Standard streams, the loop, libraries, the store, logs, pipes to planners and watchdog."""


def files_needed(settings: ServerSettings) -> int:
    """Return how many descriptors may be open at once, every place taken."""
    connections = settings.cells[0].listen.max_connections
    # Those that agree on TLS, or wait for their answer, have no place yet, or none any more.
    passing = MOST_STRANGERS + MOST_TURNED_AWAY
    return connections + passing + _PER_CELL * len(settings.cells) + _FOR_ALL


def provide_files(settings: ServerSettings, source: str) -> None:
    """Make sure that so many may be open, raising the soft limit where it is too low.

    Args:
        settings: of the server.
        source: file name for the message.

    Raises:
        ConfigurationError: the hard limit is too low; says what would be accepted.
    """
    needed = files_needed(settings)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return
    if hard != resource.RLIM_INFINITY and hard < needed:
        asked = settings.cells[0].listen.max_connections
        most = hard - (needed - asked)
        fewer = f"at most {most} connections, or " if most > 0 else ""
        problem = (
            f"{asked} connections need {needed} open files, and the system allows {hard}; "
            f"accepted: {fewer}a higher limit (ulimit -Hn)"
        )
        raise ConfigurationError(source, "listen.max_connections", problem)
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))
