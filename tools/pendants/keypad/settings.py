"""Settings of the keypad: a TOML file, and the arguments that go before it.

Owns the keys, their bounds and the words for what cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from ..connection_errors import DEFAULT_PORT
from ..session import LONGEST_SILENCE, SHORTEST_SILENCE
from ..settings_file import ServerAddress, SettingsRefused, read_file
from .keypad import EnablingSource

BAUDS = (9_600, 19_200, 38_400, 57_600, 115_200)
"""Speeds of the line; below 57,600 there are increments only."""


def _check_baud(baud: int) -> int:
    if baud not in BAUDS:
        raise ValueError(f"accepted: {', '.join(map(str, BAUDS))}")
    return baud


class KeypadSettings(BaseModel):
    """All that the table `[keypad]` may say."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    port: str = ""
    """A device such as /dev/ttyACM0, a pty, or socket://HOST:PORT."""
    baud: Annotated[int, AfterValidator(_check_baud)] = 115_200
    """Speed of the line."""
    server: ServerAddress = f"127.0.0.1:{DEFAULT_PORT}"
    """HOST or HOST:PORT of the pendant server."""
    deadline: Annotated[float, Field(ge=SHORTEST_SILENCE, le=LONGEST_SILENCE)] = 0.15
    """The robot ramps to rest so long after the last sign of a held key [s]."""
    debounce_ms: Annotated[int, Field(ge=5, le=20)] = 5
    """A key counts as down once it was so for so long [ms]."""
    enabling: EnablingSource = EnablingSource.KEY
    """What holds enabling (training): the key, or the button on D2 with it."""
    characters: bool = False
    """The keypad sends the plain characters of the paper: increments only."""


def settings_of(file: Path | None, given: dict[str, Any]) -> KeypadSettings:
    """Return the settings of a file; what is given goes before it.

    Args:
        given: by key; None where the command line says nothing.

    Raises:
        SettingsRefused: the file, or a value, cannot be used.
    """
    table = {} if file is None else _table(file)
    values = {**table, **{key: value for key, value in given.items() if value is not None}}
    try:
        return KeypadSettings.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(each) for each in first["loc"])
        where = f"{file}: " if file is not None and key not in given else ""
        raise SettingsRefused(f"{where}{key}: {first['msg']}") from None


def _table(file: Path) -> dict[str, Any]:
    document = read_file(file)
    table = document.pop("keypad", {})
    if document or not isinstance(table, dict):
        names = ", ".join(document) or "keypad"
        raise SettingsRefused(f"{file}: {names}; accepted: one table [keypad]")
    return table
