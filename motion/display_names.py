"""What people call the joints of a robot, where its file does not say.

Owns the default names: those of the first paper's pendant for six turning axes, else the joint's
own name in words. No numpy here: screens and the emulator read names too.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from .robot_schema import Joint

SIX_AXIS_NAMES = ("Base", "Lower-Arm", "Upper-Arm", "Wrist-Roll", "Wrist-Pitch", "Wrist-Twist")
"""The buttons of the first paper's pendant, joint 1 to 6."""

_PARTS = re.compile(r"[_\-\s]+")
_FILLERS = frozenset({"joint", "axis"})


def display_names(driven: Sequence[Joint]) -> tuple[str, ...]:
    """Return one name per driven joint, base to tip: the file's own, else the default."""
    names = [joint.name for joint in driven]
    defaults = default_display_names(names, [joint.prismatic for joint in driven])
    return tuple(
        joint.display_name or default for joint, default in zip(driven, defaults, strict=True)
    )


def default_display_names(names: Sequence[str], prismatic: Sequence[bool]) -> tuple[str, ...]:
    """Return the names that joints get where nobody gave them any.

    Args:
        names: the joints' own names, base to tip.
        prismatic: whether each of them is measured in metres.
    """
    if len(names) == len(SIX_AXIS_NAMES) and not any(prismatic):
        return SIX_AXIS_NAMES
    return tuple(_in_words(name) for name in names)


def _in_words(name: str) -> str:
    parts = [part for part in _PARTS.split(name) if part]
    telling = [part for part in parts if part.lower() not in _FILLERS]
    if not any(any(letter.isalpha() for letter in part) for part in telling):
        telling = ["joint", *telling]
    words = " ".join(telling)
    return words[:1].upper() + words[1:]
