"""YAML files of unknown origin: one mapping read within bounds, and one written to be read back.

Owns the bounds: file size, nesting, no aliases, no duplicate keys, safe tags only. Knows nothing of
robots beyond the error it raises.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from ..bounded_file import read_text
from ..errors import RobotFileError, shortened

MAX_FILE_BYTES = 1 << 20
MAX_DEPTH = 32
MAX_NODES = 100_000
"""Most keys, values, lists and mappings together: the fullest scene has a third of them."""
MAX_SCALAR = 16_384
"""Most characters of a key or value: a number in base 60 takes the square of its length."""

# The C loader is ten times faster, but a PyYAML built without libyaml lacks it.
_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

# Classes of their own, so that reading 1e-5 as a number, as YAML 1.2 and JSON do, is limited to
# this module; the writer must know it too, to quote a name that looks like one.
_Loader: Any = type("_Loader", (_SafeLoader,), {})
_Dumper: Any = type("_Dumper", (yaml.SafeDumper,), {"ignore_aliases": lambda self, data: True})
for _either in (_Loader, _Dumper):
    _either.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)[eE][-+]?[0-9]+$"),
        list("-+.0123456789"),
    )

# What reading a scalar fails with, outside YAML's own errors: 2020-13-45 as a date, a number in
# base 60 that no real holds, and texts behind the tags of whole numbers, of truth and of time.
_VALUE_ERRORS = (ValueError, OverflowError, LookupError, AttributeError, RecursionError)

_LINE_WIDTH = 110
_LONGEST_PROBLEM = 400


def to_yaml(content: Mapping[str, Any]) -> str:
    """Return a mapping as the YAML that `read_mapping` reads back unchanged."""
    text: str = yaml.dump(
        dict(content),
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=None,
        width=_LINE_WIDTH,
        allow_unicode=True,
    )
    return text


def read_mapping(path: Path) -> dict[str, Any]:
    """Read the one mapping a YAML file holds.

    Args:
        path: the file; it is never executed, and no more than 1 MiB is read.

    Raises:
        RobotFileError: the file cannot be read, is too large, or is not a plain YAML mapping.
    """
    text = read_text(path, MAX_FILE_BYTES, RobotFileError)
    try:
        _refuse_hostile_structure(text, str(path))
        loaded = yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise RobotFileError(str(path), "", f"is not valid YAML: {_in_one_line(error)}") from error
    except _VALUE_ERRORS as error:
        problem = f"holds an unreadable value: {shortened(str(error))}"
        raise RobotFileError(str(path), "", problem) from error
    if not isinstance(loaded, dict) or not all(isinstance(key, str) for key in loaded):
        problem = "is not a mapping; accepted: a mapping of field names to values"
        raise RobotFileError(str(path), "", problem)
    return loaded


@dataclass(slots=True)
class _Level:
    mapping: bool
    at_key: bool = True
    keys: set[str] = field(default_factory=set)


def _refuse_hostile_structure(text: str, file: str) -> None:
    # The C composer recurses without a bound and crashes the process on deep nesting, and aliases
    # let a small file stand for an enormous one. The event stream is flat, so it is read first.
    stack: list[_Level] = []
    documents = nodes = 0
    for event in yaml.parse(text, Loader=_Loader):
        where = "" if event.start_mark is None else f"line {event.start_mark.line + 1}"
        nodes += isinstance(event, yaml.NodeEvent)
        if nodes > MAX_NODES:
            raise RobotFileError(file, where, f"holds more than {MAX_NODES} keys and values")
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise RobotFileError(file, where, "begins a second document; one is accepted")
        elif isinstance(event, yaml.AliasEvent):
            raise RobotFileError(file, where, "uses a YAML alias; write the value out")
        elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            if len(stack) >= MAX_DEPTH:
                raise RobotFileError(file, where, f"nests deeper than {MAX_DEPTH} levels")
            _enter_value(stack, None, file, where)
            stack.append(_Level(isinstance(event, yaml.MappingStartEvent)))
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            stack.pop()
        elif isinstance(event, yaml.ScalarEvent):
            if len(event.value) > MAX_SCALAR:
                problem = f"has a value of {len(event.value)} characters; accepted: {MAX_SCALAR}"
                raise RobotFileError(file, where, problem)
            _enter_value(stack, event.value, file, where)


def _enter_value(stack: list[_Level], key: str | None, file: str, where: str) -> None:
    if not stack or not stack[-1].mapping:
        return
    level = stack[-1]
    if level.at_key:
        if key is None:
            raise RobotFileError(file, where, "uses a list or mapping as a key")
        if key in level.keys:
            raise RobotFileError(file, where, f"repeats the key {shortened(key)}")
        level.keys.add(key)
    level.at_key = not level.at_key


def _in_one_line(error: yaml.YAMLError) -> str:
    return " ".join(str(error).split())[:_LONGEST_PROBLEM]
