"""Joint values of a robot as the ten slots of a message, and back."""

from __future__ import annotations

from collections.abc import Sequence

from .codes import JOINT_SLOTS

_PADDING = tuple((0.0,) * (JOINT_SLOTS - count) for count in range(JOINT_SLOTS + 1))
"""The unused slots of a message, by the number of those that are used."""


def joint_array(values: Sequence[float]) -> tuple[float, ...]:
    """Return joint values padded with zeros to the ten slots of a message.

    Raises:
        ValueError: there are more than ten values.
    """
    if len(values) > JOINT_SLOTS:
        raise ValueError(f"{len(values)} joints do not fit the {JOINT_SLOTS} slots of a message")
    return tuple(values) + _PADDING[len(values)]
