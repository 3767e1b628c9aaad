"""Poses as requests and replies hold them: position [m] and quaternion x, y, z, w."""

from __future__ import annotations

from typing import Annotated, NotRequired, TypeAlias, TypedDict

from .declaration import Default, Quaternion, ReadAsKeys, Vector


class PlacedPose(TypedDict):
    """A pose in some frame.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; left out for no rotation.
    """

    position: Vector
    orientation: NotRequired[Annotated[Quaternion, Default((0.0, 0.0, 0.0, 1.0))]]


class FoundPose(TypedDict):
    """A pose that was worked out.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    position: list[float]
    orientation: list[float]


AnyPose: TypeAlias = PlacedPose | FoundPose
"""What a call takes: a pose that somebody wrote, or one that the server found."""

Placed: TypeAlias = Annotated[AnyPose, ReadAsKeys(PlacedPose)]
"""A pose in a request."""

ORIGIN: PlacedPose = {"position": (0.0, 0.0, 0.0), "orientation": (0.0, 0.0, 0.0, 1.0)}
