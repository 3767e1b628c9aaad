import pickle

import pytest

from openpendant.motion.errors import (
    BadArgument,
    BranchChange,
    CertificateRefused,
    FrameUnknown,
    MotionError,
    NoMotion,
    NotFinite,
    NotTimeable,
    OutOfRange,
    RobotFileError,
    TooFast,
    TooSharp,
    UnknownRobot,
    Unreachable,
    UnsupportedKind,
    WrongJointCount,
)
from openpendant.motion.pose import Pose

SAMPLES: list[tuple[MotionError, list[str]]] = [
    (BadArgument("speed", 2.0, "0 to 1"), ["speed", "2.0", "0 to 1"]),
    (NotFinite("the joint position", 3), ["3", "the joint position"]),
    (WrongJointCount(5, 6), ["5", "6"]),
    (FrameUnknown("tool9", ("base", "root")), ["tool9", "base, root"]),
    (OutOfRange("joint_2", 2.5, -1.0, 1.5), ["joint_2", "2.5 rad", "-1.0 to 1.5 rad"]),
    (OutOfRange("joint_e1", 4.0, 0.0, 3.0, "m", 0), ["joint_e1", "4.0 m", "0.0 to 3.0 m"]),
    (TooFast("joint_1", 3.0, 2.0), ["joint_1", "3.0 rad/s", "2.0 rad/s"]),
    (TooSharp("joint_1", 9.0, 8.0), ["joint_1", "9.0 rad/s²", "8.0 rad/s²"]),
    (Unreachable(Pose.identity(), "base", 0.5, 0.25, 50, 0.5), ["base", "50.0%", "0.5 m", "0.25"]),
    (BranchChange(0.25, "joint_4", 3.0), ["joint_4", "3 rad", "25.0%"]),
    (NotTimeable(2.0, "FAIL_FORWARD"), ["2", "FAIL_FORWARD"]),
    (NoMotion(), ["already there"]),
    (CertificateRefused("velocity", "joint_1", 3.0, 2.0, 0.5, "rad/s"), ["velocity", "0.5 s"]),
    (RobotFileError("a.yaml", "dof", "is 0", (("home", "x"),)), ["a.yaml: dof: is 0", "1 more"]),
    (UnknownRobot("ur6", ("ur5",)), ["ur6", "ur5"]),
    (UnsupportedKind("hexapod", "parallel", "a Jacobian"), ["hexapod", "parallel", "a Jacobian"]),
]


@pytest.mark.parametrize(("error", "parts"), SAMPLES, ids=lambda value: type(value).__name__)
def test_the_sentence_holds_the_numbers_and_units(error: MotionError, parts: list[str]) -> None:
    assert [part for part in parts if part not in str(error)] == []
    assert "\n" not in str(error)


@pytest.mark.parametrize("error", [error for error, _ in SAMPLES], ids=lambda e: type(e).__name__)
def test_an_error_survives_the_way_between_processes(error: MotionError) -> None:
    restored = pickle.loads(pickle.dumps(error))
    assert type(restored) is type(error)
    assert str(restored) == str(error)
    assert restored.__dict__.keys() == error.__dict__.keys()


def test_every_kind_of_refusal_has_a_sample_and_a_code_of_its_own() -> None:
    kinds = set(MotionError.__subclasses__())
    assert {type(error) for error, _ in SAMPLES} == kinds
    assert len({kind.code for kind in kinds}) == len(kinds)
    assert MotionError.code not in {kind.code for kind in kinds}
