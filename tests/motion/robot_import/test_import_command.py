import json
import math
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml
from rigs.data.urdf_files import (
    FIRST,
    LIMIT,
    ROBOTS_FILES,
    SECOND,
    SOUND,
    THIRD,
    joint,
    robot,
    written,
)

from openpendant.motion.cli.robots import main
from openpendant.motion.description.robot import SerialRobot, serial_robot
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.paths import linear_path
from openpendant.motion.planning.planner import plan_free_path
from openpendant.motion.pose import Array, Pose
from openpendant.motion.robot_import import home_search
from openpendant.motion.robot_import.home_search import home_to_jog_from
from openpendant.motion.robot_report.home_check import HomeReport
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.tools.console import ExitCode

Capture = pytest.CaptureFixture[str]
Answering = Callable[[dict[str, list[str]]], list[str]]
NEW_ROBOTS = ("bench_arm", "gantry_arm")


BENCH_ARM, GANTRY_ARM = (str(ROBOTS_FILES / f"{name}.urdf") for name in NEW_ROBOTS)


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture(autouse=True, scope="module")
def searched_once() -> Iterator[None]:
    """A home is searched once for each robot; a test of its own searches one again."""
    found: dict[str, tuple[Array | None, HomeReport]] = {}

    def search_once(robot: SerialRobot) -> tuple[Array | None, HomeReport]:
        described = robot.model_dump_json()
        if described not in found:
            found[described] = home_to_jog_from(robot)
        return found[described]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(home_search, "home_to_jog_from", search_once)
        yield


@pytest.fixture(scope="module", params=NEW_ROBOTS)
def new_robot(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> SerialRobot:
    """A robot that no catalogue holds, imported from its URDF."""
    file = tmp_path_factory.mktemp("new") / f"{request.param}.yaml"
    source = str(ROBOTS_FILES / f"{request.param}.urdf")
    assert main(["import", source, "--yes", "-o", str(file)]) == 0
    return serial_robot(file)


def refusal(capsys: Capture, *argv: str) -> str:
    assert main(argv) == ExitCode.USAGE
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("error: ")
    return line


def test_each_fact_is_told_with_its_step_and_where_it_came_from(capsys: Capture) -> None:
    assert main(["import", BENCH_ARM, "--yes"]) == 0
    captured = capsys.readouterr()
    told = captured.out.splitlines()
    steps = [line.split()[1] for line in told if line[:1].isdigit()]
    assert steps == sorted(steps, key=("model", "planning", "controller", "pendant").index)
    assert set(steps) == {"model", "planning", "controller", "pendant"}
    assert all(line.split()[2] == "done" for line in told if line[:1].isdigit())
    assumed = captured.err.splitlines()
    assert all(line.split()[2] == "defaulted" for line in assumed)
    for part in (
        "joint 'twist' limits: -360° to 360°",
        "joint 'twist' speed",
        "acceleration_ramp_s",
        "home: 0°",
        "base frame",
        "coupling: none",
        "display names: Base, Lower-Arm",
    ):
        assert any(part in line for line in assumed), part  # fmt: skip
    assert "wrote bench_arm.yaml: good" in captured.out


def test_the_file_passes_the_check_and_keeps_the_assumptions(capsys: Capture) -> None:
    assert main(["import", GANTRY_ARM, "--yes"]) == 0
    assert main(["check", "gantry_arm.yaml"]) == 0
    assert "1 of 1 robots are good" in capsys.readouterr().out
    robot = serial_robot("gantry_arm.yaml")
    assert any(note.startswith("assumed: home") for note in robot.notes)
    assert robot.limits.acceleration[0] == 1.5
    assert robot.display_names[0] == "Rail"
    level = robot.moving[4]
    assert level.dependent is not None
    assert (level.lower, level.upper, level.velocity) == (-3.0, 3.0, 3.0)


def test_a_follower_without_limits_gets_what_its_leader_makes_of_it(tmp_path: Path) -> None:
    follower = joint("two", "b", "c", limit="", more='<mimic joint="one" multiplier="-0.5"/>')
    two = imported(tmp_path, robot(FIRST, follower, THIRD)).moving[1]
    # Its leader goes from -1 to 1.5 at 2 rad/s.
    assert (two.lower, two.upper, two.velocity) == (-0.75, 0.5, 1.0)


def with_follower(mimic: str, limit: str, leader: str = LIMIT) -> str:
    first = joint("one", "a", "b", limit=leader)
    follower = joint("two", "b", "c", limit=f"<limit {limit}/>", more=f"<mimic {mimic}/>")
    return robot(first, follower, THIRD)


def imported(folder: Path, text: str) -> SerialRobot:
    assert main(["import", str(written(folder, text)), "--yes"]) == 0
    return serial_robot("tiny.yaml")


def test_a_followers_own_limits_narrow_its_leaders(capsys: Capture, tmp_path: Path) -> None:
    mimic = 'joint="one" multiplier="-2" offset="0.1"'
    limit = 'lower="-0.5" upper="0.5" velocity="0.6" acceleration="3"'
    robot = imported(tmp_path, with_follower(mimic, limit))
    leader = robot.driven[0]
    # -0.5 <= 0.1 - 2 q <= 0.5, and twice its rates are the follower's.
    assert (leader.lower, leader.upper) == pytest.approx((-0.2, 0.3))
    assert leader.velocity == pytest.approx(0.3)
    # At its own speed over the ramp of 0.5 s it stays below 1.5 rad/s².
    assert leader.acceleration is None
    told = capsys.readouterr().err
    assert "joint 'one' limits: narrowed to -11.4592° to 17.1887°, so that 'two'" in told
    assert "joint 'one' speed: narrowed to 17.1887°/s" in told
    notes = [each for each in robot.notes if "narrowed" in each]
    assert [each.split(": ")[1] for each in notes] == ["joint 'one' limits", "joint 'one' speed"]


@pytest.mark.parametrize("leader", ["", ' acceleration="9"'], ids=["from the ramp", "stated"])
def test_the_acceleration_of_a_follower_narrows_its_leaders(tmp_path: Path, leader: str) -> None:
    text = with_follower(
        'joint="one" multiplier="0.5"',
        'lower="-3" upper="3" velocity="9" acceleration="0.25"',
        f'<limit lower="-1" upper="1.5" velocity="2"{leader}/>',
    )
    first = imported(tmp_path, text).driven[0]
    assert (first.lower, first.upper, first.velocity) == (-1.0, 1.5, 2.0)
    assert first.acceleration == 0.5


def test_a_leader_without_limits_is_narrowed_too(tmp_path: Path) -> None:
    text = with_follower('joint="one"', 'lower="-0.5" upper="0.5" velocity="0.3"', "")
    first = imported(tmp_path, text).driven[0]
    assert (first.lower, first.upper, first.velocity) == (-0.5, 0.5, 0.3)


def test_a_follower_that_leaves_no_range_is_refused(capsys: Capture, tmp_path: Path) -> None:
    text = with_follower('joint="one" offset="3"', 'lower="-0.5" upper="0.5"')
    line = refusal(capsys, "import", str(written(tmp_path, text)), "--yes")
    assert "tiny.urdf: joint 'two'.limit: is -28.6479° to 28.6479°" in line
    assert "'one', the joint it mimics, reaches nowhere between -57.2958° to 85.9437°" in line
    assert "accepted: limits that leave 'one' a range" in line


def positions(robot: SerialRobot, count: int) -> Iterator[np.ndarray]:
    random = np.random.default_rng(7)
    yield from random.uniform(robot.limits.lower, robot.limits.upper, (count, robot.dof))


def test_a_new_robot_has_forward_and_inverse_kinematics(new_robot: SerialRobot) -> None:
    kinematics = Kinematics(new_robot)
    for position in positions(new_robot, 20):
        pose = kinematics.forward(position)
        found = solve(kinematics, pose, new_robot.home_position)
        again = kinematics.forward(found.joint_position)
        assert again.position_distance(pose) < 1e-5
        assert again.rotation_distance(pose) < 1e-4
        new_robot.limits.check_position(found.joint_position.tolist())


def test_a_new_robot_moves_from_point_to_point_and_in_lines(new_robot: SerialRobot) -> None:
    kinematics, limits = Kinematics(new_robot), new_robot.limits
    start = np.array(new_robot.home_position) + 0.2
    certify(plan_joint_move(new_robot.home_position, start, limits), limits)
    here = kinematics.forward(start)
    target = Pose(here.position + np.array([0.0, 0.05, -0.04]), here.quaternion)
    line = time_path(linear_path(kinematics, start, target), limits)
    certify(line, limits, start=start)
    end = kinematics.forward(line.position[-1])
    assert end.position_distance(target) < 1e-4
    middle = kinematics.forward(line.position[len(line.position) // 2]).position
    off_line = np.cross(middle - here.position, target.position - here.position)
    assert float(np.linalg.norm(off_line)) < 1e-6


def test_a_new_robot_plans_a_path_on_which_nothing_touches(new_robot: SerialRobot) -> None:
    kinematics = Kinematics(new_robot)
    collision = CollisionModel(kinematics)
    free = [each for each in positions(new_robot, 60) if not collision.collides(each)]
    path = plan_free_path(kinematics, collision, free[0], free[1], time_limit=20.0)
    trajectory = time_path(path, new_robot.limits)
    certify(trajectory, new_robot.limits, start=free[0])
    assert not collision.any_collides(trajectory.position)


def test_strict_refuses_all_that_is_missing_at_once(capsys: Capture, tmp_path: Path) -> None:
    line = refusal(capsys, "import", BENCH_ARM, "--strict")
    assert "joint 'twist' limits" in line
    assert "and 5 more" in line
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_missing_in_a_full_table(capsys: Capture) -> None:
    row = {"variable": "theta", "d": 0.3, "a": 0.2, "lower": -2, "upper": 2}
    rows = [
        {**row, "joint": name, "velocity": 2, "acceleration": 4, "display_name": name.upper()}
        for name in ("a", "b")
    ]
    table = {"name": "two", "convention": "standard", "angles": "radians", "lengths": "m"}
    Path("two.json").write_text(json.dumps({**table, "joints": rows, "home": [0.1, 0.2]}))
    assert main(["import", "two.json", "--strict"]) == 0
    captured = capsys.readouterr()
    assert [line for line in captured.err.splitlines() if "base frame" not in line] == []


def test_options_settle_what_a_description_does_not_say() -> None:
    options = ["--name", "mine", "--manufacturer", "ACME", "--model", "A 1", "--coupling", "1"]
    home = ["--home", "[0.1,-0.2,0.3,0,0.5,0]"]
    assert main(["import", BENCH_ARM, "--yes", *options, *home]) == 0
    robot = serial_robot("mine.yaml")
    assert (robot.name, robot.manufacturer, robot.model) == ("mine", "ACME", "A 1")
    assert robot.coupling.state_factor == 1
    assert robot.home == (0.1, -0.2, 0.3, 0.0, 0.5, 0.0)


def test_a_home_where_links_touch_is_moved_aloud(capsys: Capture, tmp_path: Path) -> None:
    ball = '<collision><geometry><sphere radius="0.08"/></geometry></collision>'
    along = '<origin xyz="0.2 0 0"/><geometry><box size="0.3 0.02 0.02"/></geometry>'
    rod = f"<collision>{along}</collision>"
    out = '<origin xyz="0.4 0 0"/>'
    back = f'<origin xyz="0.1 0 0" rpy="0 0 {math.pi}"/>'
    first, third = joint("one", "a", "b", origin=out), joint("three", "c", "d", origin=back)
    folded = robot(first, joint("two", "b", "c", origin=out, axis='<axis xyz="0 1 0"/>'), third)
    for link, shape in (("a", ball), ("b", rod), ("c", rod), ("d", rod)):
        folded = folded.replace(f'<link name="{link}"/>', f'<link name="{link}">{shape}</link>')
    moved = imported(tmp_path, folded)
    assert "b and d touch there" in capsys.readouterr().err
    assert not CollisionModel(Kinematics(moved)).collides(moved.home_position)


def test_a_stated_home_stays_and_the_report_says_what_it_refuses(capsys: Capture) -> None:
    home = ["--home", "[0.1,-0.2,0.3,0,0,0]"]
    assert main(["import", BENCH_ARM, "--yes", *home]) == 0
    assert serial_robot("bench_arm.yaml").home == (0.1, -0.2, 0.3, 0.0, 0.0, 0.0)
    told = capsys.readouterr().err
    assert "home: kept as stated, though" in told
    assert "of its first increments are refused" in told


def test_an_import_that_finds_no_home_to_jog_from_says_so(capsys: Capture, tmp_path: Path) -> None:
    # No joint has room for an increment, wherever it stands.
    narrow = '<limit lower="-0.01" upper="0.01" velocity="2"/>'
    stiff = robot(
        joint("one", "a", "b", limit=narrow),
        joint("two", "b", "c", limit=narrow),
        joint("three", "c", "d", limit=narrow),
    )
    made = imported(tmp_path, stiff)
    assert "no position was found from which every first increment works" in capsys.readouterr().err
    assert any("no position was found" in note for note in made.notes)
    assert made.home == (0.0, 0.0, 0.0)


def test_the_same_description_gets_the_same_home(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("one", "two"):
        assert main(["import", GANTRY_ARM, "--yes", "-o", f"{name}.yaml"]) == 0
        monkeypatch.setattr(home_search, "home_to_jog_from", home_to_jog_from)
    assert serial_robot("one.yaml").home == serial_robot("two.yaml").home


def test_an_existing_file_is_kept_unless_told(capsys: Capture, tmp_path: Path) -> None:
    source = str(written(tmp_path, SOUND))
    Path("tiny.yaml").write_text("mine")
    assert "--yes to replace" in refusal(capsys, "import", source)
    assert Path("tiny.yaml").read_text() == "mine"
    assert main(["import", source, "--yes"]) == 0
    assert serial_robot("tiny.yaml").dof == 3


def test_several_arms_need_a_tip(capsys: Capture, tmp_path: Path) -> None:
    fork = robot(FIRST, joint("left", "b", "c"), joint("right", "b", "d"))
    source = str(written(tmp_path, fork))
    assert "--tip with one of c, d" in refusal(capsys, "import", source)
    assert main(["import", source, "--tip", "d", "--yes"]) == 0
    assert [each.name for each in serial_robot("tiny.yaml").driven] == ["one", "right"]


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Answering:
    """Plays a person at a terminal: answers by the words a question holds, else just Return."""

    def install(answers: dict[str, list[str]]) -> list[str]:
        asked: list[str] = []

        def answer(question: str) -> str:
            asked.append(question)
            for words, replies in answers.items():
                if words in question and replies:
                    return replies.pop(0)
            return ""

        monkeypatch.setattr("builtins.input", answer)
        monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
        return asked

    return install


def test_on_a_terminal_missing_facts_are_asked_in_degrees(
    capsys: Capture, answering: Answering
) -> None:
    asked = answering(
        {
            "'twist' limits": ["nonsense", "90 -90", "-90 90"],
            "'twist' speed": ["0", "180"],
            "acceleration_ramp_s": ["0.25"],
            "home": ["10 0 0 0 20 0"],
            "coupling": ["2", "-1"],
            "display names": ["a, b", "A, B, C, D, E, F"],
        }
    )
    assert main(["import", BENCH_ARM]) == 0
    made = serial_robot("bench_arm.yaml")
    assert made.limits.lower[5] == pytest.approx(-math.pi / 2)
    assert made.limits.velocity[5] == pytest.approx(math.pi)
    assert made.acceleration_ramp_s == 0.25
    assert made.home == pytest.approx((math.radians(10), 0, 0, 0, math.radians(20), 0))
    assert made.coupling.state_factor == -1
    assert made.display_names == tuple("ABCDEF")
    assert any("accepted: the least value, then the greatest" in question for question in asked)
    assert "asked      joint 'twist' limits: -90° to 90°" in capsys.readouterr().out


def test_no_answer_is_the_default(capsys: Capture, answering: Answering) -> None:
    assert answering({}) == []
    assert main(["import", BENCH_ARM]) == 0
    assert "defaulted  joint 'twist' limits: -360° to 360°" in capsys.readouterr().err


BAD_ARGUMENTS: list[tuple[list[str], str]] = [
    ([], "FILE"),
    (["none.urdf"], "No such file"),
    (["tiny.urdf", "--tip", "nowhere"], "accepted: d"),
    (["tiny.urdf", "--name", "Two Words"], "lower-case"),
    (["tiny.urdf", "--name", ""], "lower-case"),
    (["tiny.urdf", "--home", "[0,0]"], "3 driven joints"),
    (["tiny.urdf", "--home", "[0,0,9]"], "home"),
    (["tiny.urdf", "--home", "[0,0,NaN]"], "--home"),
    (["tiny.urdf", "--coupling", "2"], "coupling"),
    (["tiny.urdf", "-o", "no/such/folder.yaml"], "can be written"),
    (["tiny.urdf", "-o", "a\0b"], "null byte"),
    (["table.csv", "--tip", "tool0"], "it has one chain"),
    (["eleven.urdf"], "accepted: 1 to 10"),
    (["fast.urdf"], "is this in degrees?"),
]


@pytest.mark.parametrize(
    ("arguments", "says"), BAD_ARGUMENTS, ids=[" ".join(a) for a, _ in BAD_ARGUMENTS]
)
def test_a_bad_import_is_one_line_on_standard_error(
    capsys: Capture, tmp_path: Path, arguments: list[str], says: str
) -> None:
    written(tmp_path, SOUND)
    fast = FIRST.replace('velocity="2"', 'velocity="180"')
    written(tmp_path, robot(fast, links="ab"), "fast.urdf")
    letters = "abcdefghijkl"
    long = [joint(f"j{a}", a, b) for a, b in pairwise(letters)]
    written(tmp_path, robot(*long, links=letters), "eleven.urdf")
    line = refusal(capsys, "import", *arguments)
    assert says in line
    assert line.isprintable()
    assert not list(tmp_path.glob("*.yaml"))


def test_what_is_written_is_plain_yaml_in_the_schemas_order(tmp_path: Path) -> None:
    imported(tmp_path, robot(FIRST, SECOND, THIRD))
    content = yaml.safe_load(Path("tiny.yaml").read_text())
    assert list(content)[:3] == ["schema", "name", "kind"]
    assert list(content).index("joints") < list(content).index("dh") < list(content).index("notes")


def test_a_name_that_looks_like_something_else_stays_a_name(tmp_path: Path) -> None:
    names = ("1e308", "1e-5", "null", "yes", "0x1F", "2020-01-01", "~", "é")
    links = "abcdefghi"
    joints = [joint(name, *ends) for name, ends in zip(names, pairwise(links), strict=True)]
    odd = robot(*joints, links=links, name="1e5")
    assert main(["import", str(written(tmp_path, odd)), "--name", "odd", "--yes"]) == 0
    made = serial_robot("odd.yaml")
    assert tuple(each.name for each in made.driven) == names
    assert made.model == "1e5"
