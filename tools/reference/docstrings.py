"""Docstrings in Google's layout, taken apart: what they say first, and each of their entries."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass

_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns):$")
_ENTRY = re.compile(r"^    (\w+): (.*)$")


@dataclass(frozen=True, slots=True)
class Docstring:
    """A docstring in parts.

    Attributes:
        about: what stands before the first section.
        entries: of each section, the text by name.
    """

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
