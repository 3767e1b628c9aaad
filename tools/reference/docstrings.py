"""Docstrings in Google's layout, taken apart: what they say first, and each of their entries."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns):$")
_ENTRY = re.compile(r"^    (\w+): (.*)$")


@dataclass(frozen=True, slots=True)
class Docstring:
    """A docstring in parts."""

    about: str
    entries: Mapping[str, Mapping[str, str]]

    @classmethod
    def of(cls, documented: object) -> Docstring:
        """Take apart what an object says of itself."""
        about: list[str] = []
        entries: dict[str, dict[str, str]] = {}
        section, name = "", ""
        for line in (inspect.getdoc(documented) or "").splitlines():
            begins, entry = _SECTION.match(line), _ENTRY.match(line)
            if begins:
                section, name = begins[1], ""
                entries[section] = {}
            elif not section:
                about.append(line)
            elif entry:
                name = entry[1]
                entries[section][name] = entry[2]
            elif name and line.strip():
                entries[section][name] += f" {line.strip()}"
        return cls("\n".join(about).strip(), entries)

    def section(self, name: str) -> Mapping[str, str]:
        """Return the entries of a section; none where it is missing."""
        return self.entries.get(name, {})


def told_of(request: type) -> Docstring:
    """Return what a declared request says of itself, and below its fields of each of them."""
    meanings = _below_fields(request.__module__)[request.__name__]
    told = Docstring.of(request)
    return replace(told, entries={**told.entries, "Args": meanings})


@cache
def _below_fields(module: str) -> Mapping[str, Mapping[str, str]]:
    """Return the texts below the fields of the classes of a module, by class and field."""
    found: dict[str, dict[str, str]] = {}
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    for declared in tree.body:
        if isinstance(declared, ast.ClassDef):
            texts = found[declared.name] = {}
            for field, text in zip(declared.body, declared.body[1:], strict=False):
                match field, text:
                    case (
                        ast.AnnAssign(target=ast.Name(id=name)),
                        ast.Expr(value=ast.Constant(value=str(told))),
                    ):
                        texts[name] = " ".join(told.split())
    return found
