"""A fault script: rules in order, read from a TOML file.

Each rule has a fault, its parameters and what it fits; the first that fits a frame acts on it, and
no other. Owns what the author of a wrong script is told.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from openpendant.motion.bounded_file import beginning_of
from openpendant.simplemsg import DIALECTS

from ..console import PacketToolError
from .fault_rules import RULE_CLASSES, Match, Rule, RuleTable

MAX_SCRIPT = 1_048_576
"""Largest script file, bytes."""


class FaultScriptError(PacketToolError):
    """A script that cannot be used; the text names file, rule, key and what is expected."""


class FaultScript(RuleTable):
    """A whole script."""

    about: str = ""
    """What it is for, in a sentence."""
    dialect: Literal["standard", "motoman", "pendant"] = "standard"
    """Messages to know by name and field."""
    real: Literal[4, 8] = 4
    """Bytes of a real."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    """Random choices repeat with the same seed."""
    rule: tuple[Annotated[Rule, Field(discriminator="fault")], ...]
    """The rules, in order."""

    @model_validator(mode="after")
    def _known_types(self) -> FaultScript:
        for number, rule in enumerate(self.rule, 1):
            if isinstance(rule.match.type, str):
                try:
                    type_number(rule.match.type, self.dialect)
                except ValueError as error:
                    raise ValueError(f"rule {number}: match.type: {error}") from None
        return self


def type_number(name: str, dialect: str) -> int:
    """Return the number of a message type.

    Raises:
        ValueError: the dialect has no message of that name.
    """
    known = {cls.PLACE.name: cls.PLACE.msg_type for cls in DIALECTS[dialect].messages}
    if name not in known:
        raise ValueError(f"{name!r} is no message of the {dialect} dialect")
    return known[name]


def load_script(path: Path) -> FaultScript:
    """Read a script.

    Raises:
        FaultScriptError: it cannot be read, is too large, is no TOML or no script.
    """
    try:
        content = beginning_of(path, MAX_SCRIPT + 1)
        if len(content) > MAX_SCRIPT:
            raise FaultScriptError(f"{path}: is larger than {MAX_SCRIPT} bytes")
        data = tomllib.loads(content.decode())
    except OSError as error:
        raise FaultScriptError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, or nested without end
        raise FaultScriptError(f"{path}: is no TOML: {error}") from None
    return make_script(data, str(path))


def make_script(data: dict[str, Any], source: str) -> FaultScript:
    """Check plain data and return a script.

    Args:
        data: as read from TOML.
        source: file name for the message.

    Raises:
        FaultScriptError: the first thing that is wrong, with its rule and key.
    """
    try:
        return FaultScript.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise FaultScriptError(f"{source}: {_in_one_line(dict(first))}") from None


def _in_one_line(error: dict[str, Any]) -> str:
    location = [str(part) for part in error["loc"]]
    where = ""
    known = list(FaultScript.model_fields)
    if location[:1] == ["rule"] and len(location) > 1:
        where, location = f"rule {int(location[1]) + 1}: ", location[2:]
        known = ["fault, one of: " + ", ".join(RULE_CLASSES)]
        if location and location[0] in RULE_CLASSES:
            fields = RULE_CLASSES[location[0]].model_fields
            known = list(Match.model_fields) if location[1:2] == ["match"] else list(fields)
            location = location[1:]
    key = ".".join(location)
    match error["type"]:
        case "extra_forbidden":
            problem = f"unknown key; known here: {', '.join(known)}"
        case "missing":
            problem = "is missing"
        case "union_tag_not_found" | "union_tag_invalid":
            key, problem = "fault", f"expected one of {', '.join(RULE_CLASSES)}"
        case "value_error":
            problem = str(error["ctx"]["error"])
        case _:
            problem = f"{error['msg']}; got {str(error['input'])[:60]!r}"
    return f"{where}{key}: {problem}" if key else f"{where}{problem}"
