import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from rigs.motion.loaded_robots import serial_robot
from rigs.motion.planning_scenes import pillar_scene, pillar_task

from openpendant.motion.cli import plan_command
from openpendant.motion.cli.plan_command import main
from openpendant.motion.scene.scene_file import save_scene

Capture = pytest.CaptureFixture[str]

TASK = pillar_task()
START, GOAL = (json.dumps(each.tolist()) for each in TASK[1:])


UR5 = ["--robot", "ur5"]
SWING = [*UR5, "--start", START, "--goal", GOAL]


@pytest.fixture
def scene(tmp_path: Path) -> list[str]:
    save_scene(pillar_scene(), tmp_path / "scene.yaml")
    return ["--scene", str(tmp_path / "scene.yaml")]


def test_a_plan_is_one_line_of_json_and_the_same_again(capsys: Capture, scene: list[str]) -> None:
    answers = []
    for _ in range(2):
        assert main([*SWING, *scene, "--seed", "4", "--json", "-"]) == 0
        captured = capsys.readouterr()
        assert captured.err == ""
        (line,) = captured.out.splitlines()
        answers.append(json.loads(line))
    assert answers[0]["certificate"]["valid"] is True
    assert answers[0]["position"] == answers[1]["position"]
    assert not TASK.collision.any_collides(np.array(answers[0]["position"]))


def test_the_table_names_the_unit_of_every_joint(capsys: Capture) -> None:
    robot = serial_robot("mitsubishi_rh6frh5520")
    limits, home = robot.limits, robot.home_position
    goal = json.dumps([home[0] + 0.2, *home[1:]])
    assert main(["--robot", "mitsubishi_rh6frh5520", "--goal", goal]) == 0
    told = capsys.readouterr().out
    assert "[s]" in told
    assert told.count("[mm]") == sum(limits.prismatic) == 1
    assert told.count("[°]") == limits.dof - 1


@pytest.mark.parametrize(("names", "shown"), [("display", "Upper-Arm"), ("file", "elbow_joint")])
def test_the_table_names_joints_as_asked_for(capsys: Capture, names: str, shown: str) -> None:
    goal = [math.degrees(value) for value in serial_robot("ur5").home]
    goal[0] += 5.0
    told = ("--robot", "ur5", "--goal", json.dumps(goal), "--degrees", "--names", names)
    assert main(told) == 0
    table = capsys.readouterr().out
    assert shown.partition("_")[0] in table
    assert ("Base" in table) == (names == "display")


def test_every_output_holds_every_sample(capsys: Capture, scene: list[str], tmp_path: Path) -> None:
    files = {name: str(tmp_path / f"plan.{name}") for name in ("csv", "json", "ros", "plot")}
    options = [word for name, file in files.items() for word in (f"--{name}", file)]
    assert main([*SWING, *scene, *options]) == 0
    shown = capsys.readouterr().out
    assert "certificate: valid" in shown
    assert "-64.17" in shown  # the start, in degrees
    whole = json.loads(Path(files["json"]).read_text())
    with Path(files["csv"]).open() as stream:
        header, *rows = csv.reader(stream)
    message = yaml.safe_load(Path(files["ros"]).read_text())
    assert len(header) == 19
    assert len(rows) == len(message["points"]) == len(whole["times"])
    assert message["joint_names"] == whole["joint_names"]
    assert message["points"][-1]["positions"] == TASK.goal.tolist()
    assert Path(files["plot"]).read_bytes().startswith(b"\x89PNG")


def test_programs_visit_joints_and_poses(capsys: Capture, scene: list[str], tmp_path: Path) -> None:
    pose = TASK.collision.kinematics.forward(TASK.start)
    goal = {"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()}
    (tmp_path / "program.json").write_text(json.dumps([TASK.goal.tolist(), goal]))
    argv = [*UR5, "--start", START, "--program", str(tmp_path / "program.json")]
    assert main([*argv, *scene, "--json", "-", "--speed", "0.5"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["goals"]) == 2
    last = TASK.collision.kinematics.forward(answer["position"][-1])
    assert last.position_distance(pose) < 1e-4


def test_a_bar_is_shown_for_what_takes_long(
    capsys: Capture, scene: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan_command, "BAR_AFTER", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert main([*SWING, *scene, "--json", "-"]) == 0
    assert "goal 1 of 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("argv", "code", "said"),
    [
        (["--robot", "ur6", "--goal", GOAL], 2, "ur6"),
        (UR5, 2, "--goal"),
        ([*UR5, "--goal", GOAL, "--pose", "{}"], 2, "--goal"),
        ([*UR5, "--goal", "[1, 2"], 2, "JSON"),
        ([*UR5, "--goal", "[1, 2]"], 2, "2 joint values"),
        ([*UR5, "--goal", "[1, 2, 3, 4, 5, NaN]"], 2, "finite"),
        ([*UR5, "--goal", "[9, 0, 0, 0, 0, 0]"], 3, "shoulder_pan_joint"),
        ([*UR5, "--goal", GOAL, "--planner", "EST"], 2, "EST"),
        ([*UR5, "--goal", GOAL, "--scene", "no.yaml"], 2, "no.yaml"),
        ([*UR5, "--program", "no.json"], 2, "no.json"),
        ([*UR5, "--goal", GOAL, "--speed", "2"], 2, "speed"),
        ([*UR5, "--goal", GOAL, "--csv", "no/such/folder.csv"], 74, "no/such"),
        (["--robot", "stewart_classroom", "--goal", GOAL], 3, "stewart"),
        ([*UR5, "--pose", '{"xyz": [9, 0, 0], "quat": [0, 0, 0, 1]}'], 3, "reach"),
        ([*UR5, "--nonsense"], 2, "--nonsense"),
        (
            ["--robot", "ur5", "--pose", '{"xyz": [0.4, 0, 0.3], "quat": [0, 0, 0, 2]}'],
            2,
            "quat of pose is [0.0, 0.0, 0.0, 2.0]; accepted: four numbers of norm 1",
        ),
        ([*UR5, "--goal", "home"], 2, "is 'home'; accepted: a JSON list of joint values"),
    ],
)
def test_a_refusal_is_line_and_code(capsys: Capture, argv: list[str], code: int, said: str) -> None:
    assert main(argv) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    assert said in line


@pytest.mark.parametrize(
    ("scene_object", "told"),
    [
        ("{name: a, shape: {type: sphere, radius: 0.1}, link: moon}", "objects[0].link: is 'moon'"),
        ("{name: jig, shape: {type: mesh, file: jig.stl}}", "objects[0].shape.file: names a mesh"),
        ("{name: jig, shape: {type: mesh, file: cut.stl}}", "cut.stl: byte 3: ends"),
    ],
)  # fmt: skip
def test_a_scene_that_does_not_fit_is_refused_with_its_file_and_field(
    capsys: Capture, tmp_path: Path, scene_object: str, told: str
) -> None:
    (tmp_path / "cut.stl").write_bytes(b"cut")
    file = tmp_path / "scene.yaml"
    file.write_text(f"schema: openpendant-scene/1\nobjects: [{scene_object}]\n")
    assert main([*UR5, "--goal", GOAL, "--scene", str(file)]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"error: {file}: objects[0].")
    assert told in line
    assert "accepted: " in line


def test_a_goal_in_the_pillar_names_it(capsys: Capture, scene: list[str]) -> None:
    goal = TASK.goal.copy()
    goal[0] = -0.22
    argv = [*UR5, "--start", START, "--goal", json.dumps(goal.tolist())]
    assert main([*argv, *scene]) == 3
    assert "pillar touch at the goal" in capsys.readouterr().err
