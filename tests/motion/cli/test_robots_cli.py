import ast
import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rigs.motion.increments_tried_before import take_increments_as_accepted
from rigs.motion.loaded_robots import arm, serial_robot
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion.cli.robots import main
from openpendant.motion.description.robot import robot_names
from openpendant.motion.description.yaml_file import read_mapping
from openpendant.motion.kinematics.ik.singularity import dexterity
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.tools.console import ExitCode

Capture = pytest.CaptureFixture[str]

HOME_UR5 = json.dumps(serial_robot("ur5").home)


def answer(capsys: Capture, *argv: str) -> Any:
    assert main(argv) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    (line,) = captured.out.splitlines()
    return json.loads(line)


def refusal(capsys: Capture, *argv: str) -> tuple[int, str]:
    code = main(argv)
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("error: ")
    return code, line


@pytest.fixture
def unseen_robot(tmp_path: Path) -> Path:
    """A robot file the project has never seen: a UR5 with a longer forearm and no DH table."""
    content = serial_robot("ur5").model_dump(mode="json", by_alias=True)
    content |= {"name": "ur5_long", "dh": None}
    content["joints"][3]["origin"]["xyz"][2] += 0.25
    path = tmp_path / "ur5_long.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_fk_prints_the_pose_as_one_json_line(capsys: Capture) -> None:
    home = serial_robot("ur5").home_position
    pose = arm("ur5").forward(home)
    told = {"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist(), "frame": "base"}
    found = answer(capsys, "fk", "ur5", "--joints", HOME_UR5)
    assert {name: found[name] for name in told} == told
    assert list(found)[:3] == list(told)
    assert {*found} - {*told} == {
        *("position", "orientation", "matrix", "rpy", "rpy_unique", "axis_angle"),
        *("configuration", "limits"),
    }


def test_fk_of_a_coupled_robot_takes_the_files_angles_unless_told(capsys: Capture) -> None:
    robot = serial_robot("fanuc_m10ia")
    chain = (0.1, 0.3, -0.2, 0.4, -0.9, 0.6)
    controller = robot.to_controller(chain)
    assert controller != pytest.approx(chain)
    by_file = answer(capsys, "fk", "fanuc_m10ia", "--joints", json.dumps(chain))
    options = ("--angles", "controller", "--joints", json.dumps(controller))
    by_controller = answer(capsys, "fk", "fanuc_m10ia", *options)
    assert by_file["xyz"] == pytest.approx(by_controller["xyz"], abs=1e-12)
    assert by_file["xyz"] == pytest.approx(Kinematics(robot).forward(controller).position.tolist())


def test_fk_in_the_root_frame_differs_by_the_base_frame(capsys: Capture) -> None:
    in_base = answer(capsys, "fk", "fanuc_m10ia", "--joints", "[0,0,0,0,0,0]")
    in_root = answer(capsys, "fk", "fanuc_m10ia", "--joints", "[0,0,0,0,0,0]", "--frame", "root")
    assert in_root["frame"] == "root"
    assert np.subtract(in_root["xyz"], in_base["xyz"]) == pytest.approx([0.0, 0.0, 0.45])


@pytest.mark.parametrize(("frame", "angles"), [("base", "controller"), ("root", "file")])
@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "fanuc_m410ib", "rail_kr5_arc"])
def test_ik_undoes_fk(capsys: Capture, name: str, frame: str, angles: str) -> None:
    options = ("--frame", frame, "--angles", angles)
    joints = json.dumps([value + 0.02 for value in serial_robot(name).home])
    pose = answer(capsys, "fk", name, "--joints", joints, *options)
    found = answer(capsys, "ik", name, "--pose", json.dumps(pose), "--angles", angles)
    assert found["frame"] == frame
    assert found["angles"] == angles
    again = answer(capsys, "fk", name, "--joints", json.dumps(found["joints"]), *options)
    assert again["xyz"] == pytest.approx(pose["xyz"], abs=1e-5)
    assert again["quat"] == pytest.approx(pose["quat"], abs=1e-4)
    assert found["position_error"] <= 1e-5
    assert found["rotation_error"] <= 1e-4
    assert found["restarts"] >= 0


def test_ik_starts_from_the_seed(capsys: Capture) -> None:
    pose = answer(capsys, "fk", "ur5", "--joints", HOME_UR5)
    del pose["frame"]
    seed = [*serial_robot("ur5").home]
    seed[5] -= 2.0 * math.pi - 0.1
    found = answer(capsys, "ik", "ur5", "--pose", json.dumps(pose), "--seed", json.dumps(seed))
    assert found["joints"][5] == pytest.approx(-2.0 * math.pi)


def test_a_robot_file_never_seen_works_everywhere(capsys: Capture, unseen_robot: Path) -> None:
    file = str(unseen_robot)
    long_arm = answer(capsys, "fk", file, "--joints", "[0,0,0,0,0,0]")
    ur5 = answer(capsys, "fk", "ur5", "--joints", "[0,0,0,0,0,0]")
    assert math.dist(long_arm["xyz"], ur5["xyz"]) == pytest.approx(0.25)
    del long_arm["frame"]
    assert answer(capsys, "ik", file, "--pose", json.dumps(long_arm))["restarts"] >= 0
    assert answer(capsys, "show", file, "--json")["facts"]["name"] == "ur5_long"
    assert main(["check", file]) == 0


def test_fk_beyond_a_limit_answers_and_notes_it(capsys: Capture) -> None:
    assert main(["fk", "ur5", "--joints", "[90,0,0,0,0,0]"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["frame"] == "base"
    assert captured.err.startswith("note: shoulder_pan_joint at 90.0 rad")


def test_list_names_every_robot(capsys: Capture) -> None:
    assert [robot["name"] for robot in answer(capsys, "list", "--json")] == list(robot_names())
    assert main(["list"]) == 0
    table = capsys.readouterr().out
    assert [name for name in robot_names() if name not in table] == []


@pytest.mark.parametrize(
    ("pose", "told"),
    [
        ('{"xyz":[0,0],"quat":[0,0,0,1]}', "xyz of --pose is [0.0, 0.0]; accepted: a list of 3"),
        ('{"xyz":[0,0,0],"quat":[0,1]}', "quat of --pose is [0.0, 1.0]; accepted: a list of 4"),
    ],
)
def test_a_pose_of_too_few_numbers_is_refused_by_the_name_it_was_typed_under(
    capsys: Capture, pose: str, told: str
) -> None:
    assert told in refusal(capsys, "ik", "ur5", "--pose", pose)[1]


def test_no_page_prints_a_zero_with_a_sign(capsys: Capture, tmp_path: Path) -> None:
    content = serial_robot("ur5").model_dump(mode="json", by_alias=True)
    for row in content["dh"]["rows"]:
        for field in ("theta_offset", "d", "a", "alpha"):
            row[field] = row[field] or -0.0
    content["home"] = [value or -0.0 for value in content["home"]]
    content["base_frame"] = {"parent": "base_link", "xyz": [-0.0] * 3, "rpy": [-0.0] * 3}
    path = tmp_path / "ur5.yaml"
    path.write_text(yaml.safe_dump(content))
    assert main(["show", str(path)]) == 0
    assert re.findall(r"(?<!\S)-0(?:\.0+)?(?![\d.])", capsys.readouterr().out) == []


def test_show_prints_degrees_and_millimetres(capsys: Capture) -> None:
    assert main(["show", "abb_irb2400"]) == 0
    shown = capsys.readouterr().out
    for part in ("IRB 2400/10", "1550 mm", "-60.00°", "705", "Upper-Arm + Lower-Arm"):
        assert part in shown


@pytest.mark.parametrize("name", one_of_each_family(robot_names()))
def test_show_prints_a_page_of_every_robot(capsys: Capture, name: str) -> None:
    assert main(["show", name]) == 0
    assert name in capsys.readouterr().out


@pytest.mark.parametrize("name", one_of_each_family(robot_names()))
def test_show_changes_no_number(capsys: Capture, name: str) -> None:
    shown = answer(capsys, "show", name, "--json")["facts"]
    for field in ("home", "dof", "sources", "notes"):
        assert shown[field] == packaged(name)[field]


def packaged(name: str) -> dict[str, Any]:
    import openpendant.motion.description.robot as module

    return read_mapping(Path(str(module.__file__)).parents[1] / "robots" / f"{name}.yaml")


def test_check_says_what_is_wrong_and_fails(capsys: Capture, tmp_path: Path) -> None:
    content = packaged("ur5")
    content["dh"]["rows"][1]["a"] += 0.001
    skewed = tmp_path / "skewed.yaml"
    skewed.write_text(yaml.safe_dump(content))
    content["home"][2] = 9.0
    content["joints"][1]["velocity"] = 180.0
    broken = tmp_path / "broken.yaml"
    broken.write_text(yaml.safe_dump(content))
    assert main(["check", str(skewed), str(broken), "ur5"]) == ExitCode.FAILED
    report = capsys.readouterr().out
    assert "the table and the joints differ by 1.0e-03 m" in report
    assert "home: puts elbow_joint at 9.0" in report
    assert "is this in degrees?" in report
    assert "1 of 3 robots are good" in report


def test_check_refuses_a_platform_whose_legs_fit_two_poses(capsys: Capture, tmp_path: Path) -> None:
    content = packaged("stewart_classroom")
    assert main(["check", "stewart_classroom"]) == 0
    assert "so their lengths tell the pose" in capsys.readouterr().out
    content["workspace"] = {name: 3.0 * bound for name, bound in content["workspace"].items()}
    large = tmp_path / "stewart_classroom.yaml"
    large.write_text(yaml.safe_dump(content))
    assert main(["check", str(large)]) == ExitCode.FAILED
    assert "accepted: less than 1, by a smaller workspace" in capsys.readouterr().out


def test_check_of_a_missing_file_fails(capsys: Capture, tmp_path: Path) -> None:
    assert main(["check", str(tmp_path / "none.yaml")]) == ExitCode.FAILED
    assert "No such file" in capsys.readouterr().out


USAGE: list[tuple[str, ...]] = [
    (),
    ("jog",),
    ("fk",),
    ("fk", "ur5"),
    ("fk", "ur5", "--joints", HOME_UR5, "--frame", "world"),
    ("fk", "ur5", "--joints", HOME_UR5, "--nonsense"),
    ("fk", "ur6", "--joints", HOME_UR5),
    ("fk", "/no/such/file.yaml", "--joints", HOME_UR5),
    ("fk", "ur5", "--joints", ""),
    ("fk", "ur5", "--joints", "not json"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0"),
    ("fk", "ur5", "--joints", "{}"),
    ("fk", "ur5", "--joints", "1"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,0,0]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,NaN]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,-Infinity]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,1e999]"),
    ("fk", "ur5", "--joints", f"[0,0,0,0,0,{'9' * 1000}]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,true]"),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,null]"),
    ("fk", "ur5", "--joints", '[0,0,0,0,0,"0"]'),
    ("fk", "ur5", "--joints", "[0,0,0,0,0,[0]]"),
    ("fk", "ur5", "--joints", "[" * 4000),
    ("fk", "ur5", "--joints", "[" * 1_000_000),
    ("fk", "ur5", "--joints", '["\\n\\u001b[31m"]'),
    ("ik", "ur5"),
    ("ik", "ur5", "--pose", "[]"),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,0,1],"rpy":[0,0,0]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0],"quat":[0,0,0,1]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,1]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,0,0]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,NaN,0],"quat":[0,0,0,1]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,1e300,0],"quat":[0,0,0,1]}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,0,1],"frame":"moon"}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,0,1],"frame":4}'),
    ("ik", "ur5", "--pose", '{"xyz":[0,0,0],"quat":[0,0,0,1],"frame":"root"}', "--frame", "base"),
    ("ik", "ur5", "--pose", '{"xyz":[0.4,0,0.4],"quat":[0,0,0,1]}', "--seed", "[0]"),
    ("ik", "ur5", "--pose", '{"xyz":[0.4,0,0.4],"quat":[0,0,0,1]}', "--seed", "nan"),
    ("ik", "ur5", "--pose", '{"xyz":[0.4,0,0.4],"quat":[0,0,0,1]}', "--restarts", "-1"),
    ("check",),
    ("check", "ur6"),
    ("show", "ur6"),
    ("list", "ur5"),
]


@pytest.mark.parametrize("argv", USAGE, ids=lambda argv: " ".join(argv)[:60] or "nothing")
def test_bad_input_is_one_line_on_standard_error(capsys: Capture, argv: tuple[str, ...]) -> None:
    code, line = refusal(capsys, *argv)
    assert code == ExitCode.USAGE
    assert len(line) < 500
    assert line.isprintable()


def test_ik_undoes_fk_of_a_platforms_legs(capsys: Capture) -> None:
    lengths = [0.27, 0.27, 0.272, 0.268, 0.27, 0.275]
    pose = answer(capsys, "fk", "stewart_classroom", "--joints", json.dumps(lengths))
    found = answer(capsys, "ik", "stewart_classroom", "--pose", json.dumps(pose), "--all")
    assert found["joints"] == pytest.approx(lengths, abs=1e-9)
    assert found["configuration"] is None


@pytest.mark.parametrize(
    ("argv", "parts"),
    [
        (("fk", "stewart_classroom", "--joints", "[0,0,0,0,0,0]"), ["legs"]),
        (("ik", "stewart_classroom", "--pose", '{"xyz":[0,0,9],"quat":[0,0,0,1]}'), ["leg"]),
        (("show", "stewart_classroom", "--frames"), ["there is no DH table for one; accepted: a"]),
        (
            ("ik", "ur5", "--pose", '{"xyz":[9,0,0.4],"quat":[0,0,0,1]}', "--restarts", "5"),
            ["not reachable: the nearest position", "x 9 m"],
        ),
    ],
)
def test_what_a_robot_cannot_do_is_refused_in_words(
    capsys: Capture, argv: tuple[str, ...], parts: list[str]
) -> None:
    code, line = refusal(capsys, *argv)
    assert code == ExitCode.REFUSED
    assert [part for part in parts if part not in line] == []


def test_show_names_joints_as_in_the_file_where_asked_for(capsys: Capture) -> None:
    assert main(["show", "abb_irb2400", "--names", "file"]) == 0
    shown = capsys.readouterr().out
    assert "joint_3 + joint_2" in shown
    assert "Upper-Arm" not in shown


def test_show_says_where_the_roboanalyzer_has_another_payload(capsys: Capture) -> None:
    assert main(["show", "abb_irb2400"]) == 0
    assert "payload 20 kg, ours 12 kg" in " ".join(capsys.readouterr().out.split())
    theirs = answer(capsys, "show", "abb_irb2400", "--json")["facts"]["specs"]["vrm"]
    assert theirs == {
        "payload_kg": 20.0,
        "weight_kg": 380.0,
        "differences": ["payload 20 kg, ours 12 kg"],
    }


def test_degrees_are_taken_for_angles_and_metres_stay(capsys: Capture) -> None:
    home = (*(math.degrees(value) for value in serial_robot("ur5").home),)
    by_degrees = answer(capsys, "fk", "ur5", "--degrees", "--joints", json.dumps(home))
    assert by_degrees["xyz"] == pytest.approx(answer(capsys, *FK_HOME)["xyz"], abs=1e-12)
    rail = answer(capsys, "fk", "rail_kr5_arc", "--joints", "[0.5,0.1,-1.5,1.5,0,1.5,0]")
    turned = [0.5, *map(math.degrees, (0.1, -1.5, 1.5, 0.0, 1.5, 0.0))]
    again = answer(capsys, "fk", "rail_kr5_arc", "--degrees", "--joints", json.dumps(turned))
    assert again["xyz"] == pytest.approx(rail["xyz"], abs=1e-12)


FK_HOME = ("fk", "ur5", "--joints", HOME_UR5)


@pytest.mark.parametrize("degrees", [False, True])
def test_a_pose_may_have_roll_pitch_and_yaw(capsys: Capture, degrees: bool) -> None:
    found = answer(capsys, *FK_HOME)
    rpy = [math.degrees(angle) for angle in found["rpy"]] if degrees else found["rpy"]
    pose = json.dumps({"xyz": found["xyz"], "rpy": rpy})
    options = ("--degrees",) if degrees else ()
    joints = answer(capsys, "ik", "ur5", "--pose", pose, *options)["joints"]
    assert joints == pytest.approx(serial_robot("ur5").home, abs=1e-5)


def test_ik_all_turns_has_each_full_turn_inside_the_limits(capsys: Capture) -> None:
    pose = json.dumps(answer(capsys, "fk", "ur5", "--joints", "[0.1,-1.2,1.3,-1.4,-1.5,0.6]"))
    told = {}
    for options in (("--all",), ("--all", "--turns"), ("--turns",)):
        assert main(["ik", "ur5", "--pose", pose, *options]) == 0
        told[options] = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert told["--all", "--turns"] == told["--turns",]
    branches = [each["branch"] for each in told["--all",]]
    assert branches == list(range(1, 9))
    assert {each["branch"] for each in told["--turns",]} == {*branches}
    # Five of its joints turn twice, of which each answer has either full turn.
    assert len(told["--turns",]) == 8 * 2**5


def test_the_jacobian_is_that_of_the_library(capsys: Capture) -> None:
    home = serial_robot("ur5").home_position
    told = answer(capsys, "jacobian", "ur5", "--joints", HOME_UR5)
    assert told["jacobian"] == arm("ur5").jacobian(home).tolist()
    assert (told["order"], told["frame"]) == ("linear-first", "base")
    about = dexterity(arm("ur5"), home)
    assert (told["condition"], told["manipulability"]) == (about.condition, about.manipulability)
    in_root = answer(capsys, "jacobian", "ur5", "--joints", HOME_UR5, "--frame", "root")
    assert in_root["jacobian"] == arm("ur5").jacobian(home, "root").tolist()


def on_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: Capture, *argv: str) -> str:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "200")
    assert main(argv) == 0
    return capsys.readouterr().out


FORMS = [("matrix", "matrix"), ("rpy", "roll"), ("quat", "quaternion")]


@pytest.mark.parametrize(("form", "word"), FORMS)
def test_on_a_terminal_fk_prints_the_form_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, form: str, word: str
) -> None:
    shown = on_a_terminal(monkeypatch, capsys, *FK_HOME, "--as", form)
    assert [each for _, each in FORMS if each in shown] == [word]
    shown = on_a_terminal(monkeypatch, capsys, *FK_HOME)
    assert [each for _, each in FORMS if each in shown] == [each for _, each in FORMS]


def test_on_a_terminal_the_matrix_is_python_and_right(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    shown = on_a_terminal(monkeypatch, capsys, *FK_HOME, "--as", "matrix")
    block = shown.partition("matrix, lengths in m\n")[2]
    expected = arm("ur5").forward(serial_robot("ur5").home_position).to_matrix()
    assert np.array(ast.literal_eval(block)) == pytest.approx(expected, abs=5e-10)
    assert "e-" not in shown


def test_on_a_terminal_a_right_angle_is_one(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    shown = on_a_terminal(monkeypatch, capsys, *FK_HOME, "--as", "rpy")
    assert "roll 180  pitch 0  yaw 90 deg" in shown
    assert "x -486.9  y -109.15  z 431.859 mm" in shown


def test_on_a_terminal_answers_and_jacobian_are_tables(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    pose = json.dumps(answer(capsys, *FK_HOME))
    shown = on_a_terminal(monkeypatch, capsys, "ik", "ur5", "--pose", pose, "--all")
    assert "Upper-Arm °" in shown
    assert "front up flip" in shown
    assert "front down" in shown
    shown = on_a_terminal(monkeypatch, capsys, "jacobian", *FK_HOME[1:], "--names", "file")
    assert "wrist_3_joint" in shown
    assert "nearest singularity: shoulder, 486.9 mm away" in shown


LEGS_AT_HOME = [packaged("stewart_classroom")["leg"]["home_length"]] * 6


@pytest.mark.parametrize("name", ["ur5", "stewart_classroom"])
def test_json_is_printed_on_a_terminal_too_where_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, name: str
) -> None:
    joints = HOME_UR5 if name == "ur5" else json.dumps(LEGS_AT_HOME)
    shown = on_a_terminal(monkeypatch, capsys, "fk", name, "--joints", joints, "--json")
    assert json.loads(shown)["frame"] == "base"


def test_ik_all_prints_every_branch_once_and_the_nearest_first(capsys: Capture) -> None:
    pose = answer(capsys, "fk", "abb_irb2400", "--joints", "[0.1,0.2,0.3,0.4,0.5,0.6]")
    assert main(["ik", "abb_irb2400", "--pose", json.dumps(pose), "--all"]) == 0
    answers = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    near = answer(capsys, "ik", "abb_irb2400", "--pose", json.dumps(pose))
    assert answers[0] == near
    flags = [json.dumps(each["configuration"], sort_keys=True) for each in answers]
    assert len(set(flags)) == len(flags) == 2
    assert [each["branch"] for each in answers] == [1, 2]
    for each in answers:
        again = answer(capsys, "fk", "abb_irb2400", "--joints", json.dumps(each["joints"]))
        assert again["xyz"] == pytest.approx(pose["xyz"], abs=1e-5)


def test_help_is_not_an_error(capsys: Capture) -> None:
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    for command in ("list", "show", "draw", "check", "import", "fk", "ik", "Exit codes"):
        assert command in shown


ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "robots.md").read_text("utf-8")
FILES = re.findall(r"```(?:csv|yaml) (\S+)\n(.*?)```", PAGE, re.DOTALL)
COMMANDS = re.findall(r"(?m)^\$ openpendant robots (.*)$", PAGE)
OF_THE_PAGES_FILES = [each for each in COMMANDS if re.search("my_|elbow", each)]
"""Work on files that earlier ones of them write; the others are about robots of the project."""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, content in FILES:
        (tmp_path / name).write_text(content)
    urdf = (ROOT / "tests" / "robots_files" / "bench_arm.urdf").read_text()
    (tmp_path / "my_arm.urdf").write_text(urdf.replace('name="Bench Arm"', 'name="my_arm"'))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_shows_files_and_commands() -> None:
    assert [name for name, _ in FILES] == ["cell.yaml", "my_scara.csv", "my_elbow.yml"]
    assert len(COMMANDS) >= 14
    assert {"check --all", "draw ur5 -o ur5.png --joints [0,-1,1.2,0,1.5,0]"} <= set(COMMANDS)


def told(capsys: pytest.CaptureFixture[str], command: str) -> str:
    assert main(shlex.split(command)) == 0, command
    captured = capsys.readouterr()
    assert captured.out
    assert "error:" not in captured.err
    return captured.out


@pytest.mark.parametrize("command", [each for each in COMMANDS if each not in OF_THE_PAGES_FILES])
def test_every_command_of_the_page_works_as_typed(
    workbench: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    command: str,
) -> None:
    if command == "home-check --all":
        take_increments_as_accepted(monkeypatch)
    out = told(capsys, command)
    if command == "check --all":
        assert "24 of 24 robots are good" in out
    if command.startswith("draw ur5 -o ur5.png"):
        assert (workbench / "ur5.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_the_commands_for_the_pages_own_files_work_as_typed_in_its_order(
    workbench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in OF_THE_PAGES_FILES:
        told(capsys, command)
    made = {"my_arm.yaml", "my_arm.svg", "my_scara.yaml", "elbow_arm.yaml"}
    assert made <= {path.name for path in workbench.iterdir()}


def test_the_page_tells_the_assumed_values() -> None:
    from openpendant.motion.robot_import.decisions import CONTINUOUS, PRISMATIC, RAMP, REVOLUTE

    assert f"-{REVOLUTE.upper * 57.29577951308232:g}° to" in PAGE
    assert f"-{CONTINUOUS.upper * 57.29577951308232:g}° to" in PAGE
    assert f"{PRISMATIC.lower:g} to {1000 * PRISMATIC.upper:g} mm" in PAGE
    assert f"{REVOLUTE.velocity:g} rad/s), {1000 * PRISMATIC.velocity:g} mm/s" in PAGE
    assert f"speed / {RAMP:g} s" in PAGE
