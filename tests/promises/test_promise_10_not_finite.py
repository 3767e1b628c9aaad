"""Promise 10: no number that is not finite, or that no joint has, reaches planner or robot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.server_rig import LIMITS, ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, ReplyCode, joint_array
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

GREATEST = figure(10, "greatest").bound

BAD = (math.nan, -math.nan, math.inf, -math.inf, 3e38, -3e38, GREATEST + 1.0)
TINY = (1e-45, -1e-45, -0.0)
"""Denormal or signed zero: a number like any other."""

reals = st.floats(width=32)


def judge(rig: ServerRig) -> None:
    for job in rig.jobs:
        for number in _numbers(job):
            assert math.isfinite(number), job
            assert abs(number) <= GREATEST, job
    for point in rig.points:
        assert isinstance(point, JointTrajPtFull)
        for joint in range(2):
            at = point.positions[joint]
            assert LIMITS.lower[joint] <= at <= LIMITS.upper[joint]


def _numbers(value: object) -> list[float]:
    if isinstance(value, float):
        return [value]
    if isinstance(value, tuple | list):
        return [number for each in value for number in _numbers(each)]
    names = getattr(type(value), "__dataclass_fields__", ())
    return [number for name in names for number in _numbers(getattr(value, name))]


@given(goal=st.tuples(reals, reals), speed=st.one_of(st.just(0.5), reals))
def test_promise_10_any_reals_of_a_pendant_are_in_the_limits_or_refused(
    goal: tuple[float, float], speed: float
) -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    code = pendant.move(*goal, speed=speed)
    rig.wait(50)
    assert bool(rig.jobs or rig.points) == (code is V.ACCEPTED)
    judge(rig)


@given(goal=st.tuples(reals, reals), velocity=st.one_of(st.just(0.5), reals), duration=reals)
def test_promise_10_any_reals_of_a_ros_client_are_in_the_limits_or_refused(
    goal: tuple[float, float], velocity: float, duration: float
) -> None:
    rig = ready(plans_at_once=False)
    client = rig.ros()
    client.code(JointTrajPt(0, joint_array(goal), velocity, duration))
    client.code(JointTrajPt(1, joint_array((0.1, 0.1)), 0.5, 1.0))
    rig.wait(300)
    judge(rig)


@pytest.mark.parametrize("bad", BAD)
def test_promise_10_a_bad_point_is_answered_failure_and_nothing_moves(bad: float) -> None:
    rig = ready()
    client = rig.ros()
    assert client.code(JointTrajPt(0, joint_array((bad, 0.0)), 0.5, 1.0)) is ReplyCode.FAILURE
    rig.wait(500)
    assert rig.points == []


@pytest.mark.parametrize("bad", BAD)
def test_promise_10_a_jog_at_no_speed_that_there_is_is_refused(bad: float) -> None:
    rig = ready(modes={"initial": "manual_high"})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.press(bad, 0.0) is not V.ACCEPTED
    pad.hold(100)
    assert rig.points == []


@pytest.mark.parametrize("tiny", TINY)
def test_promise_10_a_denormal_is_a_number(tiny: float) -> None:
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(tiny, 0.1) is V.ACCEPTED
    rig.wait(100)
    assert rig.activity() is Activity.MOVING
    judge(rig)


@pytest.mark.parametrize("bad", BAD)
def test_promise_10_a_position_that_no_joint_has_lets_nothing_begin(bad: float) -> None:
    rig = ready()
    pendant = rig.holder()
    rig.controller.position = (bad, 0.0)
    rig.wait(300)
    assert pendant.move(0.1, 0.1) is not V.ACCEPTED
    rig.wait(300)
    assert rig.points == []
