import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rigs.motion.loaded_robots import SERIAL, serial_robot
from rigs.motion.nearness import assert_near
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion.description.schema import Joint, JointType, Placement
from openpendant.motion.errors import RobotFileError
from openpendant.motion.kinematics.dh import dh_forward
from openpendant.motion.pose import Pose
from openpendant.motion.robot_import.dh_derivation import chain_pose, derive_table, table_residual
from openpendant.motion.robot_import.dh_file import read_dh_file
from openpendant.motion.robot_import.imported_chain import ImportedJoint

Table = dict[str, object]

ROWS: list[dict[str, Any]] = [
    {"joint": "j1", "theta": 10.0, "d": 400.0, "a": 25.0, "alpha": -90.0},
    {"joint": "j2", "theta": -90.0, "d": 3.0, "a": 315.0, "alpha": 0.0},
    {"joint": "j3", "d": 120.0, "a": 35.0, "alpha": 30.0, "theta": 5.0, "variable": "d"},
    {"joint": "j4", "theta": 0.0, "d": 365.0, "a": 0.0, "alpha": 90.0},
]


def content(convention: str = "standard", **changes: object) -> Table:
    table: Table = {"convention": convention, "angles": "degrees", "lengths": "mm"}
    return {**table, "joints": ROWS, **changes}


def written(folder: Path, table: Table, name: str = "arm.yaml") -> Path:
    path = folder / name
    path.write_text(json.dumps(table) if name.endswith(".json") else yaml.safe_dump(table))
    return path


def turn_z(angle: float) -> np.ndarray:
    return Pose.from_rpy((0, 0, 0), (0, 0, angle)).to_matrix()


def turn_x(angle: float) -> np.ndarray:
    return Pose.from_rpy((0, 0, 0), (angle, 0, 0)).to_matrix()


def shift(x: float, z: float) -> np.ndarray:
    return Pose.from_rpy((x, 0, z), (0, 0, 0)).to_matrix()


def by_definition(convention: str, joints: list[float]) -> np.ndarray:
    """The product as the books write it, in metres and radians, from the rows in degrees and mm."""
    result = np.eye(4)
    for row, q in zip(ROWS, joints, strict=True):
        theta, alpha = math.radians(float(row["theta"])), math.radians(float(row["alpha"]))
        d, a = float(row["d"]) / 1000.0, float(row["a"]) / 1000.0
        if row.get("variable") == "d":
            d += q
        else:
            theta += q
        if convention == "standard":
            result = result @ turn_z(theta) @ shift(0, d) @ shift(a, 0) @ turn_x(alpha)
        else:
            result = result @ turn_x(alpha) @ shift(a, 0) @ turn_z(theta) @ shift(0, d)
    return result


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", ["arm.yaml", "arm.json"])
def test_a_table_is_a_product_by_its_convention(tmp_path: Path, convention: str, name: str) -> None:
    chain = read_dh_file(written(tmp_path, content(convention), name))
    random = np.random.default_rng(1)
    for joints in random.uniform(-1.0, 1.0, (20, 4)):
        found = chain_pose(chain.joints, joints).to_matrix()
        assert_near(found, by_definition(convention, joints.tolist()), 1e-12)


def test_limits_rates_and_home_are_taken_in_the_declared_units(tmp_path: Path) -> None:
    turning = {"joint": "t", "lower": -90, "upper": 180, "velocity": 360, "acceleration": 720}
    sliding = {"joint": "s", "variable": "d", "lower": 0, "upper": 500, "velocity": 250}
    table = content(joints=[turning, sliding], home=[45, 100])
    chain = read_dh_file(written(tmp_path, table))
    first, second = chain.driven
    assert (first.lower, first.upper) == pytest.approx((-math.pi / 2, math.pi))
    assert (first.velocity, first.acceleration) == pytest.approx((2 * math.pi, 4 * math.pi))
    assert (second.lower, second.upper, second.velocity) == pytest.approx((0.0, 0.5, 0.25))
    assert second.acceleration is None
    assert chain.home == pytest.approx((math.pi / 4, 0.1))


def test_csv_and_yaml_say_the_same(tmp_path: Path) -> None:
    lines = ["# convention: standard", "# angles: degrees", "# lengths: mm", ""]
    lines += ["joint,theta,d,a,alpha,variable"]
    for row in ROWS:
        cells = [row.get(name, "") for name in ("joint", "theta", "d", "a", "alpha", "variable")]
        lines.append(",".join(map(str, cells)))
    path = tmp_path / "arm.csv"
    path.write_text("\r\n".join(lines))
    assert read_dh_file(path).joints == read_dh_file(written(tmp_path, content())).joints


def test_base_and_tool_are_part_of_the_chain(tmp_path: Path) -> None:
    half = math.sqrt(0.5)
    table = content(base={"xyz": [0, 0, 100]}, tool={"xyz": [50, 0, 0], "quat": [0, 0, half, half]})
    chain = read_dh_file(written(tmp_path, table))
    bare = read_dh_file(written(tmp_path, content()))
    zero = np.zeros(4)
    inner = chain_pose(bare.joints, zero).to_matrix()
    expected = shift(0, 0.1) @ inner @ shift(0.05, 0) @ turn_z(math.pi / 2)
    assert_near(chain_pose(chain.joints, zero).to_matrix(), expected, 1e-12)


def test_a_standard_table_is_kept_as_written(tmp_path: Path) -> None:
    chain = read_dh_file(written(tmp_path, content()))
    assert chain.dh is not None
    assert [row.a for row in chain.dh.rows] == pytest.approx([0.025, 0.315, 0.035, 0.0])
    assert max(table_residual(chain.joints, chain.dh)) < 1e-12
    assert read_dh_file(written(tmp_path, content("modified"))).dh is None


def imported(name: str) -> tuple[ImportedJoint, ...]:
    found = []
    for each in serial_robot(name).joints:
        axis = (
            tuple(np.array(each.axis) / math.hypot(*each.axis)) if isinstance(each, Joint) else None
        )
        ends = (each.parent, each.child, each.origin)
        found.append(ImportedJoint(each.name, each.type, *ends, axis))
    return tuple(found)


@pytest.mark.parametrize("name", one_of_each_family(SERIAL))
def test_a_table_derived_from_the_joints_of_every_robot_is_exact(name: str) -> None:
    derived = derive_table(imported(name))
    assert derived is not None
    assert derived.residual < 1e-11


@pytest.mark.parametrize("name", ["abb_irb2400", "kuka_kr5_arc", "fanuc_r2000ia", "epson_c3"])
def test_a_derived_table_has_the_lengths_of_the_published_one(name: str) -> None:
    derived, published = derive_table(imported(name)), serial_robot(name).dh
    assert derived is not None
    assert published is not None
    for row, other in zip(derived.table.rows, published.rows, strict=True):
        assert abs(row.a) == pytest.approx(abs(other.a), abs=1e-9)
        assert abs(row.d) == pytest.approx(abs(other.d), abs=1e-9)


@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(6, 200))]
)
def test_a_random_chain_has_an_exact_table(seed: int) -> None:
    random = np.random.default_rng(seed)
    joints = []
    for index in range(6):
        axis = random.normal(size=3)
        if seed % 3 == 0:
            axis = np.eye(3)[random.integers(3)] * random.choice([-1, 1])
        x, y, z, roll, pitch, yaw = random.uniform(-1.0, 1.0, 6) * (random.random(6) < 0.7)
        origin = Placement(xyz=(x, y, z), rpy=(roll, pitch, yaw))
        kind = JointType.PRISMATIC if random.random() < 0.2 else JointType.REVOLUTE
        direction = tuple((axis / np.linalg.norm(axis)).tolist())
        joints.append(ImportedJoint(f"j{index}", kind, "p", "c", origin, direction))
    derived = derive_table(tuple(joints))
    assert derived is not None
    assert derived.residual < 1e-9


def test_axes_parallel_but_for_rounding_have_no_exact_table() -> None:
    flat = Placement(xyz=(0.4, 0.0, 0.0), rpy=(0.0, 0.0, 0.0))
    tilted = Placement(xyz=(0.4, 0.1, 0.0), rpy=(3e-7, 0.0, 0.0))
    joints = tuple(
        ImportedJoint(name, JointType.REVOLUTE, "p", "c", origin, (0.0, 0.0, 1.0))
        for name, origin in (("one", flat), ("two", tilted), ("three", flat))
    )
    derived = derive_table(joints)
    assert derived is not None
    assert 1e-8 < derived.residual < 1e-5
    assert max(abs(row.d) for row in derived.table.rows) < 1.0


def test_the_residual_is_that_of_the_table_against_the_chain() -> None:
    derived = derive_table(imported("ur5"))
    assert derived is not None
    tool = derived.table.tool.model_copy(update={"xyz": (0.0, 0.0, 0.001)})
    wrong = derived.table.model_copy(update={"tool": tool})
    position, rotation = table_residual(imported("ur5"), wrong)
    assert position == pytest.approx(0.001)
    assert rotation < 1e-11
    assert dh_forward(wrong, [0.0] * 6).position.shape == (3,)


def without(key: str) -> Table:
    return {field: value for field, value in content().items() if field != key}


def row(**changes: object) -> Table:
    return content(joints=[{"joint": "j1", **changes}])


BAD: list[tuple[str, Table, str, str]] = [
    ("no convention", without("convention"), "convention", "required"),
    ("no angle unit", without("angles"), "angles", "required"),
    ("no length unit", without("lengths"), "lengths", "required"),
    ("no joints", without("joints"), "joints", "required"),
    ("empty", content(joints=[]), "joints", "at least 1"),
    ("another convention", content("khalil"), "convention", "'standard' or 'modified'"),
    ("another unit", content(angles="gradians"), "angles", "'degrees' or 'radians'"),
    ("unknown column", row(beta=1.0), "joints[0].beta", "not permitted"),
    ("text for a number", row(a="10"), "joints[0].a", "number"),
    ("NaN", row(a=math.nan), "joints[0].a", "is nan; accepted: a finite number"),
    ("no name", content(joints=[{"a": 1.0}]), "joints[0].joint", "required"),
    ("zero speed", row(velocity=0.0), "joints[0].velocity", "greater than"),
    ("another variable", row(variable="a"), "joints[0].variable", "'theta' or 'd'"),
    ("degrees as radians", content(angles="radians"), "joints[0] (j1).theta", "declared right"),
    ("millimetres as metres", content(lengths="m"), "joints[0] (j1).d", "declared right"),
    ("long quaternion", content(tool={"quat": [0, 0, 0, 2]}), "tool.quat", "2; accepted: a quat"),
    ("no quaternion", content(base={"quat": [0, 0, 0, 0]}), "base.quat", "length 0"),
    ("no upper bound", row(lower=-5.0), "joints[0] (j1).upper", "beside lower = -5 degrees"),
    ("no lower bound", row(upper=500.0), "joints[0] (j1).lower", "accepted: both, or neither"),
    ("half a stroke", row(lower=0.0, variable="d"), "joints[0] (j1).upper", "lower = 0 mm"),
    ("zero range", row(lower=10.0, upper=10.0), "joints[0] (j1).lower", "is 10 degrees; accepted: "
     "less than upper = 10 degrees"),
    ("turned range", row(lower=2.0, upper=-2.0), "joints[0] (j1).lower", "upper = -2 degrees"),
    ("both", content(tool={"rpy": [0, 0, 0], "quat": [0, 0, 0, 1]}), "tool", "one of them"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("table", "field", "says"), [each[1:] for each in BAD], ids=[each[0] for each in BAD]
)
def test_a_bad_table_is_refused_with_the_field_and_what_is_accepted(
    tmp_path: Path, table: Table, field: str, says: str
) -> None:
    path = written(tmp_path, table)
    with pytest.raises(RobotFileError) as refused:
        read_dh_file(path)
    assert refused.value.file == str(path)
    assert refused.value.field == field
    assert says in refused.value.problem


MODIFIED = "# convention: modified\n"
HEAD = "# convention: standard\n# angles: degrees\n# lengths: mm\n"


def test_a_declaration_may_be_repeated_where_it_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "arm.csv"
    path.write_text(HEAD + "# convention: standard\njoint,a\nj1,1\n")
    assert len(read_dh_file(path).driven) == 1


@pytest.mark.parametrize(
    ("text", "field", "says"),
    [
        ("", "convention", "required"),
        ("joint,a\nj1,1\n", "convention", "accepted: a value, which is required"),
        (HEAD, "joints", "at least 1"),
        (HEAD + "joint,a\nj1,ten\n", "row 1.a", "is 'ten'; accepted: a number"),
        (HEAD + "joint,a\nj1,1,2\n", "row 1", "3 cells; accepted: 2, one per column (joint, a)"),
        (HEAD + "joint,a\nj1\n", "row 1", "1 cells; accepted: 2, one per column (joint, a)"),
        (HEAD + "joint,a,lower\nj1,1,-5\n", "joints[0] (j1).upper", "both, or neither"),
        (HEAD + MODIFIED + "joint,a\nj1,1\n", "convention", "'standard' and 'modified'"),
        (HEAD + "joint,a, a\nj1,1,2\n", "columns", "2 of the name 'a'; accepted: each name once"),
        (HEAD + "joint,a\nj1,nan\n", "joints[0].a", "finite"),
        (HEAD + 'joint,a\n"j1,1\n', "", "not valid CSV"),
        ("\xff", "", "not UTF-8"),
    ],
)
def test_a_bad_csv_is_refused(tmp_path: Path, text: str, field: str, says: str) -> None:
    path = tmp_path / "arm.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(RobotFileError) as refused:
        read_dh_file(path)
    assert refused.value.field == field
    assert says in refused.value.problem
