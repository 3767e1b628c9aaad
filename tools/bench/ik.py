"""Inverse kinematics: time of an answer, beside EAIK and roboticstoolbox on the same poses.

Reachable poses of random joint positions, each asked from another random position. "Answer" is what
a user wants: the branch nearest to the seed inside the limits, checked by forward kinematics; so it
is for EAIK, whose user does that in numpy. "All branches" compares formulas with formulas, ours in
Python with theirs in C++: the joint positions of all branches of a (4, 4) target, as lists or
arrays, without limits, choice or check; its bound keeps it from getting worse. "Out of reach" asks
for reachable poses moved away from the base until they are refused, most of them not far.
The peers are the extra `oracle`; a row without its peer is left out, aloud.

A sample is the median time of a question, so that what else runs on the machine hardly counts.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError, PoseUnreachable
from openpendant.motion.kinematics.closed_form import closed_form
from openpendant.motion.kinematics.closed_form.geometry import arm_geometry
from openpendant.motion.kinematics.ik import ik
from openpendant.motion.kinematics.ik.levenberg_marquardt import rotation_angle
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose

from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

_FULL_TURN = 2.0 * np.pi
_EXACT = 1e-6  # m and rad


class IkQuestion(NamedTuple):
    """A tool pose, the same as a (4, 4) matrix, and the (n,) joint position to be near to."""

    pose: Pose
    matrix: Array
    seed: Array


Solver: TypeAlias = Callable[[IkQuestion], Array | None]
"""Answers with a (n,) joint position inside the limits, None where there is none."""


class Eaik:
    """EAIK for a robot of six revolute joints without coupling."""

    def __init__(self, kinematics: Kinematics) -> None:
        geometry = arm_geometry(kinematics.robot)
        points = np.vstack((np.zeros(3), geometry.points, geometry.tool[:3, 3]))
        library = _installed("eaik.IK_HP", "EAIK")
        self._robot = library.HPRobot(geometry.axes, np.diff(points, axis=0))
        self._to_zero = geometry.tool[:3, :3].T
        self._kinematics = kinematics
        self._weight = 1.0 / np.array(kinematics.limits.velocity) ** 2

    def aligned(self, target: Array) -> Array:
        """Return a (4, 4) target for EAIK's tool, which is aligned with the base at zero."""
        wanted = target.copy()
        wanted[:3, :3] = target[:3, :3].dot(self._to_zero)
        return wanted

    def branches(self, wanted: Array) -> Any:
        """Return all answers to an aligned target, without limits."""
        return self._robot.IK(wanted).Q

    def answer(self, question: IkQuestion) -> Array | None:
        """Return the answer nearest to the seed inside the limits, checked."""
        target = question.pose.to_matrix()
        solution = self._robot.IK(self.aligned(target))
        # It marks answers that only come near to the pose.
        found = np.array(solution.Q)[~np.array(solution.is_LS)]
        kinematics, seed = self._kinematics, question.seed
        lower, upper = kinematics.lower, kinematics.upper
        found += _FULL_TURN * np.round((seed - found) / _FULL_TURN)
        found -= _FULL_TURN * np.ceil(np.maximum(found - upper, 0.0) / _FULL_TURN)
        found += _FULL_TURN * np.ceil(np.maximum(lower - found, 0.0) / _FULL_TURN)
        found = found[((found >= lower) & (found <= upper)).all(axis=1)]
        if len(found) == 0:
            return None
        chosen: Array = found[np.argmin(((found - seed) ** 2).dot(self._weight))]
        rotation, position = kinematics.place(chosen)
        miss = math.dist(position, target[:3, 3]) + rotation_angle(rotation, target[:3, :3])
        return chosen if miss <= _EXACT else None


class Toolbox:
    """roboticstoolbox's `ik_LM` on the DH table of the robot file."""

    def __init__(self, kinematics: Kinematics) -> None:
        library = _installed("roboticstoolbox", "roboticstoolbox")
        table = kinematics.robot.dh
        if table is None:
            raise MissingRequirement(f"{kinematics.robot.name} has no DH table")
        links = [
            library.RevoluteDH(
                d=row.d, a=row.a, alpha=row.alpha, offset=row.theta_offset, qlim=limits
            )
            for row, *limits in zip(table.rows, kinematics.lower, kinematics.upper, strict=True)
        ]
        base = Pose.from_rpy(kinematics.robot.base_frame.xyz, kinematics.robot.base_frame.rpy)
        before = Pose.from_rpy(table.base.xyz, table.base.rpy).inverse().compose(base)
        after = Pose.from_rpy(table.tool.xyz, table.tool.rpy).inverse()
        self._before, self._after = before.to_matrix(), after.to_matrix()
        self._chain = library.DHRobot(links).ets()

    def answer(self, question: IkQuestion) -> Array | None:
        """Search from the seed; the library judges limits and residual itself."""
        target = self._before.dot(question.pose.to_matrix()).dot(self._after)
        found = self._chain.ik_LM(target, q0=question.seed, tol=1e-12, slimit=100)
        return found.q if found.success else None


def _installed(module: str, name: str) -> Any:
    try:
        return import_module(module)
    except ImportError as absent:
        raise MissingRequirement(f"{name} is not installed") from absent


FAMILIES = {"ur5": "three parallel axes", "abb_irb120": "spherical wrist"}
"""A robot of each family whose answer the peers can give too."""

COUPLED = "fanuc_m10ia"
NUMERIC = ("kuka_iiwa14", "rail_kr5_arc", "fanuc_m410ib", "mitsubishi_rh6frh5520")
"""Seven axes, a linear axis, four axes with levelling rods, and a SCARA."""

POSES = 200
FROM_SINGULAR = (0.0, 1e-6, 1e-4, 1e-3)
"""Distance of joint 5 from the wrist's singularity in near-singular targets [rad]."""

FARTHER = 1.2
"""The factor of a pose's distance from the base by which it is moved away, again and again."""

NOT_SLOWER = Bound(1.0)
PYTHON_TO_CPP = Bound(2.5)
NUMERIC_BOUND = Bound(600.0, judged=Judged.VALUE)
REFUSAL_BOUND = Bound(50.0, judged=Judged.VALUE)

_REPETITIONS = 5
_T = TypeVar("_T")


def benchmarks() -> list[Benchmark]:
    """Return answers, branches and refusals of each family, and answers of numeric arms."""
    found = []
    for robot, family in FAMILIES.items():
        about = f"ik {robot} ({family})"
        found += [
            _row(f"{about} all branches / EAIK", partial(_branches, robot), PYTHON_TO_CPP),
            _row(f"{about} answer / EAIK", partial(_answers, robot, Eaik), NOT_SLOWER),
            _row(f"{about} answer / RTB ik_LM", partial(_answers, robot, Toolbox), NOT_SLOWER),
            _row(f"{about} near singular", partial(_near_singular, robot), None),
        ]
    found += [
        _row(f"ik {robot} out of reach", partial(_refusals, robot), REFUSAL_BOUND)
        for robot in (*FAMILIES, COUPLED)
    ]
    found.append(_row(f"ik {COUPLED} (coupled joints)", partial(_answers, COUPLED), None))
    found += [_row(f"ik {robot}", partial(_answers, robot), NUMERIC_BOUND) for robot in NUMERIC]
    return found


def questions(kinematics: Kinematics, count: int) -> list[IkQuestion]:
    """Return reachable poses with far seeds, the same in each run."""
    return [_question(kinematics, *pair) for pair in _pairs(kinematics, count)]


def median_us(function: Callable[[_T], object], asked: Sequence[_T]) -> float:
    """Return the median time of a call [us]."""
    taken = []
    for question in asked:
        began = time.perf_counter_ns()
        function(question)
        taken.append(time.perf_counter_ns() - began)
    return statistics.median(taken) / 1e3


def answer(kinematics: Kinematics, question: IkQuestion) -> Array | None:
    """Answer as the peers do, with our solver; None where it refuses."""
    try:
        return ik.solve(kinematics, question.pose, question.seed).joint_position
    except MotionError:
        return None


def _row(name: str, sides: Callable[[], Iterator[Sides]], bound: Bound | None) -> Benchmark:
    return Benchmark(name, "us", contextmanager(sides), bound, _REPETITIONS)


def _pairs(kinematics: Kinematics, count: int) -> Iterator[tuple[Array, Array]]:
    random = np.random.default_rng(5)
    for _ in range(count):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
        yield position, seed


def _question(kinematics: Kinematics, position: Array, seed: Array) -> IkQuestion:
    pose = kinematics.forward(position)
    return IkQuestion(pose, pose.to_matrix(), seed)


def _branches(name: str) -> Iterator[Sides]:
    kinematics = Kinematics(serial_robot(name))
    form, peer = closed_form(kinematics), Eaik(kinematics)
    if form is None:
        raise ValueError(f"{name} has no closed form")
    asked = [(question.matrix, question.seed.tolist()) for question in questions(kinematics, POSES)]
    aligned = [peer.aligned(matrix) for matrix, _ in asked]
    yield Sides(
        partial(median_us, lambda question: form.branches(*question), asked),
        partial(median_us, peer.branches, aligned),
    )


def _answers(name: str, peer: type[Eaik] | type[Toolbox] | None = None) -> Iterator[Sides]:
    kinematics = Kinematics(serial_robot(name))
    asked = questions(kinematics, POSES)
    ours: Solver = partial(answer, kinematics)
    theirs = None if peer is None else partial(median_us, peer(kinematics).answer, asked)
    yield Sides(partial(median_us, ours, asked), theirs)


def _near_singular(name: str) -> Iterator[Sides]:
    kinematics = Kinematics(serial_robot(name))
    asked = []
    for number, (position, seed) in enumerate(_pairs(kinematics, POSES)):
        position[4] = FROM_SINGULAR[number % len(FROM_SINGULAR)]
        asked.append(_question(kinematics, position, seed))
    yield Sides(partial(median_us, partial(answer, kinematics), asked))


def _refusals(name: str) -> Iterator[Sides]:
    kinematics = Kinematics(serial_robot(name))
    asked = list(_out_of_reach(kinematics, POSES))
    yield Sides(partial(median_us, partial(answer, kinematics), asked))


def _out_of_reach(kinematics: Kinematics, count: int) -> Iterator[IkQuestion]:
    for question in questions(kinematics, count):
        pose, seed = question.pose, question.seed
        while not _is_out_of_reach(kinematics, pose, seed):
            pose = Pose(pose.position * FARTHER, pose.quaternion)
        yield question._replace(pose=pose)


def _is_out_of_reach(kinematics: Kinematics, pose: Pose, seed: Array) -> bool:
    try:
        ik.solve(kinematics, pose, seed)
    except MotionError as refusal:
        return isinstance(refusal, PoseUnreachable)
    return False
