"""Which robots stand for all of the project where a test is about mathematics, not about a file."""

from collections.abc import Iterable

import pytest

FAMILIES = {
    "puma560": "a spherical wrist, and joints that are on their own",
    "abb_irb2400": "a spherical wrist, and joint 3 coupled with joint 2 by a factor of -1",
    "fanuc_m10ia": "the same by a factor of 1",
    "ur5": "three parallel axes, and several turns of each joint",
    "rail_kr5_arc": "an arm on a rail",
    "kuka_iiwa14": "seven axes",
    "mitsubishi_rh6frh5520": "a SCARA",
    "fanuc_m410ib": "a palletiser, whose wrist follows two joints",
    "stewart_classroom": "a platform",
}
"""One robot of each kind that `motion` tells apart."""


def one_of_each_family(names: Iterable[str]) -> list[object]:
    """Return names as parameters of a test: those of `FAMILIES`, and the others in `make soak`."""
    return [
        pytest.param(name, marks=() if name in FAMILIES else pytest.mark.soak) for name in names
    ]
