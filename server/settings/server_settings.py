"""Server settings: one cell, or several that share the server's pendant port and its clock.

Owns the form of a file with several cells, `[[cells]]` tables beside `[listen]` and `[pendants]`
for all. The keys of a cell are `cell_settings`'. That two cells drive two controllers is checked
where names are looked up, in `shell/controller_connection`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .cell_settings import (
    CellName,
    CellSettings,
    Listen,
    ListenForAll,
    OwnTables,
    RosPort,
    SettingsTable,
    SharedTables,
    make_settings,
)
from .config_file import ConfigurationError, checked, settings_as_toml

MOST_CELLS = 64
"""Greatest number of cells: a room of 30 robots is one machine, and this allows two."""


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Settings of one server process.

    Attributes:
        cells: one or more; where it listens for pendants, how often it ticks and what it asks of
            pendants is the same in all.
    """

    cells: tuple[CellSettings, ...]


class RosPortNumbers(SettingsTable):
    """Where one of several cells listens for ROS-Industrial; nowhere unless it says so."""

    ros_motion_port: RosPort = None
    """ROS-Industrial motion connections, "off" for none."""
    ros_state_port: RosPort = None
    """ROS-Industrial state connections, "off" for none."""


class OneOfSeveral(OwnTables):
    """A `[[cells]]` table."""

    name: CellName
    """Name of the cell, at most 32 bytes; pendants ask for it in their hello."""
    listen: RosPortNumbers = RosPortNumbers()


class ForAll(SharedTables):
    """What a file of several cells says once."""

    listen: ListenForAll = ListenForAll()


def make_server_settings(data: dict[str, Any], source: str) -> ServerSettings:
    """Check plain data and return what the server is to serve.

    Args:
        data: as read from TOML, of one cell or of several.

    Raises:
        ConfigurationError: the first key that is unknown or out of bounds, or that two cells may
            not have in common.
    """
    if "cells" not in data:
        return ServerSettings((make_settings(data, source),))
    for key in data:
        if key in OwnTables.model_fields:
            raise ConfigurationError(source, key, "belongs to one cell; write it to its [[cells]]")
    tables = data["cells"]
    is_array = isinstance(tables, list) and all(isinstance(table, dict) for table in tables)
    if not is_array or not 1 <= len(tables) <= MOST_CELLS:
        problem = f"expected 1 to {MOST_CELLS} tables, each begun by [[cells]]"
        raise ConfigurationError(source, "cells", problem)
    for_all = checked(ForAll, {k: v for k, v in data.items() if k != "cells"}, source)
    cells = [_cell(for_all, table, number, source) for number, table in enumerate(tables, 1)]
    _check_names(cells, source)
    return ServerSettings(tuple(cells))


def _cell(for_all: ForAll, table: dict[str, Any], number: int, source: str) -> CellSettings:
    name = table.get("name")
    owner = f"of cell {name!r}" if isinstance(name, str) and name else f"of cell {number}"
    own = checked(OneOfSeveral, table, source, owner)
    listen = Listen(**for_all.listen.model_dump(), **own.listen.model_dump())
    # Field by field, because these are checked already and must not be dumped and parsed again.
    fields = {key: getattr(own, key) for key in OwnTables.model_fields}
    shared = {key: getattr(for_all, key) for key in SharedTables.model_fields}
    return CellSettings(**fields, **shared, listen=listen)


def _check_names(cells: list[CellSettings], source: str) -> None:
    """Refuse two cells of one name.

    Raises:
        ConfigurationError: a name is taken.
    """
    names: set[str] = set()
    for cell in cells:
        if cell.name in names:
            problem = "each cell needs a name of its own; this one is taken"
            raise ConfigurationError(source, f"name of cell {cell.name!r}", problem)
        names.add(cell.name)


def server_settings_as_toml(settings: ServerSettings) -> str:
    """Return the settings as a TOML file that would give them again."""
    if len(settings.cells) == 1:
        return settings_as_toml(settings.cells[0])
    first = settings.cells[0]
    listen = ListenForAll(**_shared_keys(first.listen, ListenForAll))
    parts = [settings_as_toml(ForAll(listen=listen, **_shared_keys(first, SharedTables)))]
    for cell in settings.cells:
        ports = RosPortNumbers(**_shared_keys(cell.listen, RosPortNumbers))
        own = OneOfSeveral(listen=ports, **_shared_keys(cell, OwnTables))
        parts.append(settings_as_toml(own, within="cells"))
    return "\n".join(parts)


def _shared_keys(settings: SettingsTable, model: type[SettingsTable]) -> dict[str, Any]:
    return {key: getattr(settings, key) for key in model.model_fields}
