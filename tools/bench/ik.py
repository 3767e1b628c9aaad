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

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TypeVar

import numpy as np

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError, PoseUnreachable
from openpendant.motion.kinematics.closed_form import closed_form
from openpendant.motion.kinematics.ik import ik
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose

from .ik_peers import Eaik, IkQuestion, Solver, Toolbox
from .table import Benchmark, Bound, Judged, Sides

FAMILIES = {
    "ur5": "three parallel axes",
    "abb_irb120": "spherical wrist",
}
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
