import pickle
import re

import pytest

from openpendant.motion import errors
from openpendant.motion.errors import (
    BadArgument,
    BadCircle,
    BranchChange,
    CertificateRefused,
    CircleFault,
    DuplicateObject,
    FrameCycle,
    FrameExists,
    FrameFileError,
    FrameInUse,
    FramePredefined,
    FrameUnknown,
    GoalInCollision,
    LibraryMissing,
    MeshFileError,
    MotionError,
    NoAssembly,
    NoMotion,
    NoPathFound,
    NotFinite,
    NotInHistory,
    NotTimeable,
    OutOfRange,
    PathInCollision,
    PlannerUnavailable,
    PlatformLimit,
    PoorGeometry,
    PoseUnreachable,
    RobotFileError,
    SceneFileError,
    SceneTooLarge,
    SegmentRefused,
    StartInCollision,
    TooFast,
    TooSharp,
    UnknownObject,
    UnknownRobot,
    UnsupportedKind,
    WrongJointCount,
    ZoneTooLarge,
)

SAMPLES: list[tuple[MotionError, list[str]]] = [
    (BadArgument("speed", 2.0, "0 to 1"), ["speed", "2.0", "0 to 1"]),
    (NotFinite("the joint position", 3), ["3", "the joint position"]),
    (WrongJointCount(5, 6), ["5", "6"]),
    (FrameUnknown("tool9", ("base", "root")), ["tool9", "base, root"]),
    (OutOfRange("joint_2", 2.5, -1.0, 1.5), ["joint_2", "2.5 rad", "-1.0 to 1.5 rad"]),
    (OutOfRange("joint_e1", 4.0, 0.0, 3.0, "m", 0), ["joint_e1", "4.0 m", "0.0 to 3.0 m"]),
    (TooFast("joint_1", 3.0, 2.0), ["joint_1", "3.0 rad/s", "2.0 rad/s"]),
    (TooSharp("joint_1", 9.0, 8.0), ["joint_1", "9.0 rad/s²", "8.0 rad/s²"]),
    (
        PoseUnreachable((0.0, 0.0, 0.0), "base", 0.5, 0.25, 50, 0.5),
        ["base", "50.0%", "0.5 m", "0.25"],
    ),
    (BranchChange(0.25, "joint_4", 3.0), ["joint_4", "3 rad", "25.0%"]),
    (NotTimeable(2.0, "FAIL_FORWARD"), ["2", "FAIL_FORWARD"]),
    (NoMotion(), ["already there"]),
    (CertificateRefused("velocity", "joint_1", 3.0, 2.0, 0.5, "rad/s"), ["velocity", "0.5 s"]),
    (RobotFileError("a.yaml", "dof", "is 0", (("home", "x"),)), ["a.yaml: dof: is 0", "1 more"]),
    (UnknownRobot("ur6", ("ur5",)), ["ur6", "ur5"]),
    (FrameExists("table"), ["'table'", "not in use"]),
    (FrameCycle("table", "part"), ["'table'", "'part'"]),
    (FramePredefined("base", "moved"), ["'base'", "moved"]),
    (FrameInUse("table", ("part", "bin")), ["'table'", "part, bin"]),
    (NotInHistory("flange", 5, 10**9, 2 * 10**9), ["'flange'", "1 to 2 s"]),
    (PoorGeometry("the angle", 0.01, 0.1, "rad"), ["the angle", "0.573°", "at least 5.73°"]),
    (FrameFileError("f.json", "frames[0].quat", "is 0"), ["f.json: frames[0].quat: is 0"]),
    (
        PlatformLimit("stroke", "leg_2", 0.35, 0.32, "m", 1, 0.5),
        ["leg_2", "stroke", "0.35 m", "0.32 m", "50.0%"],
    ),
    (NoAssembly((0.1, 0.2), 0.01, "singular"), ["0.1, 0.2 m", "singular"]),
    (LibraryMissing("ruckig", "motion"), ["ruckig", "'motion' of openpendant"]),
    (UnknownObject("crate", ("box",)), ["'crate'", "box"]),
    (DuplicateObject("box"), ["'box'", "no other object"]),
    (SceneTooLarge(2_400, 2_000, 300), ["300 objects", "2400 pairs", "2000 at most", "Remove"]),
    (SceneFileError("s.yaml", "objects[0].size", "is 0"), ["s.yaml: objects[0].size: is 0"]),
    (MeshFileError("m.stl", "byte 84", "ends there"), ["m.stl: byte 84: ends there"]),
    (StartInCollision("link_3", "pillar", -0.002), ["link_3", "pillar", "start", "-2 mm"]),
    (GoalInCollision("link_3", "pillar", -0.002), ["link_3", "pillar", "goal", "-2 mm"]),
    (PathInCollision("link_3", "pillar", 0.0, 0.25), ["link_3", "pillar", "25.0%"]),
    (NoPathFound("RRTConnect", 2.5, 400), ["RRTConnect", "400 iterations", "2.5 s"]),
    (PlannerUnavailable("XYZ", ("RRTConnect",)), ["'XYZ'", "RRTConnect"]),
    (BadCircle(CircleFault.NOT_EQUIDISTANT, 0.2, 0.1), ["200 mm", "100 mm", "equal radii"]),
    (ZoneTooLarge(2, 0.5, 0.2, "m", "half a leg"), ["0.5 m", "waypoint 2", "0.2 m", "half a leg"]),
    (SegmentRefused(3, NoMotion()), ["segment 3", "already there"]),
    (
        UnsupportedKind("hexapod", "parallel", "emulator"),
        ["hexapod is a parallel robot", "no emulator", "accepted: a serial", "robots list", "`ik`"],
    ),
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


def kinds(base: type[MotionError]) -> list[type[MotionError]]:
    found = []
    for kind in base.__subclasses__():
        found += [kind, *kinds(kind)]
    return found


def drawn_tree() -> dict[str, list[str]]:
    """What the module's docstring says: the classes of each section, in order."""
    tree: dict[str, list[str]] = {}
    for line in str(errors.__doc__).partition("MotionError\n")[2].splitlines():
        if branch := re.match(r" *[├└]── (\w+):", line):
            tree[branch[1]] = []
        elif line.strip():
            list(tree.values())[-1].extend(re.findall(r"\w+", line))
    return tree


def test_the_tree_in_the_docstring_is_that_of_the_classes() -> None:
    drawn = [name for section in drawn_tree().values() for name in section]
    assert all(kind.__base__ is MotionError for kind in kinds(MotionError))
    assert drawn == [kind.__name__ for kind in MotionError.__subclasses__()]  # as they are defined


def test_every_class_is_public() -> None:
    names = {kind.__name__ for kind in kinds(MotionError)}
    assert set(errors.__all__) == names | {"MotionError", "CircleFault"}
    assert all(getattr(errors, name).__name__ == name for name in errors.__all__)


def test_every_kind_of_refusal_has_a_sample_and_a_code_of_its_own() -> None:
    every = set(kinds(MotionError))
    assert {type(error) for error, _ in SAMPLES} == every
    assert len({kind.code for kind in every}) == len(every)
    assert MotionError.code not in {kind.code for kind in every}
