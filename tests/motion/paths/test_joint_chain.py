import numpy as np
import pytest
from numpy.typing import NDArray

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, OutOfRange
from openpendant.motion.paths.path_chains import JointChain
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline

Array = NDArray[np.float64]

LIMITS = JointLimits(
    names=("joint_1", "joint_2"),
    lower=(-3.0, -3.0),
    upper=(3.0, 3.0),
    velocity=(2.0, 3.0),
    acceleration=(5.0, 8.0),
    prismatic=(False, False),
)
LINE = JointLine([0.0, 0.0], [1.0, 0.0])
CURVE = JointSpline([[1.0, 0.0], [1.2, 0.5], [1.0, 1.0]])
BACK = JointLine([1.0, 1.0], [0.0, 1.0])


def chain(*zones: float) -> JointChain:
    return JointChain([LINE, CURVE, BACK], zones, LIMITS)


def test_outside_its_zones_each_path_is_what_it_was() -> None:
    joined = chain(0.2, 0.3)

    for path, start, begin, end in (
        (LINE, 0.0, 0.0, 0.8),
        (CURVE, LINE.length, 0.2, CURVE.length - 0.3),
        (BACK, LINE.length + CURVE.length, 0.3, BACK.length),
    ):
        along = np.linspace(begin, end, 20)
        for order in (0, 1, 2):
            np.testing.assert_allclose(
                joined.evaluate(start + along, order),
                path.evaluate(along, order),
                rtol=0,
                atol=1e-10,
            )


def test_derivatives_are_those_of_the_positions_and_have_no_step() -> None:
    joined = chain(0.2, 0.3)
    s, step = np.linspace(1e-4, joined.length - 1e-4, 4001), 1e-5
    for order in (0, 1):
        ahead, behind = joined.evaluate(s + step, order), joined.evaluate(s - step, order)
        np.testing.assert_allclose(
            joined.evaluate(s, order + 1), (ahead - behind) / (2.0 * step), atol=2e-3
        )


def test_the_ends_are_exact_and_each_corner_is_a_waypoint() -> None:
    joined = chain(0.2, 0.3)
    ends = joined.evaluate(np.array([0.0, joined.length]))
    assert ends.tolist() == [[0.0, 0.0], [0.0, 1.0]]
    assert joined.goal.tolist() == [0.0, 1.0]
    wanted = np.cumsum([0.0, LINE.length, CURVE.length / 2, CURVE.length / 2, BACK.length])
    assert joined.knots[joined.waypoint_knots] == pytest.approx(wanted, abs=1e-4)
    assert (np.diff(joined.knots) > 0.0).all()


@pytest.mark.parametrize("zones", [(0.01, 0.01), (0.2, 0.3), (1.0, 0.07)])
def test_the_motion_is_certified_and_time_goes_on_strictly(zones: tuple[float, float]) -> None:
    trajectory = time_path(chain(*zones), LIMITS)
    certify(trajectory, LIMITS, start=[0.0, 0.0])
    assert (np.diff(trajectory.waypoint_times) > 0.0).all()


def test_a_way_back_on_itself_is_certified_too() -> None:
    there, back = JointLine([0.0, 0.0], [1.0, 0.5]), JointLine([1.0, 0.5], [0.0, 0.0])
    certify(time_path(JointChain([there, back], [0.4], LIMITS), LIMITS), LIMITS)


def test_no_zone_leaves_the_extent() -> None:
    joined = chain(0.2, 0.3)
    least, greatest = joined.extent()
    places = joined.evaluate(np.linspace(0.0, joined.length, 5000))
    assert (places >= least - 1e-12).all()
    assert (places <= greatest + 1e-12).all()


def test_a_zone_out_of_a_joints_range_is_refused() -> None:
    # The first runs into the corner from above while the second leaves it upwards.
    first = JointSpline([[0.0, 0.0], [0.5, 0.8], [1.0, 0.5]])
    second = JointSpline([[1.0, 0.5], [1.5, 0.8], [2.0, 0.0]])
    top = float(max(path.extent()[1][1] for path in (first, second)))
    narrow = JointLimits(
        LIMITS.names, LIMITS.lower, (3.0, top), LIMITS.velocity, LIMITS.acceleration, (False,) * 2
    )

    JointChain([first, second], [0.05], narrow)
    with pytest.raises(OutOfRange) as refusal:
        JointChain([first, second], [first.length / 2.0], narrow)
    assert refusal.value.joint == "joint_2"


@pytest.mark.parametrize("zones", [(0.2,), (0.2, 1.1), (1.1, 0.1), (0.6, 0.6)])
def test_zones_that_do_not_fit_are_refused(zones: tuple[float, ...]) -> None:
    with pytest.raises(BadArgument, match="zones"):
        chain(*zones)


def test_there_is_no_third_derivative() -> None:
    with pytest.raises(BadArgument, match="0, 1 or 2"):
        chain(0.2, 0.3).evaluate(np.zeros(1), 3)
