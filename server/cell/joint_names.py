"""Joint names in sentences: a joint is told by the name that people call it.

Refusals and outcomes name a joint by its name in the robot file, or by its number from 1; a person
knows the names on the pendant's keys (Base, Lower-Arm, ...). Owns the replacement, made where a
sentence leaves for a pendant: logs, journals and programs keep what they say.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from openpendant.motion.description.limits import JointLimits


class JointNames:
    """The joints of one robot, by the names in its file and those on screens."""

    def __init__(self, limits: JointLimits) -> None:
        """Take the names of the driven joints."""
        self._names = limits.names
        self._shown = limits.display_names
        self._places = {name: place for place, name in enumerate(limits.names)}
        # The longer first, where one begins with another.
        names = sorted(map(re.escape, limits.names), key=len, reverse=True)
        self._pattern = re.compile(rf"(?<![\w-])(?:joint (\d+)|({'|'.join(names)}))(?![\w-])")

    def in_full(self, text: str) -> str:
        """Return a sentence in which each joint is told as `Upper-Arm (elbow_joint)` once.

        Where it is told again, it is by its display name.
        """
        told: set[int] = set()

        def named(place: int) -> str:
            shown, name = self._shown[place], self._names[place]
            if place in told or shown == name:
                return shown
            told.add(place)
            return f"{shown} ({name})"

        return self._replaced(text, named)

    def shortly(self, text: str) -> str:
        """Return a sentence in which each joint is told by its display name."""
        return self._replaced(text, self._shown.__getitem__)

    def _replaced(self, text: str, named: Callable[[int], str]) -> str:
        def replacement(found: re.Match[str]) -> str:
            number, name = found.groups()
            place = self._places[name] if number is None else int(number) - 1
            return named(place) if 0 <= place < len(self._names) else found.group()

        return self._pattern.sub(replacement, text)
