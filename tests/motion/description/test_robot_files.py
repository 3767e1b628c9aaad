import json
import math
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rigs.data.example_counts import few
from rigs.motion.loaded_robots import SERIAL
from rigs.motion.loaded_robots import load_robot as known_robot
from rigs.motion.loaded_robots import serial_robot as known_serial

from openpendant.motion.description.robot import (
    ParallelRobot,
    SerialRobot,
    load_robot,
    robot_names,
    serial_robot,
)
from openpendant.motion.description.yaml_file import MAX_FILE_BYTES, read_mapping
from openpendant.motion.errors import (
    RobotFileError,
    UnknownRobot,
    UnsupportedKind,
    WrongJointCount,
    nearest,
)

COUPLED = {
    "abb_irb1410": -1,
    "abb_irb2400": -1,
    "abb_irb4400l30": -1,
    "fanuc_m10ia": 1,
    "fanuc_m410ib": 1,
    "fanuc_r1000ia": 1,
    "fanuc_r2000ia": 1,
    "fanuc_s430i": 1,
}

KUKA, PALLETISER = "kuka_kr5_arc", "fanuc_m410ib"
SECOND, WRIST = "joints[1] (joint_a2)", "joints[3] (joint_3-wrist)"
ARM = ("collision", "forearm_link", 0)

COUPLING = {"type": "j2_j3", "state_factor": 1}

Content = dict[str, Any]

# The C one is ten times faster, but a PyYAML built without libyaml lacks it.
DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@pytest.fixture
def robot_folder(robot_module: Path) -> Path:
    return robot_module.parents[1] / "robots"


@pytest.fixture
def robot_module() -> Path:
    found = sys.modules[SerialRobot.__module__].__file__
    assert found is not None
    return Path(found)


def test_the_project_comes_with_twenty_four_robots() -> None:
    assert len(robot_names()) == 24
    assert len(SERIAL) == 23


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_loads_under_its_file_name(name: str) -> None:
    robot = load_robot(name)
    assert robot.name == name
    assert robot.sources
    assert robot.dof == len(robot.home)


@pytest.mark.parametrize("name", SERIAL)
def test_home_lies_inside_the_limits_on_the_controllers_side(name: str) -> None:
    robot = known_serial(name)
    robot.limits.check_position(robot.home_position)
    assert robot.to_model(robot.home_position) == pytest.approx(robot.home, abs=1e-15)


@pytest.mark.parametrize("name", SERIAL)
def test_an_unknown_acceleration_is_the_velocity_over_the_ramp_time(name: str) -> None:
    robot = known_serial(name)
    for joint, acceleration in zip(robot.driven, robot.limits.acceleration, strict=True):
        stated = joint.acceleration
        expected = joint.velocity / robot.acceleration_ramp_s if stated is None else stated
        assert acceleration == expected


def test_exactly_the_robots_with_a_coupled_joint_3_have_a_factor() -> None:
    factors = {name: known_serial(name).coupling.state_factor for name in SERIAL}
    assert {name: factor for name, factor in factors.items() if factor} == COUPLED


def test_abb_and_fanuc_couple_joint_3_with_opposite_signs() -> None:
    chain = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    abb, fanuc = known_serial("abb_irb2400"), known_serial("fanuc_m10ia")
    assert abb.to_controller(chain) == pytest.approx((0.1, 0.2, 0.5, 0.4, 0.5, 0.6))
    assert fanuc.to_controller(chain) == pytest.approx((0.1, 0.2, 0.1, 0.4, 0.5, 0.6))
    assert abb.to_model(abb.to_controller(chain)) == pytest.approx(chain)


def test_a_conversion_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(WrongJointCount):
        serial_robot("ur5").to_model((0.0,) * 7)


def test_a_dependent_joint_is_not_driven() -> None:
    robot = serial_robot("fanuc_m410ib")
    assert robot.limits.names == ("joint_1", "joint_2", "joint_3", "joint_4")
    assert [joint.name for joint in robot.moving if joint.dependent] == ["joint_3-wrist"]


def test_a_linear_axis_is_measured_in_metres() -> None:
    limits = serial_robot("rail_kr5_arc").limits
    assert limits.prismatic == (True, *(False,) * 6)
    assert limits.unit(0) == "m"


def test_the_parallel_robot_loads_but_has_no_serial_kinematics() -> None:
    robot = load_robot("stewart_classroom")
    assert isinstance(robot, ParallelRobot)
    assert robot.leg.home_length == 0.27
    with pytest.raises(UnsupportedKind) as refused:
        serial_robot("stewart_classroom")
    assert refused.value.kind == "parallel"
    assert "accepted: a serial robot" in str(refused.value)


@pytest.mark.parametrize("attribute", ["name", "joints"])
def test_a_robot_is_read_only(attribute: str) -> None:
    with pytest.raises(ValueError, match="frozen"):
        setattr(serial_robot("ur5"), attribute, "other")


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownRobot) as refused:
        load_robot("ur6")
    assert refused.value.known == robot_names()


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("ur55", "ur5"),
        ("UR5", "ur5"),
        ("kuka_kr6", "kuka_kr6_2"),
        ("irb120", "abb_irb120"),
        ("gp7", "motoman_gp7"),
    ],
)
def test_a_name_that_is_nearly_right_is_answered_with_the_right_one(typed: str, meant: str) -> None:
    assert nearest(typed, robot_names()) == meant
    with pytest.raises(UnknownRobot, match=f"did you mean {meant}\\?"):
        load_robot(typed)


@pytest.mark.parametrize("typed", ["zzz", "", "5", "x" * 100_000])
def test_a_name_that_is_like_none_is_answered_with_all_of_them(typed: str) -> None:
    assert nearest(typed, robot_names()) == ""


def test_loading_robots_needs_no_numpy_and_no_pinocchio() -> None:
    program = (
        "import sys; from openpendant.motion.description.robot import serial_robot;"
        "serial_robot('ur5').limits;"
        "print(sorted({'numpy', 'pinocchio', 'toppra', 'typer', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


@cache
def packaged(folder: Path, name: str) -> Content:
    """What a file of the project holds; not to be changed."""
    return read_mapping(folder / f"{name}.yaml")


def changed(tmp_path: Path, folder: Path, name: str, change: Callable[[Content], object]) -> Path:
    content = deepcopy(packaged(folder, name))
    change(content)
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.dump(content, Dumper=DUMPER, sort_keys=False))
    return path


def place_of(content: Any, way: Sequence[Any]) -> Any:
    for step in way:
        content = content[step]
    return content


def put(*path: Any) -> Callable[[Content], object]:
    *way, last, value = path
    return lambda content: place_of(content, way).__setitem__(last, value)


def drop(*path: Any) -> Callable[[Content], object]:
    *way, last = path
    return lambda content: place_of(content, way).pop(last)


def second(*path: Any) -> Callable[[Content], object]:
    """Change the second joint."""
    return put("joints", 1, *path)


def follower(*path: Any) -> Callable[[Content], object]:
    """Change the palletiser's joint 4, which follows others."""
    return put("joints", 3, "dependent", *path)


def term(*path: Any) -> Callable[[Content], object]:
    """Change the first of the joints that it follows."""
    return follower("terms", 0, *path)


TERMS = f"{WRIST}.dependent.terms"


BAD_FACTS: list[tuple[str, Callable[[Content], object], str, str]] = [
    ("ur5", put("schema", "robot-facts/2"), "schema", "robot-facts/1"),
    ("ur5", drop("schema"), "schema", "robot-facts/1"),
    ("ur5", put("kind", "hexapod"), "kind", "serial or parallel"),
    ("ur5", put("kind", ["serial"]), "kind", "serial or parallel"),
    ("ur5", put("colour", "red"), "colour", "not permitted; accepted: schema, name, manufacturer"),
    ("ur5", put("joints", 1, "axes", [0.0, 0.0, 1.0]), "joints[1].axes", "perhaps 'axis' is meant"),
    ("ur5", put("dh", "rows", 0, "alfa", 0.0), "dh.rows[0].alfa", "accepted: joint, theta_offset"),
    ("ur5", put(*ARM, "radios", 1), "collision.forearm_link[0].radios", "accepted: xyz, rpy, type"),
    ("ur5", drop("home"), "home", "required"),
    ("ur5", put("home", 0, True), "home[0]", "number"),
    ("ur5", put("home", 0, "0.5"), "home[0]", "number"),
    ("ur5", put("home", 0, math.nan), "home[0]", "is nan; accepted: a finite number"),
    ("ur5", put("home", [0.0] * 5), "home", "5 values; accepted: 6"),
    ("ur5", put("home", 2, 9.0), "home", "elbow_joint at 9.0"),
    ("ur5", put("dof", 7), "dof", "accepted: 6"),
    ("ur5", put("dof", 0), "dof", "greater than or equal to 1"),
    ("ur5", put("acceleration_ramp_s", 0.0), "acceleration_ramp_s", "greater than"),
    ("ur5", put("acceleration_ramp_s", 1e-300), "acceleration_ramp_s", "greater than"),
    ("ur5", put("tool_link", "nowhere"), "tool_link", "nowhere"),
    ("ur5", put("flange_link", "nowhere"), "flange_link", "nowhere"),
    ("ur5", put("base_frame", "parent", "nowhere"), "base_frame.parent", "never moves"),
    ("ur5", put("base_frame", "parent", "tool0"), "base_frame.parent", "never moves"),
    ("ur5", put("joints", []), "joints", "is empty"),
    ("ur5", put("joints", 1, "type", "ball"), "joints[1]", "revolute"),
    ("ur5", put("joints", 1, "origin", "xyz", [0.0, 0.0]), "joints[1].origin.xyz[2]", "required"),
    ("ur5", put("joints", 1, "axis", 2, math.inf), "joints[1].axis[2]", "finite"),
    ("ur5", drop("joints", 1, "axis"), "joints[1].axis", "required"),
    (KUKA, put("joints", 1, {"type": "revolute"}), "joints[1].name", "accepted: a value, which"),
    (
        KUKA,
        second("type", "ball"),
        "joints[1].type",
        "is 'ball'; accepted: fixed, prismatic, revolute",
    ),
    (
        KUKA,
        put("coupling", "type", "j1_j2"),
        "coupling.type",
        "is 'j1_j2'; accepted: 'none' or 'j2_j3'",
    ),
    (KUKA, put("kind", "hexapod"), "kind", "is 'hexapod'; accepted: serial or parallel"),
    (KUKA, second("axis", [0, 0, 0]), f"{SECOND}.axis", "accepted: a dir"),
    (KUKA, second("name", "joint_a1"), "joints", "called 'joint_a1'"),
    (KUKA, second("child", "base_link"), "joints", "2 links called"),
    (KUKA, second("parent", "link_5"), f"{SECOND}.parent", "link_1"),
    (KUKA, second("lower", 4.0), f"{SECOND}.lower", "accepted: less"),
    (KUKA, second("upper", 180.0), f"{SECOND}.upper", "degrees"),
    (KUKA, second("velocity", 156.0), f"{SECOND}.velocity", "degr"),
    (KUKA, second("velocity", 0.0), "joints[1].velocity", "is 0.0; accepted: greater"),
    (KUKA, second("acceleration", -1.0), "joints[1].acceleration", "accepted: greater"),
    (KUKA, second("origin", "xyz", 0, 180.0), f"{SECOND}.origin.xyz", "millimetres"),
    (KUKA, second("origin", "rpy", 0, 90.0), f"{SECOND}.origin.rpy", "degrees"),
    ("rail_kr5_arc", put("joints", 0, "upper", 3000.0), "joints[0] (joint_e1).upper", "millimetr"),
    ("abb_irb2400", put("coupling", "state_factor", 2), "coupling.state_factor", "-1, 0 or 1"),
    ("abb_irb2400", put("coupling", "state_factor", 0), "coupling.state_factor", "-1 or 1"),
    ("ur5", put("coupling", "state_factor", 1), "coupling.state_factor", "type none: 0"),
    ("mitsubishi_rh6frh5520", put("coupling", COUPLING), "coupling.type", "are revolute"),
    ("abb_irb2400", put("home", 1, 1.2), "home", "joint_3 at 1.2 rad on the controller's side"),
    (
        PALLETISER,
        term("joint", "joint_4"),
        TERMS,
        "earlier driven joint (joint_1, joint_2, joint_3)",
    ),
    (PALLETISER, term("gain", 1e6), TERMS, "gain of 1000000.0"),
    (PALLETISER, follower("offset", 90.0), f"{WRIST}.dependent.offset", "is 90.0"),
    ("ur5", put("dh", "rows", 1, "a", -425.0), "dh.rows[1] (shoulder_lift_joint).a", "millimetres"),
    (PALLETISER, follower("terms", []), "joints[3].dependent.terms", "at least 1"),
    (PALLETISER, term("joint", "joint_3"), TERMS, "each name once"),
    ("ur5", drop("dh", "rows", 5), "dh.rows", "one row per joint"),
    ("ur5", put("dh", "rows", 0, "variable", "d"), "dh.rows[0] (shoulder_pan_joint)", "theta"),
    ("ur5", put("dh", "rows", 0, "alpha", 90.0), "dh.rows[0] (shoulder_pan_joint)", "degrees"),
    ("abb_irb2400", put("vrm", "map", "sign", [1, 1]), "vrm.map.sign", "accepted: 6"),
    ("ur5", put("collision", {"nowhere": []}), "collision", "'nowhere'"),
    ("ur5", put("link_mass_kg", "nowhere", 1.0), "link_mass_kg", "'nowhere'"),
    ("stewart_classroom", put("leg", "home_length", 0.2), "leg", "min_length below home_length"),
    ("stewart_classroom", put("leg", "home_length", 0.28), "leg.home_length", "leg_1 measures"),
    ("stewart_classroom", drop("base_anchors", 0), "base_anchors", "one anchor per leg"),
    ("stewart_classroom", put("home", [0.1] * 6), "home", "6 zeros"),
]


@pytest.mark.parametrize(
    ("name", "change", "field", "accepted"),
    BAD_FACTS,
    ids=[f"{name}-{field}-{number}" for number, (name, _, field, _) in enumerate(BAD_FACTS)],
)
def test_a_wrong_fact_is_refused_with_file_field_and_what_is_accepted(
    tmp_path: Path,
    robot_folder: Path,
    name: str,
    change: Callable[[Content], object],
    field: str,
    accepted: str,
) -> None:
    path = changed(tmp_path, robot_folder, name, change)
    with pytest.raises(RobotFileError) as refused:
        load_robot(path)
    assert refused.value.file == str(path)
    matching = [problem for where, problem in refused.value.problems if where.startswith(field)]
    assert any(accepted in problem for problem in matching), refused.value.problems


def test_every_problem_of_a_file_is_listed(tmp_path: Path, robot_folder: Path) -> None:
    def change(content: Content) -> None:
        content["tool_link"] = "nowhere"
        content["joints"][1]["lower"] = 99.0

    path = changed(tmp_path, robot_folder, "ur5", change)
    with pytest.raises(RobotFileError) as refused:
        load_robot(path)
    fields = [field for field, _ in refused.value.problems]
    assert fields[0] == "tool_link"
    assert len(fields) == 3
    assert "2 more" in str(refused.value)


def test_a_file_with_the_needed_fields_only_is_enough(tmp_path: Path, robot_folder: Path) -> None:
    needed = "schema name kind dof root_link tool_link base_frame home coupling joints".split()
    needed.append("acceleration_ramp_s")

    content = packaged(robot_folder, "ur5")
    path = tmp_path / "ur5.yaml"
    path.write_text(yaml.dump({field: content[field] for field in needed}, Dumper=DUMPER))
    assert serial_robot(str(path)).limits == serial_robot("ur5").limits


def places(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    steps = value.items() if isinstance(value, dict) else ()
    for key, inner in enumerate(value) if isinstance(value, list) else steps:
        yield (*way, key)
        yield from places(inner, (*way, key))


JUNK: tuple[Any, ...] = (
    None,
    True,
    "x",
    "",
    -1,
    0,
    1e308,
    -1e-320,
    10**400,
    [],
    [[]],
    {},
    {"x": 1},
)


@settings(few(15), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
@pytest.mark.parametrize("name", ["fanuc_m410ib", "stewart_classroom"])
def test_a_file_with_anything_anywhere_loads_or_is_a_robot_file_error(
    tmp_path: Path, robot_folder: Path, name: str, data: st.DataObject
) -> None:
    content = deepcopy(packaged(robot_folder, name))
    place = data.draw(st.sampled_from(list(places(content))))
    change = put(*place, data.draw(st.sampled_from(JUNK)))
    change(content)
    path = tmp_path / "changed.yaml"
    path.write_text(json.dumps(content))
    with suppress(RobotFileError):
        json.dumps(load_robot(path).model_dump(mode="json"), allow_nan=False)


@pytest.mark.parametrize("name", robot_names())
def test_a_robot_in_json_is_the_same_robot(tmp_path: Path, robot_folder: Path, name: str) -> None:
    path = tmp_path / f"{name}.yaml"
    path.write_text(json.dumps(packaged(robot_folder, name)))
    assert load_robot(path) == known_robot(name)


@pytest.mark.parametrize("text", ["1e-5", "1E-5", "+1.e-5", ".1e-4", "1.0e-05"])
def test_an_exponent_without_a_point_is_a_number(tmp_path: Path, text: str) -> None:
    path = tmp_path / "number.yaml"
    path.write_text(f"value: {text}\nword: 1e5x\n")
    assert read_mapping(path) == {"value": 1e-5, "word": "1e5x"}


HOSTILE: list[tuple[bytes, str]] = [
    (b"", "not a mapping"),
    (b"[1, 2]", "is not a mapping; accepted: a mapping"),
    (b"just words", "not a mapping"),
    (b"1: one", "not a mapping"),
    (b"a: [1", "line 1, column 4"),
    (b"a: &x [1]\nb: *x\n", "alias"),
    (b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "alias"),
    (b"name: a\nname: b\n", "repeats the key 'name'"),
    (b"? [a, b]\n: c\n", "as a key"),
    (b"a: 1\n---\nb: 2\n", "second document"),
    (b"[" * 500_000, "nests deeper"),
    (b"{a: " * 100_000, "nests deeper"),
    (b"- " * 5_000, "nests deeper"),
    (b"a: !!python/object/apply:os.system ['true']\n", "not valid YAML"),
    (b"a: 2020-13-45\n", "unreadable value"),
    (b"\xff\xfe\xfa", "not UTF-8"),
    (b"a: \x00\n", "not valid YAML"),
    (b"#" * (MAX_FILE_BYTES + 1), "larger than 1048576 bytes"),
]


@pytest.mark.parametrize(("content", "problem"), HOSTILE, ids=[problem for _, problem in HOSTILE])
def test_a_hostile_file_is_refused_quickly(tmp_path: Path, content: bytes, problem: str) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_bytes(content)
    started = time.process_time()
    with pytest.raises(RobotFileError) as refused:
        read_mapping(path)
    assert problem in refused.value.problem
    assert "\n" not in str(refused.value)
    assert time.process_time() - started < 2.0


@pytest.mark.parametrize("name", ["missing.yaml", "folder/", "a\0b.yaml"])
def test_a_file_that_cannot_be_opened_is_a_robot_file_error(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(RobotFileError):
        load_robot(f"{tmp_path}/{name}")
