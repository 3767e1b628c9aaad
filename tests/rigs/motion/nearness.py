"""Comparisons of numbers and of poses within a distance that each test states."""

from collections.abc import Sequence

import numpy as np

from openpendant.motion.pose import Array, Pose

Numbers = Array | Sequence[float] | Sequence[Sequence[float]]


def assert_near(found: Numbers, expected: Numbers, within: float) -> None:
    """Fail where a number is farther from the expected one than `within`, whatever its size."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=within)


def assert_same_pose(found: Pose, expected: Pose, within: float = 1e-12) -> None:
    """Fail where positions [m] or orientations [rad] are `within` or more apart."""
    assert found.position_distance(expected) < within
    assert found.rotation_distance(expected) < within
