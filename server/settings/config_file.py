"""Configuration files: TOML, read into plain data, checked against a model, and written again.

Owns the message about a file or a key that cannot be used. Must not know any key but the table
`[emulator]`, which belongs to the emulated controller and is left out; the keys are
`cell_settings`'.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from openpendant.motion.bounded_file import beginning_of, toml_of
from openpendant.motion.errors import shortened

OFF = "off"
"""Value in a file for a ROS-Industrial port that nobody listens on; None in the settings."""

MAX_FILE = 1_048_576
"""Largest configuration file, bytes."""

_LONGEST_PART = 80
"""Characters of a key that are shown."""


_M = TypeVar("_M", bound=BaseModel)


class ConfigurationError(Exception):
    """Configuration that cannot be used; names file, key and what would be accepted.

    Attributes:
        file: the file, or "arguments".
        key: dotted name of the key, empty for the file as a whole.
    """

    def __init__(self, file: str, key: str, problem: str) -> None:
        super().__init__(f"{file}: {key}: {problem}" if key else f"{file}: {problem}")
        self.file, self.key, self.problem = file, key, problem


def load_settings(path: Path) -> dict[str, Any]:
    """Read a cell file into plain data, without the emulator's table.

    Raises:
        ConfigurationError: the file cannot be read, is too large or is no TOML.
    """
    try:
        content = beginning_of(path, MAX_FILE + 1)
        if len(content) > MAX_FILE:
            raise ConfigurationError(str(path), "", f"is larger than {MAX_FILE} bytes")
        data = toml_of(content)
    except OSError as error:
        raise ConfigurationError(str(path), "", f"cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, or nested without end
        raise ConfigurationError(str(path), "", f"is no TOML: {error}") from None
    data.pop("emulator", None)
    return data


def checked(model: type[_M], data: object, source: str, owner: str = "") -> _M:
    """Check plain data against a model and return it.

    Args:
        owner: whose keys they are, put behind the key; empty for the file's own.

    Raises:
        ConfigurationError: the first key that is unknown or out of bounds.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part)[:_LONGEST_PART] for part in first["loc"])
        if first["type"] == "extra_forbidden":
            problem = f"unknown key; known here: {', '.join(_known_keys(model, first['loc']))}"
        elif first["type"] == "missing":
            problem = "must be given"
        else:
            problem = f"{first['msg']}; got {shortened(first['input'])}"
        raise ConfigurationError(source, f"{key} {owner}".strip(), problem) from None


def _known_keys(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    for part in location[:-1]:
        if isinstance(part, int):  # the place in an array of tables, whose model is known by now
            continue
        annotation = model.model_fields[part].annotation
        # Of an array of tables that of one: `tuple[Table, ...]`.
        annotation = next(iter(get_args(annotation)), annotation)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            model = annotation
    return list(model.model_fields)


def settings_as_toml(settings: BaseModel, within: str = "") -> str:
    """Return settings as a TOML file, or the tables within one, that would give them again.

    Args:
        within: name of the array of tables that they are one element of; empty for a file.
    """
    lines: list[str] = [f"[[{within}]]"] if within else []
    tables: list[str] = []
    for name, value in settings.model_dump().items():
        full = f"{within}.{name}" if within else name
        if isinstance(value, dict):
            tables += ["", f"[{full}]", *_keys(value)]
        elif isinstance(value, tuple) and value and isinstance(value[0], dict):
            for table in value:
                tables += ["", f"[[{full}]]", *_keys(table)]
        else:
            lines.append(f"{name} = {_toml(value)}")
    return "\n".join(lines + tables) + "\n"


def _keys(table: dict[str, object]) -> list[str]:
    return [f"{key} = {_toml(item)}" for key, item in table.items()]


def _toml(value: object) -> str:
    match value:
        case None:
            return _toml(OFF)
        case bool():
            return "true" if value else "false"
        case str():
            # JSON's strings are TOML strings too, except for one character that TOML wants escaped.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list() | tuple():
            return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(value)
