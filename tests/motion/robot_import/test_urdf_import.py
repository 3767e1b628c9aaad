import math
import struct
import time
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from rigs.data.urdf_files import (
    FIRST,
    ROBOTS_FILES,
    SECOND,
    SOUND,
    THIRD,
    joint,
    robot,
    written,
)
from rigs.motion.nearness import assert_near

from openpendant.motion.errors import RobotFileError
from openpendant.motion.pose import Pose
from openpendant.motion.robot_import.dh_derivation import chain_pose
from openpendant.motion.robot_import.imported_chain import ImportedChain
from openpendant.motion.robot_import.urdf import read_urdf
from openpendant.motion.robot_import.urdf_shapes import bounding_box
from openpendant.motion.robot_import.urdf_tree import chain_to, possible_tips
from openpendant.motion.robot_import.xml_reader import MAX_XML_BYTES

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def chain_of(path: Path, tip: str | None = None) -> ImportedChain:
    model = read_urdf(path)
    return chain_to(model, tip or possible_tips(model).tips[0])


@pytest.mark.parametrize("name", ["bench_arm", "gantry_arm"])
def test_the_chain_is_where_pinocchios_own_urdf_reader_puts_it(name: str) -> None:
    path = ROBOTS_FILES / f"{name}.urdf"
    chain = chain_of(path)
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    frame = model.getFrameId(chain.tip)
    moving = [each for each in chain.joints if each.axis is not None]
    random = np.random.default_rng(3)
    for _ in range(20):
        values = random.uniform(-1.0, 1.0, len(moving))
        configuration = pinocchio.neutral(model)
        for each, value in zip(moving, values, strict=True):
            of_model = model.joints[model.getJointId(each.name)]
            circle = of_model.nq == 2
            place = slice(of_model.idx_q, of_model.idx_q + of_model.nq)
            configuration[place] = [math.cos(value), math.sin(value)] if circle else [value]
        pinocchio.framesForwardKinematics(model, data, configuration)
        expected = data.oMf[frame].homogeneous
        assert_near(chain_pose(chain.joints, values).to_matrix(), expected, 1e-12)


def test_the_chain_ends_behind_the_most_motors_at_the_link_called_tool() -> None:
    choice = possible_tips(read_urdf(ROBOTS_FILES / "bench_arm.urdf"))
    assert choice.tips == ("tool0",)
    assert choice.clear


def test_two_equal_arms_leave_the_tip_in_doubt_and_offer_where_they_part(
    tmp_path: Path,
) -> None:
    fork = robot(FIRST, joint("left", "b", "c"), joint("right", "b", "d"))
    choice = possible_tips(read_urdf(written(tmp_path, fork)))
    assert (set(choice.tips), choice.fork) == ({"c", "d"}, "b")
    assert not choice.clear


FINGER = joint("grip", "c", "d", kind="prismatic")
SLAVE = joint("slave", "c", "e", kind="prismatic", more='<mimic joint="grip"/>')


@pytest.mark.parametrize(
    ("joints", "tips"),
    [
        ((FIRST, SECOND, FINGER, SLAVE), {"c"}),
        ((FIRST, SECOND, SLAVE, FINGER, joint("pad", "e", "f", kind="fixed")), {"c"}),
        ((FIRST, SECOND, FINGER, SLAVE, joint("tcp", "c", "f", kind="fixed")), {"f"}),
        ((FIRST, SECOND, FINGER, joint("other", "c", "e")), {"d", "e"}),
        ((FIRST, SECOND, FINGER, SLAVE, joint("turn", "d", "f")), {"f"}),
        ((FIRST, SECOND, FINGER, joint("rod", "c", "e", more='<mimic joint="one"/>')), {"d", "e"}),
    ],
    ids=["two fingers", "the follower first", "a plate", "two motors", "a motor beyond", "a rod"],
)
def test_an_arm_ends_before_fingers_that_one_motor_moves(
    tmp_path: Path, joints: tuple[str, ...], tips: set[str]
) -> None:
    links = sorted({letter for letter in "abcdef" if f'link="{letter}"' in "".join(joints)})
    model = read_urdf(written(tmp_path, robot(*joints, links="".join(links))))
    assert set(possible_tips(model).tips) == tips


def test_tips_that_differ_by_fixed_joints_only_leave_no_doubt(tmp_path: Path) -> None:
    fixed = joint("plate", "c", "d", kind="fixed")
    tool = '<link name="tool0"/>' + joint("tool", "c", "tool0", kind="fixed")
    choice = possible_tips(read_urdf(written(tmp_path, robot(FIRST, SECOND, fixed, more=tool))))
    assert choice.tips == ("tool0", "d")
    assert choice.clear


def test_side_branches_are_told_and_rigid_ones_keep_their_shapes() -> None:
    chain = chain_of(ROBOTS_FILES / "bench_arm.urdf")
    told = " | ".join(chain.remarks)
    assert "branch at joint 'pointer' moves; it is left out" in told
    assert "branch 'camera' is fixed to 'wrist'" in told
    assert [shape.xyz for shape in chain.collision["wrist"]] == [(0.02, 0.0, 0.0), (0.0, 0.0, 0.06)]


def test_a_shorter_chain_is_taken_where_a_tip_is_named() -> None:
    chain = chain_of(ROBOTS_FILES / "bench_arm.urdf", tip="wrist")
    assert [each.name for each in chain.driven] == ["swing", "lift", "elbow", "roll"]


def test_masses_are_read_and_other_inertia_is_not() -> None:
    assert chain_of(ROBOTS_FILES / "bench_arm.urdf").masses == {"foot": 12.5, "shoulder": 6.0}


def test_a_mimic_of_a_mimic_follows_the_joint_with_the_motor(tmp_path: Path) -> None:
    second = joint("two", "b", "c", more='<mimic joint="one" multiplier="2" offset="0.1"/>')
    third = joint("three", "c", "d", more='<mimic joint="two" multiplier="-0.5" offset="0.3"/>')
    chain = chain_of(written(tmp_path, robot(FIRST, second, third)))
    dependence = chain.joints[2].dependent
    assert dependence is not None
    ((leader, gain),) = [(term.joint, term.gain) for term in dependence.terms]
    # three = -0.5 (2 one + 0.1) + 0.3
    assert (leader, gain) == ("one", -1.0)
    assert dependence.offset == pytest.approx(0.25)


def test_a_link_called_base_is_the_controllers_base_frame(tmp_path: Path) -> None:
    base = '<link name="base"/>' + joint("b", "a", "base", kind="fixed")
    chain = chain_of(written(tmp_path, robot(FIRST, SECOND, THIRD, more=base)))
    assert chain.base_frame is not None
    assert chain.base_frame.xyz == (0.1, 0.0, 0.2)


def test_an_expanded_file_may_still_declare_the_xacro_namespace(tmp_path: Path) -> None:
    text = SOUND.replace("<robot ", f"<robot {XACRO} ")
    assert len(chain_of(written(tmp_path, text)).driven) == 3


def test_a_unit_quaternion_places_a_joint(tmp_path: Path) -> None:
    turned = '<origin xyz="0 0 0" quat_xyzw="0 0 0.70710678 0.70710678"/>'
    chain = chain_of(written(tmp_path, robot(joint("one", "a", "b", origin=turned), links="ab")))
    assert chain.joints[0].origin.rpy == pytest.approx((0.0, 0.0, math.pi / 2.0), abs=1e-8)


def test_a_bounding_box_lies_along_the_mesh_where_that_is_smaller() -> None:
    turned = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.6)).rotation
    corners = np.array([[x, y, z] for x in (0, 2) for y in (0, 0.1) for z in (0, 0.2)]) @ turned.T
    box = bounding_box(corners)
    assert sorted(box.size) == pytest.approx([0.1, 0.2, 2.0])
    assert box.xyz == pytest.approx(tuple(corners.mean(axis=0)))


def test_a_mesh_beside_the_urdf_becomes_a_box_in_metres() -> None:
    (box,) = chain_of(ROBOTS_FILES / "gantry_arm.urdf").collision["carriage"]
    assert box.type == "box"
    assert sorted(box.size) == pytest.approx([0.12, 0.3, 0.4])


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        ('filename="none.stl"', "is not found"),
        ('filename="package://nowhere/a.stl"', "is not found"),
        ('filename="http://example.org/a.stl"', "is not found"),
        ('filename="cut.stl"', "cannot be read"),
        ('filename="scene.dae"', "cannot be read"),
        ('filename="huge.stl" scale="1e6 1e6 1e6"', "its scale?"),
    ],
)
def test_a_useless_mesh_leaves_a_remark_and_no_shape(tmp_path: Path, mesh: str, told: str) -> None:
    written(tmp_path, b"solid nothing", "cut.stl")
    written(tmp_path, b"<COLLADA/>", "scene.dae")
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    written(tmp_path, bytes(80) + struct.pack("<I", 1) + triangle, "huge.stl")
    shape = f"<collision><geometry><mesh {mesh}/></geometry></collision>"
    text = SOUND.replace('<link name="b"/>', f'<link name="b">{shape}</link>')
    chain = chain_of(written(tmp_path, text))
    assert chain.collision == {}
    assert any("link 'b'" in remark and told in remark for remark in chain.remarks)


def with_first(**parts: str) -> str:
    return robot(joint("one", "a", "b", **parts), SECOND, THIRD)


def with_link(content: str) -> str:
    return SOUND.replace('<link name="b"/>', f'<link name="b">{content}</link>')


def shape(geometry: str, origin: str = "") -> str:
    return with_link(f"<collision>{origin}<geometry>{geometry}</geometry></collision>")


def bound(limit: str) -> str:
    return with_first(limit=f"<limit {limit}/>")


BAD: list[tuple[str, str, str, str]] = [
    ("nothing", "", "", "well-formed"),
    ("no XML", "robot: 1", "", "well-formed"),
    ("cut short", SOUND[:-9], "", "well-formed"),
    ("another root", "<sdf/>", "", "<robot>"),
    ("a bomb", '<!DOCTYPE r [<!ENTITY a "aa">]>' + SOUND, "line 1", "DTD"),
    ("deep", "<robot>" + "<a>" * 99 + "</a>" * 99 + "</robot>", "line 1", "nests deeper"),
    ("xacro element", SOUND.replace("<robot ", f"<robot {XACRO} ").replace(
        "</robot>", '<xacro:include filename="a"/></robot>'), "<include>", "expand it first"),
    ("xacro value", with_first(origin='<origin xyz="${x} 0 0"/>'), "<origin>", "expand it first"),
    ("no links", "<robot/>", "", "no links"),
    ("nothing moves", robot(joint("one", "a", "b", kind="fixed"), links="ab"), "", "no joint that"),
    ("link twice", robot(FIRST, links="aab"), "link 'a'", "2 times"),
    ("joint twice", robot(FIRST, joint("one", "b", "c"), links="abc"), "joint 'one'", "2 times"),
    ("no name", SOUND.replace('name="one"', ""), "joint[0].name", "1 to 64"),
    ("no parent", SOUND.replace('<parent link="a"/>', ""), "joint 'one'.parent", "name of a link"),
    ("unknown child", robot(joint("one", "a", "z"), links="ab"), "joint 'one'.child", "'z'"),
    ("closed by a second parent", robot(FIRST, SECOND, joint("loop", "a", "c"), links="abc"),
     "link 'c'", "'two' and 'loop', so the chain is closed; accepted: open chains"),
    ("closed upon itself", robot(joint("one", "b", "c"), joint("two", "c", "b"), links="abc"),
     "link 'b'", "closed"),
    ("all in a ring", robot(joint("one", "a", "b"), joint("two", "b", "a"), links="ab"),
     "link 'a'", "closed"),
    ("two roots", robot(FIRST, links="abx"), "", "hang on nothing"),
    ("planar", with_first(kind="planar"), "joint 'one'.type", "more than one axis"),
    ("floating", with_first(kind="floating"), "joint 'one'.type", "more than one axis"),
    ("unknown type", with_first(kind="ball"), "joint 'one'.type", "accepted: revolute"),
    ("zero axis", with_first(axis='<axis xyz="0 0 0"/>'), "joint 'one'.axis", "0; accepted: a dir"),
    ("long axis", with_first(axis='<axis xyz="0 0 2"/>'), "joint 'one'.axis", "length 2"),
    ("axis of two", with_first(axis='<axis xyz="0 1"/>'), "joint 'one'.axis.xyz", "3 finite"),
    ("NaN axis", with_first(axis='<axis xyz="0 0 nan"/>'), "joint 'one'.axis.xyz", "finite"),
    ("infinite origin", with_first(origin='<origin xyz="inf 0 0"/>'), "joint 'one'.origin.xyz", ""),
    ("underscored", with_first(origin='<origin xyz="1_0 0 0"/>'), "joint 'one'.origin.xyz", ""),
    ("huge exponent", with_first(origin='<origin xyz="1e999 0 0"/>'), "joint 'one'.origin.xyz", ""),
    ("millimetres", with_first(origin='<origin xyz="400 0 0"/>'), "joint 'one'.origin.xyz", "mill"),
    ("degrees", with_first(origin='<origin rpy="0 90 0"/>'), "joint 'one'.origin.rpy", "degrees"),
    ("quaternion", with_first(origin='<origin quat_xyzw="0 0 1 1"/>'),
     "joint 'one'.origin.quat_xyzw", "length 1.41421; accepted: "),
    ("zero range", bound('lower="0" upper="0" velocity="1"'), "joint 'one'.limit",
     "accepted: lower less"),
    ("turned range", bound('lower="1" upper="-1" velocity="1"'), "joint 'one'.limit", "lower less"),
    ("half a range", bound('lower="1" velocity="1"'), "joint 'one'.limit", "upper = 0.0"),
    ("zero speed", bound('lower="-1" upper="1" velocity="0"'), "joint 'one'.limit.velocity", ""),
    ("less than no speed", bound('velocity="-1"'), "joint 'one'.limit.velocity",
     "is -1.0; accepted: more than 0"),
    ("NaN limit", bound('lower="nan" upper="1" velocity="1"'), "joint 'one'.limit.lower",
     "is 'nan'; accepted: a finite number"),
    ("zero acceleration", bound('lower="-1" upper="1" velocity="1" acceleration="0"'),
     "joint 'one'.limit.acceleration", "more than 0"),
    ("negative effort", bound('lower="-1" upper="1" velocity="1" effort="-1"'),
     "joint 'one'.limit.effort", "0 or more"),
    ("negative mass", with_link('<inertial><mass value="-1"/></inertial>'), "link 'b'.mass", "0"),
    ("flat box", shape('<box size="1 0 1"/>'), "link 'b'.collision[0].box.size", "more than 0"),
    ("no size", shape("<box/>"), "link 'b'.collision[0].box.size", "missing"),
    ("negative radius", shape('<sphere radius="-1"/>'), "link 'b'.collision[0].sphere.radius", ""),
    ("wide cylinder", shape('<cylinder radius="400" length="1"/>'),
     "link 'b'.collision[0].cylinder.radius", "100 m"),
    ("mimic of none", with_first(more="<mimic/>"), "joint 'one'.mimic.joint", "name of a joint"),
    ("mimic of a stranger", with_first(more='<mimic joint="nobody"/>'),
     "joint 'one'.mimic.joint", "between root and tip"),
    ("mimic of a later joint", with_first(more='<mimic joint="two"/>'),
     "joint 'one'.mimic.joint", "a joint before it"),
    ("mimic of itself", with_first(more='<mimic joint="one"/>'),
     "joint 'one'.mimic.joint", "back to itself"),
    ("still mimic", with_first(more='<mimic joint="two" multiplier="0"/>'),
     "joint 'one'.mimic.multiplier", "is 0"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "field", "says"), [row[1:] for row in BAD], ids=[r[0] for r in BAD]
)
def test_a_bad_urdf_is_refused_with_file_place_and_what_is_accepted(
    tmp_path: Path, text: str, field: str, says: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(RobotFileError) as refused:
        chain_of(path)
    assert refused.value.file == str(path)
    assert refused.value.field == field
    assert says in refused.value.problem
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize("tip", ["a", "z", ""])
def test_a_tip_that_is_none_is_refused_with_those_there_are(tmp_path: Path, tip: str) -> None:
    with pytest.raises(RobotFileError, match="accepted: d"):
        chain_to(read_urdf(written(tmp_path, SOUND)), tip)


@pytest.mark.parametrize(
    "raw",
    [
        b"<robot>" + b" " * MAX_XML_BYTES + b"</robot>",
        b"<robot>" + b"<link/>" * 60_000 + b"</robot>",
        b"\xff\xfe<\x00r",
        b'<?xml version="1.0" encoding="nonsense"?><robot/>',
        b"\x00" * 1000,
    ],
    ids=["large", "many elements", "cut UTF-16", "unknown encoding", "zeros"],
)
def test_a_hostile_file_is_refused_quickly(tmp_path: Path, raw: bytes) -> None:
    path = written(tmp_path, raw)
    started = time.process_time()
    with pytest.raises(RobotFileError):
        read_urdf(path)
    assert time.process_time() - started < 2.0


@pytest.mark.parametrize("name", ["missing.urdf", "folder", "a\0b.urdf"])
def test_a_file_that_cannot_be_opened_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(RobotFileError):
        read_urdf(tmp_path / name)


def test_missing_limits_are_left_open_for_whoever_configures(tmp_path: Path) -> None:
    free = joint("one", "a", "b", kind="continuous", limit="")
    bare = joint("two", "b", "c", limit="")
    first, second, third = chain_of(written(tmp_path, robot(free, bare, THIRD))).driven
    assert first.continuous
    assert (first.lower, first.velocity, second.upper) == (None, None, None)
    assert (third.lower, third.upper, third.velocity) == (-1.0, 1.5, 2.0)
