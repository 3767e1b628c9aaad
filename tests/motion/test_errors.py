import pickle

import pytest

from openpendant.motion import errors

SAMPLES: list[tuple[errors.MotionError, list[str]]] = [
    (errors.BadArgument("speed", 2.0, "0 to 1"), ["speed", "2.0", "0 to 1"]),
    (errors.NotFinite("the joint position", 3), ["3", "the joint position"]),
    (errors.WrongJointCount(5, 6), ["5", "6"]),
    (errors.FrameUnknown("tool9", ("base", "root")), ["tool9", "base, root"]),
    (errors.OutOfRange("joint_2", 2.5, -1.0, 1.5), ["joint_2", "2.5 rad", "-1.0 to 1.5 rad"]),
    (errors.OutOfRange("joint_e1", 4.0, 0.0, 3.0, "m", 0), ["joint_e1", "4.0 m", "0.0 to 3.0 m"]),
    (errors.TooFast("joint_1", 3.0, 2.0), ["joint_1", "3.0 rad/s", "2.0 rad/s"]),
    (errors.TooSharp("joint_1", 9.0, 8.0), ["joint_1", "9.0 rad/s²", "8.0 rad/s²"]),
    (
        errors.PoseUnreachable((0.0, 0.0, 0.0), "base", 0.5, 0.25, 50, 0.5),
        ["base", "50.0%", "0.5 m", "0.25"],
    ),
    (errors.BranchChange(0.25, "joint_4", 3.0), ["joint_4", "3 rad", "25.0%"]),
    (errors.NotTimeable(2.0, "FAIL_FORWARD"), ["2", "FAIL_FORWARD"]),
    (errors.NoMotion(), ["already there"]),
    (
        errors.CertificateRefused("velocity", "joint_1", 3.0, 2.0, 0.5, "rad/s"),
        ["velocity", "0.5 s"],
    ),
    (
        errors.RobotFileError("a.yaml", "dof", "is 0", (("home", "x"),)),
        ["a.yaml: dof: is 0", "1 more"],
    ),
    (errors.UnknownRobot("ur6", ("ur5",)), ["ur6", "ur5"]),
    (errors.FrameExists("table"), ["'table'", "not in use"]),
    (errors.FrameCycle("table", "part"), ["'table'", "'part'"]),
    (errors.FramePredefined("base", "moved"), ["'base'", "moved"]),
    (errors.FrameInUse("table", ("part", "bin")), ["'table'", "part, bin"]),
    (errors.NotInHistory("flange", 5, 10**9, 2 * 10**9), ["'flange'", "1 to 2 s"]),
    (errors.PoorGeometry("the angle", 0.01, 0.1, "rad"), ["the angle", "0.573°", "at least 5.73°"]),
    (errors.FrameFileError("f.json", "frames[0].quat", "is 0"), ["f.json: frames[0].quat: is 0"]),
    (
        errors.PlatformLimit("stroke", "leg_2", 0.35, 0.32, "m", 1, 0.5),
        ["leg_2", "stroke", "0.35 m", "0.32 m", "50.0%"],
    ),
    (errors.NoAssembly((0.1, 0.2), 0.01, "singular"), ["0.1, 0.2 m", "singular"]),
    (errors.LibraryMissing("ruckig", "motion"), ["ruckig", "'motion' of openpendant"]),
    (errors.UnknownObject("crate", ("box",)), ["'crate'", "box"]),
    (
        errors.NothingGripped("crate", "gripper", 0.06, 0.01),
        ["gripper is 60.0 mm from crate; reach 10 mm"],
    ),
    (errors.ObjectHeld("crate", "tool0"), ["tool0 holds 'crate'"]),
    (errors.ObjectNotHeld("crate"), ["nothing holds 'crate'"]),
    (errors.DuplicateObject("box"), ["'box'", "no other object"]),
    (
        errors.SceneTooLarge(2_400, 2_000, 300),
        ["300 objects", "2400 pairs", "2000 at most", "Remove"],
    ),
    (errors.SceneFileError("s.yaml", "objects[0].size", "is 0"), ["s.yaml: objects[0].size: is 0"]),
    (errors.MeshFileError("m.stl", "byte 84", "ends there"), ["m.stl: byte 84: ends there"]),
    (errors.StartInCollision("link_3", "pillar", -0.002), ["link_3", "pillar", "start", "-2 mm"]),
    (errors.GoalInCollision("link_3", "pillar", -0.002), ["link_3", "pillar", "goal", "-2 mm"]),
    (errors.PathInCollision("link_3", "pillar", 0.0, 0.25), ["link_3", "pillar", "25.0%"]),
    (errors.NoPathFound("RRTConnect", 2.5, 400), ["RRTConnect", "400 iterations", "2.5 s"]),
    (errors.PlannerUnavailable("XYZ", ("RRTConnect",)), ["'XYZ'", "RRTConnect"]),
    (
        errors.BadCircle(errors.CircleFault.NOT_EQUIDISTANT, 0.2, 0.1),
        ["200 mm", "100 mm", "equal radii"],
    ),
    (
        errors.ZoneTooLarge(2, 0.5, 0.2, "m", "half a leg"),
        ["0.5 m", "waypoint 2", "the largest that works is 0.2 m", "half a leg"],
    ),
    (errors.SegmentRefused(3, errors.NoMotion()), ["segment 3", "already there"]),
    (
        errors.UnsupportedKind("hexapod", "parallel", "emulator"),
        ["hexapod is a parallel robot", "no emulator", "accepted: a serial", "robots list", "`ik`"],
    ),
]


@pytest.mark.parametrize(("error", "parts"), SAMPLES, ids=lambda value: type(value).__name__)
def test_the_sentence_holds_numbers_and_units(error: errors.MotionError, parts: list[str]) -> None:
    assert [part for part in parts if part not in str(error)] == []
    assert "\n" not in str(error)


@pytest.mark.parametrize("error", [error for error, _ in SAMPLES], ids=lambda e: type(e).__name__)
def test_an_error_survives_the_way_between_processes(error: errors.MotionError) -> None:
    restored = pickle.loads(pickle.dumps(error))
    assert type(restored) is type(error)
    assert str(restored) == str(error)
    assert restored.__dict__.keys() == error.__dict__.keys()


def kinds(base: type[errors.MotionError]) -> list[type[errors.MotionError]]:
    found = []
    for kind in base.__subclasses__():
        found += [kind, *kinds(kind)]
    return found


def test_every_kind_of_refusal_has_a_sample_and_a_code_of_its_own() -> None:
    every = set(kinds(errors.MotionError))
    assert all(kind.__base__ is errors.MotionError for kind in every)
    assert {type(error) for error, _ in SAMPLES} == every
    assert len({kind.code for kind in every}) == len(every)
    assert errors.MotionError.code not in {kind.code for kind in every}
