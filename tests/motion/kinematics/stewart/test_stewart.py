import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from rigs.data.example_counts import counts
from rigs.motion.nearness import assert_near
from rigs.motion.stewart_poses import (
    PLATFORM,
    platform_robot,
    pose_of_shares,
    poses_inside,
    random_poses,
)

from openpendant.motion import errors
from openpendant.motion.kinematics.stewart.platform import (
    CLOSURE,
    StewartKinematics,
    assemble,
    uniqueness,
)
from openpendant.motion.kinematics.stewart.workspace import PlatformRule
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.pose import Array, Pose

HOME = PLATFORM.legs.home
LENGTHS = PLATFORM.home_position
LEGS = PLATFORM.legs


def moved(pose: Pose, twist: Array, time: float) -> Pose:
    """The pose after a constant twist [v; ω] of its origin."""
    turn = rotation_of_vector(time * twist[3:])
    return Pose.from_matrix(turn @ pose.rotation, pose.position + time * twist[:3])


def test_at_home_every_leg_has_its_home_length() -> None:
    assert LENGTHS == pytest.approx([0.27] * 6, abs=1e-6)
    assert PLATFORM.forward(LENGTHS).position_distance(HOME) < 1e-12


def test_the_limits_are_those_of_six_prismatic_joints() -> None:
    limits = PLATFORM.limits
    assert limits.names == tuple(f"leg_{number}" for number in range(1, 7))
    assert limits.prismatic == (True,) * 6
    assert (limits.lower[0], limits.upper[0]) == (0.22, 0.32)
    assert (limits.velocity[0], limits.acceleration[0]) == (0.05, 0.5)


def test_an_unknown_acceleration_comes_from_the_ramp() -> None:
    kinematics = StewartKinematics(platform_robot(leg={"acceleration": None}))
    assert kinematics.limits.acceleration[0] == pytest.approx(0.05 / 0.1)


@given(poses_inside)
def test_leg_lengths_lead_back_to_the_pose(pose: Pose) -> None:
    found = PLATFORM.forward(PLATFORM.inverse(pose))
    assert found.position_distance(pose) <= 1e-9
    assert found.rotation_distance(pose) <= 1e-9


@pytest.mark.parametrize("count", counts(500, 50_000))
def test_over_the_whole_workspace_the_search_takes_few_steps_and_closes(
    count: int,
) -> None:
    for pose in random_poses(count):
        found = assemble(LEGS, LEGS.lengths(pose), HOME)
        assert found.residual <= CLOSURE
        assert found.iterations <= 6
        assert math.dist(found.position, pose.position) < 1e-12


def test_no_two_poses_of_the_workspace_have_the_same_legs() -> None:
    assert uniqueness(LEGS, PLATFORM.workspace.bounds) < 0.8


def test_uniqueness_is_lost_in_a_workspace_that_is_too_large() -> None:
    assert uniqueness(LEGS, 3.0 * PLATFORM.workspace.bounds, samples=200) > 1.0


FLIPPED = Pose(-HOME.position, HOME.quaternion)


def test_another_assembly_with_the_same_legs_exists_and_is_never_the_answer() -> None:
    below = assemble(LEGS, np.array(LENGTHS), FLIPPED)
    assert below.position[2] == pytest.approx(-HOME.position[2])
    assert PLATFORM.forward(LENGTHS, seed=FLIPPED).position_distance(HOME) < 1e-12


@pytest.mark.parametrize("number", range(20))
def test_the_seed_changes_nothing(number: int) -> None:
    pose, seed = random_poses(40)[number : number + 21 : 20]
    lengths = PLATFORM.inverse(pose)
    for start in (seed, Pose.from_rpy(seed.position * 3.0, (2.0, -1.0, 3.0))):
        assert PLATFORM.forward(lengths, seed=start).position_distance(pose) < 1e-12


@pytest.mark.parametrize(
    ("lengths", "words"),
    [
        ([0.318] * 6, "outside the workspace.* needs 1.29"),
        ([0.05] * 6, "m off|singular|outside"),
        ([1.0] + [0.1] * 5, "m off|singular|outside"),
        ([0.0] * 6, "m off|singular|outside"),
        ([-0.27] * 6, "m off|singular|outside"),
        ([1e6] * 6, "m off|singular|outside"),
    ],
)
def test_legs_of_no_pose_of_the_workspace_are_refused(lengths: list[float], words: str) -> None:
    with pytest.raises(errors.NoAssembly, match=words) as refusal:
        PLATFORM.forward(lengths)
    assert refusal.value.lengths == tuple(lengths)


@pytest.mark.parametrize("number", range(10))
def test_random_legs_are_a_pose_of_the_workspace_or_refused(number: int) -> None:
    random = np.random.default_rng(number)
    for _ in range(20):
        lengths = random.uniform(PLATFORM.lower, PLATFORM.upper)
        try:
            pose = PLATFORM.forward(lengths)
        except errors.NoAssembly:
            continue
        assert LEGS.lengths(pose) == pytest.approx(lengths, abs=1e-10)
        assert PLATFORM.workspace.usage(pose) <= 1.001


@given(poses_inside)
def test_the_two_jacobians_undo_each_other(pose: Pose) -> None:
    lengths = PLATFORM.inverse(pose)
    product = PLATFORM.jacobian(lengths) @ LEGS.jacobian(pose)
    assert_near(product, np.eye(6), 1e-09)


@pytest.mark.parametrize("column", range(6))
def test_the_leg_jacobian_is_the_slope_of_the_lengths(column: int) -> None:
    twist, step = np.eye(6)[column], 1e-6
    for pose in random_poses(10):
        ahead, behind = (LEGS.lengths(moved(pose, twist, time)) for time in (step, -step))
        slope = (ahead - behind) / (2.0 * step)
        assert LEGS.jacobian(pose) @ twist == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize("column", range(6))
def test_the_rpy_jacobian_is_the_slope_by_the_six_coordinates(column: int) -> None:
    step = 1e-6 * np.eye(6)[column]
    workspace = PLATFORM.workspace
    for pose in random_poses(10):
        here = workspace.coordinates(pose)
        ahead, behind = (LEGS.lengths(workspace.pose(x)) for x in (here + step, here - step))
        slope = (ahead - behind) / 2e-6
        assert LEGS.rpy_jacobian(pose)[:, column] == pytest.approx(slope, abs=1e-8)


def test_leg_rates_and_accelerations_are_the_derivatives_of_the_lengths() -> None:
    twist = np.array([0.02, -0.01, 0.015, 0.2, -0.1, 0.3])
    step = 1e-4
    for pose in random_poses(10):
        times = (-step, 0.0, step)
        before, here, after = (LEGS.lengths(moved(pose, twist, time)) for time in times)
        motion = LEGS.motion(pose, twist, np.zeros(6))
        assert motion.length == pytest.approx(here, abs=1e-14)
        assert motion.rate == pytest.approx((after - before) / (2 * step), abs=1e-8)
        bend = (after - 2.0 * here + before) / step**2
        assert motion.acceleration == pytest.approx(bend, abs=1e-6)


def test_an_acceleration_from_rest_is_the_jacobian_times_it() -> None:
    gain = np.array([0.1, 0.2, -0.3, 1.0, -2.0, 0.5])
    for pose in random_poses(5):
        motion = LEGS.motion(pose, np.zeros(6), gain)
        assert motion.acceleration == pytest.approx(LEGS.jacobian(pose) @ gain, abs=1e-12)


def test_a_platform_motion_too_fast_or_too_sharp_for_a_leg_is_refused() -> None:
    still, up = np.zeros(6), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    along = 0.05 * HOME.position[2] / 0.27
    found = PLATFORM.check_motion(HOME, 0.05 * up, still)
    assert found.rate == pytest.approx([along] * 6, abs=1e-6)
    with pytest.raises(errors.TooFast, match=r"leg_1 .* 0\.05 m/s"):
        PLATFORM.check_motion(HOME, 0.06 * up, still)
    with pytest.raises(errors.TooSharp, match=r"leg_1 .* 0\.5 m/s²"):
        PLATFORM.check_motion(HOME, still, 0.6 * up)
    with pytest.raises(errors.NotFinite):
        PLATFORM.check_motion(HOME, math.nan * up, still)


def test_base_and_root_are_one_and_others_are_unknown() -> None:
    in_root = PLATFORM.forward(LENGTHS, "root")
    assert in_root.position.tolist() == PLATFORM.forward(LENGTHS).position.tolist()
    assert PLATFORM.forward(LENGTHS, link="platform").position[2] == pytest.approx(0.247082)
    assert PLATFORM.forward(LENGTHS, link="base").position.tolist() == [0.0, 0.0, 0.0]
    for call in (PLATFORM.forward, PLATFORM.jacobian):
        with pytest.raises(errors.FrameUnknown, match="base, root"):
            call(LENGTHS, "tool")
    with pytest.raises(errors.FrameUnknown, match="platform"):
        PLATFORM.forward(LENGTHS, link="leg_1")


@pytest.mark.parametrize("call", [PLATFORM.forward, PLATFORM.jacobian])
def test_malformed_leg_lengths_are_refused(call: object) -> None:
    assert callable(call)
    with pytest.raises(errors.WrongJointCount):
        call(LENGTHS[:5])
    for bad in (math.nan, math.inf):
        with pytest.raises(errors.NotFinite):
            call([*LENGTHS[:5], bad])


def test_a_platform_of_other_than_six_legs_is_refused() -> None:
    robot = platform_robot()
    anchors = {
        field: [anchor.model_dump() for anchor in getattr(robot, field)[:5]]
        for field in ("base_anchors", "platform_anchors")
    }
    five = platform_robot(dof=5, home=[0.0] * 5, joint_names=robot.joint_names[:5], **anchors)
    with pytest.raises(errors.BadArgument, match="6 legs"):
        StewartKinematics(five)


def test_neighbouring_legs_give_neighbouring_poses() -> None:
    line = np.linspace(PLATFORM.inverse(HOME), PLATFORM.inverse(random_poses(1)[0]), 100)
    poses = [PLATFORM.forward(lengths) for lengths in line]
    assert max(a.position_distance(b) for a, b in pairwise(poses)) < 2e-3


WORKSPACE = PLATFORM.workspace


def test_home_uses_nothing_of_the_workspace() -> None:
    assert WORKSPACE.usage(HOME) == 0.0
    assert WORKSPACE.coordinates(HOME).tolist() == [0.0] * 6


@pytest.mark.parametrize("coordinate", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_each_coordinate_alone_goes_just_to_its_bound(coordinate: int, sign: float) -> None:
    share = sign * np.eye(6)[coordinate]
    lengths = WORKSPACE.check(pose_of_shares(share))
    assert ((lengths >= PLATFORM.lower) & (lengths <= PLATFORM.upper)).all()
    with pytest.raises(errors.PlatformLimit) as refusal:
        WORKSPACE.check(pose_of_shares(1.001 * share))
    error = refusal.value
    assert (error.rule, error.limit) == (PlatformRule.WORKSPACE, 1.0)
    assert error.value == pytest.approx(1.001)
    assert error.joint == ""
    assert error.index == -1


def test_together_the_coordinates_share_the_bounds() -> None:
    third = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 1.0]) / 3.0
    WORKSPACE.check(pose_of_shares(third))
    told = r"workspace sum limit is 1, the pose needs 1\.2"
    with pytest.raises(errors.PlatformLimit, match=told):
        WORKSPACE.check(pose_of_shares(1.2 * third))


@given(poses_inside)
def test_inside_the_workspace_every_leg_is_in_its_stroke_and_its_cones(pose: Pose) -> None:
    assert WORKSPACE.check(pose) == pytest.approx(PLATFORM.legs.lengths(pose), abs=1e-15)
    assert max(swing.max() for swing in WORKSPACE.swings(pose)) < WORKSPACE.cone


@given(poses_inside)
def test_coordinates_are_read_back(pose: Pose) -> None:
    again = WORKSPACE.pose(WORKSPACE.coordinates(pose))
    assert again.position_distance(pose) < 1e-15
    assert again.rotation_distance(pose) < 1e-12


def test_a_leg_too_short_or_too_long_is_named_with_its_length() -> None:
    up = np.eye(6)[2]
    cases = ({"max_length": 0.28}, up, 0.28), ({"min_length": 0.25}, -up, 0.25)
    for limits, shares, length in cases:
        workspace = StewartKinematics(platform_robot(leg=limits)).workspace
        with pytest.raises(errors.PlatformLimit) as refusal:
            workspace.check(pose_of_shares(shares), fraction=0.5)
        error = refusal.value
        assert error.rule == PlatformRule.STROKE
        assert error.joint == f"leg_{error.index + 1}"
        assert (error.limit, error.unit, error.fraction) == (length, "m", 0.5)
        needed = PLATFORM.legs.lengths(pose_of_shares(shares))
        assert error.value == pytest.approx(needed[error.index])
        assert "50.0% of the path" in str(error)


@pytest.mark.parametrize(
    ("shares", "rule"),
    [
        ([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], PlatformRule.BASE_CONE),
        ([0.0, 0.0, 0.0, 0.9, 0.0, 0.0], PlatformRule.PLATFORM_CONE),
    ],
)
def test_a_joint_that_leaves_its_cone_is_named(shares: list[float], rule: PlatformRule) -> None:
    pose = pose_of_shares(shares)
    base, platform = WORKSPACE.swings(pose)
    if rule is PlatformRule.BASE_CONE:
        swings, cone = base, base.max() - 0.01
    else:
        swings, cone = platform, (base.max() + platform.max()) / 2.0
    assert cone < swings.max()
    narrow = StewartKinematics(platform_robot(leg={"anchor_cone_rad": float(cone)})).workspace
    with pytest.raises(errors.PlatformLimit) as refusal:
        narrow.check(pose)
    error = refusal.value
    assert error.rule == rule
    assert error.unit == "rad"
    assert error.value == pytest.approx(swings.max())
    assert error.joint == f"leg_{error.index + 1}"


def test_a_swing_is_the_angle_between_the_leg_now_and_at_home() -> None:
    up = pose_of_shares([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    then, now = (PLATFORM.legs.vectors(p.rotation, p.position)[0] for p in (HOME, up))
    cosine = then @ now / np.linalg.norm(then) / np.linalg.norm(now)
    base, platform = WORKSPACE.swings(up)
    assert base[0] == pytest.approx(math.acos(cosine))
    assert platform == pytest.approx(base)


def test_turning_the_platform_alone_swings_the_joints_on_it_farther() -> None:
    base, platform = WORKSPACE.swings(pose_of_shares([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]))
    assert platform.max() > base.max()


def test_the_workspace_stays_away_from_singularity() -> None:
    holdings = [WORKSPACE.holding(pose) for pose in random_poses(300)]
    assert min(holding.least for holding in holdings) > 0.5
    assert max(holding.condition for holding in holdings) < 5.0


def test_turned_by_a_quarter_the_platform_gives_way() -> None:
    # The classic singularity of such platforms: yaw of 90 degrees (Fichter 1986).
    quarter = Pose.from_rpy(HOME.position, (0.0, 0.0, math.pi / 2.0))
    holding = WORKSPACE.holding(quarter)
    assert holding.least < 1e-6
    assert holding.condition > 1e6
    jacobian = PLATFORM.legs.jacobian(quarter)
    twist = holding.loosest / [1.0, 1.0, 1.0, 0.12, 0.12, 0.12]
    assert jacobian @ twist == pytest.approx([0.0] * 6, abs=1e-6)
