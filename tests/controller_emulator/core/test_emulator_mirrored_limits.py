"""The controller's limits hold in both directions of a joint, and a stop takes all of its way."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest
from rigs.cells.controller_rig import (
    FAILURE,
    LIMITS,
    SUCCESS,
    ControllerRig,
    full_point,
    ratio_point,
)

from openpendant.controller_emulator.error_codes import ViolationKind
from openpendant.simplemsg import JointTrajPt, JointTrajPtFull

STANDING = full_point(0, 0.0, (0.0, 0.0))

BACKWARDS: dict[ViolationKind, Sequence[JointTrajPt | JointTrajPtFull]] = {
    ViolationKind.RANGE: [ratio_point(0, (0.0, -2.001), 5.0)],
    ViolationKind.VELOCITY: [STANDING, full_point(1, 1.0, (0.0, -0.5), (0.0, -2.001))],
    ViolationKind.POSITION_STEP: [ratio_point(0, (0.0, -1.5), 0.5)],
    ViolationKind.ACCELERATION: [
        full_point(0, 0.0, (0.0, 0.0), acceleration=(0.0, 0.0)),
        full_point(1, 1.0, (0.0, -0.5), (0.0, -0.5), (0.0, -4.01)),
    ],
    ViolationKind.VELOCITY_STEP: [STANDING, full_point(1, 0.1, (0.0, -0.02), (0.0, -0.41))],
    ViolationKind.START_POSITION: [full_point(0, 0.0, (0.0, -0.011))],
    ViolationKind.START_VELOCITY: [full_point(0, 0.0, (0.0, 0.0), (0.0, -0.1))],
}


@pytest.mark.parametrize("kind", BACKWARDS)
def test_what_is_too_much_backwards_is_refused_as_it_is_forwards(kind: ViolationKind) -> None:
    rig = ControllerRig()
    assert rig.stream(*BACKWARDS[kind])[-1] == FAILURE
    assert rig.violations == {kind: 1}


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("place", "code"), [(1.88, SUCCESS), (1.885, FAILURE)])
def test_a_joint_must_be_able_to_stop_before_the_end_of_its_range(
    side: float, place: float, code: int, rig: ControllerRig
) -> None:
    """At 1 rad/s and 4.2 rad/s², 5 % above its limit, it needs 0.119 rad of the way to 2 rad."""
    rig.stream(STANDING, full_point(1, 2.0, (side * 1.5, 0.0), (side * 1.0, 0.0)))
    there = full_point(2, 2.0 + place - 1.5, (side * place, 0.0), (side * 1.0, 0.0))
    assert rig.code(there) == code


def test_a_gap_to_the_first_point_is_closed_by_a_motion_and_by_no_jump(rig: ControllerRig) -> None:
    assert rig.code(full_point(0, 0.0, (0.008, 0.0))) == SUCCESS
    places = [0.0, *(state[0][0] for state in rig.states(300))]
    assert places[-1] == pytest.approx(0.008, abs=1e-6)
    steps = [after - before for before, after in itertools.pairwise(places)]
    # From rest and back to rest at no more than the limit: the speed never exceeds √(a·d).
    assert max(steps) <= (LIMITS.acceleration[0] * 0.008) ** 0.5 * 1e-3
