"""The cases of bad input that the project names, each refused so that a person can act on it.

The tests of each reader and planner go further; this is the list as a whole.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml
from rigs.data.urdf_files import FIRST, SECOND, SOUND, THIRD, joint, robot, written
from rigs.motion.planning_scenes import pillar_task

import openpendant.motion
from openpendant.motion.description.robot import load_robot
from openpendant.motion.errors import (
    BadArgument,
    FrameFileError,
    GoalInCollision,
    MotionError,
    NotFinite,
    RobotFileError,
    SceneFileError,
    StartInCollision,
    ZoneTooLarge,
)
from openpendant.motion.frames.frame_file import frames_from_json
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.blending import JointPolyline
from openpendant.motion.paths.paths import plan_path
from openpendant.motion.paths.segments import Lin
from openpendant.motion.planning.planner import plan_free_path
from openpendant.motion.pose import Pose
from openpendant.motion.robot_import.decisions import Decisions
from openpendant.motion.robot_import.dh_file import read_dh_file
from openpendant.motion.robot_import.new_robot import Wishes, configure
from openpendant.motion.robot_import.urdf import read_urdf
from openpendant.motion.robot_import.urdf_tree import chain_to, possible_tips
from openpendant.motion.scene.scene_file import load_scene

ROBOT_FILE = Path(openpendant.motion.__path__[0]) / "robots" / "kuka_kr5_arc.yaml"
DH_HEAD = "# convention: standard\n# angles: radians\n# lengths: m\n"


@dataclass(frozen=True)
class Case:
    name: str
    refused: Callable[[Path], object]
    error: type[MotionError]
    names: tuple[str, ...]
    """What the sentence says: file, field, joint or pair, and what would be accepted."""


def urdf(text: str, *, strict: bool = False) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        model = read_urdf(written(folder, text))
        chain = chain_to(model, possible_tips(model).tips[0])
        if not strict:
            return chain
        return configure(chain, Wishes(), Decisions("tiny.urdf", lambda _: None, None, True))

    return read


def limited(limit: str) -> str:
    return robot(joint("one", "a", "b", limit=f"<limit {limit}/>"), SECOND, THIRD)


def dh_table(text: str) -> Callable[[Path], object]:
    return lambda folder: read_dh_file(written(folder, text, "arm.csv"))


def robot_file(*path: str | int, value: object) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        content = yaml.safe_load(ROBOT_FILE.read_text("utf-8"))
        *way, last = path
        place = content
        for step in way:
            place = place[step]
        place[last] = value
        return load_robot(written(folder, yaml.safe_dump(content), "arm.yaml"))

    return read


def raw_robot_file(text: str) -> Callable[[Path], object]:
    return lambda folder: load_robot(written(folder, text, "arm.yaml"))


def scene_file(entry: str) -> Callable[[Path], object]:
    text = f"schema: openpendant-scene/1\nobjects: [{{name: box, {entry}}}]"
    return lambda folder: load_scene(written(folder, text, "cell.yaml"))


def frame_file(quat: str) -> Callable[[Path], object]:
    tool = f'{{"name": "gripper", "xyz": [0, 0, 0.1], "quat": {quat}}}'
    text = f'{{"schema": "openpendant-frames/1", "tools": [{tool}]}}'
    return lambda folder: frames_from_json(text, "tools.json")


def plan_between(*, start_in_pillar: bool) -> Callable[[Path], object]:
    def plan(folder: Path) -> object:
        task = pillar_task()
        inside = task.start.copy()
        inside[0] = -0.22
        ends = (inside, task.goal) if start_in_pillar else (task.start, inside)
        return plan_free_path(task.collision.kinematics, task.collision, *ends)

    return plan


def joint_corner(folder: Path) -> object:
    return JointPolyline([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [1.5])


def tool_corner(folder: Path) -> object:
    arm = Kinematics(pillar_task().collision.kinematics.robot)
    home = arm.robot.home_position
    here = arm.forward(home)
    ends = [(0.0, 0.05, 0.0), (0.0, 0.05, 0.05)]
    poses = [Pose(here.position + np.array(end), here.quaternion) for end in ends]
    return plan_path(arm, home, [Lin(poses[0], zone=0.2), Lin(poses[1])])


CASES = [
    Case("malformed URDF", urdf(SOUND[:-9]), RobotFileError, ("tiny.urdf", "well-formed XML")),
    Case("malformed YAML", raw_robot_file("a: [1"), RobotFileError, ("arm.yaml", "line 1", "YAML")),
    Case("YAML of another shape", raw_robot_file("- 1"), RobotFileError,
         ("arm.yaml", "accepted: a mapping")),
    Case("malformed DH", dh_table(DH_HEAD + "joint,a\nj1,ten\n"), RobotFileError,
         ("arm.csv", "row 1.a", "'ten'", "accepted: a number")),
    Case("DH without a convention", dh_table("joint,a\nj1,1\n"), RobotFileError,
         ("arm.csv", "convention", "accepted: a value")),
    Case("a closed chain", urdf(robot(FIRST, SECOND, joint("loop", "a", "c"), links="abc")),
         RobotFileError, ("tiny.urdf", "link 'c'", "'two' and 'loop'", "accepted: open chains")),
    Case("missing limits", urdf(limited('effort="1"'), strict=True), RobotFileError,
         ("tiny.urdf", "joint 'one' limits", "accepted")),
    Case("a limit missing in a file", robot_file("joints", 1, value={"type": "revolute"}),
         RobotFileError, ("arm.yaml", "joints[1].name", "accepted: a value")),
    Case("zero limits", urdf(limited('lower="0" upper="0" velocity="1"')), RobotFileError,
         ("tiny.urdf", "joint 'one'.limit", "accepted: lower less")),
    Case("negative limits", urdf(limited('lower="-1" upper="1" velocity="-1"')), RobotFileError,
         ("tiny.urdf", "joint 'one'.limit.velocity", "-1", "accepted: more than 0")),
    Case("zero speed in a file", robot_file("joints", 1, "velocity", value=0.0), RobotFileError,
         ("arm.yaml", "joints[1].velocity", "is 0.0", "accepted: greater than")),
    Case("negative acceleration", robot_file("joints", 1, "acceleration", value=-2.0),
         RobotFileError, ("arm.yaml", "joints[1].acceleration", "is -2.0", "accepted: greater")),
    Case("limits the wrong way round", robot_file("joints", 1, "lower", value=3.0),
         RobotFileError, ("arm.yaml", "joints[1] (joint_a2).lower", "accepted: less than upper")),
    Case("an unnormalised quaternion in a URDF", urdf(robot(joint(
        "one", "a", "b", origin='<origin quat_xyzw="0 0 1 1"/>'), SECOND, THIRD)),
        RobotFileError, ("tiny.urdf", "joint 'one'.origin.quat_xyzw", "1.41421", "accepted: ")),
    Case("one in a DH table", lambda folder: read_dh_file(written(folder, yaml.safe_dump({
        "convention": "standard", "angles": "radians", "lengths": "m",
        "tool": {"quat": [0, 0, 0, 2]}, "joints": [{"joint": "j1"}]}), "arm.yml")),
        RobotFileError, ("arm.yml", "tool.quat", "length 2", "accepted: ")),
    Case("one in a scene", scene_file("shape: {type: sphere, radius: 1}, quaternion: [0, 0, 0, 3]"),
         SceneFileError, ("cell.yaml", "objects[0]", "quaternion of box", "accepted: ")),
    Case("one in a frame file", frame_file("[0, 0, 0, 2]"), FrameFileError,
         ("tools.json", "tools[0].quat", "length 2", "accepted: 1")),
    Case("a quaternion of no direction", lambda folder: Pose.from_values([0] * 3, [0] * 4),
         BadArgument, ("quaternion", "accepted: a norm of at least")),
    Case("NaN in a URDF", urdf(limited('lower="nan" upper="1" velocity="1"')), RobotFileError,
         ("tiny.urdf", "joint 'one'.limit.lower", "accepted: a finite number")),
    Case("NaN in a robot file", robot_file("home", 0, value=math.nan), RobotFileError,
         ("arm.yaml", "home[0]", "is nan", "accepted: a finite number")),
    Case("NaN in a DH table", dh_table(DH_HEAD + "joint,a\nj1,nan\n"), RobotFileError,
         ("arm.csv", "joints[0].a", "accepted: a finite number")),
    Case("NaN in a pose", lambda folder: Pose.from_values([0, math.nan, 0], [0, 0, 0, 1]),
         NotFinite, ("element 1 of position", "finite number")),
    Case("an axis of zero length in a URDF", urdf(robot(joint(
        "one", "a", "b", axis='<axis xyz="0 0 0"/>'), SECOND, THIRD)), RobotFileError,
        ("tiny.urdf", "joint 'one'.axis", "accepted: ", "length 1")),
    Case("an axis of zero length in a file", robot_file("joints", 1, "axis", value=[0.0] * 3),
         RobotFileError, ("arm.yaml", "joints[1] (joint_a2).axis", "accepted: a direction")),
    Case("a start in collision", plan_between(start_in_pillar=True), StartInCollision,
         ("wrist_1_link and pillar", "at the start", "accepted: a start where nothing touches")),
    Case("a goal in collision", plan_between(start_in_pillar=False), GoalInCollision,
         ("wrist_1_link and pillar", "at the goal", "accepted: a goal where nothing touches")),
    Case("a zone larger than the leg in joint space", joint_corner, ZoneTooLarge,
         ("waypoint 1", "1.5 rad", "the largest that works is")),
    Case("a zone larger than the leg of the tool", tool_corner, ZoneTooLarge,
         ("waypoint 0", "0.2 m", "the largest that works is")),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_bad_input_is_refused_with_its_place_and_what_would_be_accepted(
    tmp_path: Path, case: Case
) -> None:
    with pytest.raises(case.error) as refused:
        case.refused(tmp_path)
    sentence = str(refused.value)
    assert [part for part in case.names if part not in sentence] == [], sentence
    assert "\n" not in sentence
