import json
import math
from pathlib import Path

import pytest
import yaml
from rigs.motion.loaded_robots import load_robot, serial_robot

from openpendant.motion.cli.robots import main
from openpendant.motion.paths.mechanism import mechanism
from openpendant.motion.robot_report.home_check import (
    FRAMES,
    INCREMENTS,
    HomeReport,
    Increment,
    check_home,
    check_position,
)
from openpendant.tools.console import ExitCode

DEGREES = math.pi / 180.0


def at(name: str, degrees: tuple[float, ...]) -> HomeReport:
    robot = serial_robot(name)
    joints = robot.to_controller([angle * DEGREES for angle in degrees])
    return check_position(name, mechanism(robot), joints)


def refused(report: HomeReport, frame: str) -> list[str]:
    return sorted(each.increment.label for each in report.refused if each.increment.frame == frame)


def test_the_puma_stretched_up_refuses_seven_of_twelve_in_either_frame() -> None:
    report = at("puma560", (0, 90, -90, 0, 0, 0))
    assert [len(refused(report, frame)) for frame in FRAMES] == [7, 7]
    assert (report.is_good, report.condition) == (False, math.inf)


def test_the_virtual_robot_modules_home_of_the_puma_cannot_turn_about_x() -> None:
    report = at("puma560", (0, 0, -180, 0, 0, 0))
    assert [refused(report, frame) for frame in FRAMES] == [["+A", "-A"], ["+A", "-A"]]
    assert report.condition == math.inf


def test_the_textbooks_qn_of_the_puma_refuses_nothing() -> None:
    robot = serial_robot("puma560")
    qn = robot.named_positions["qn"]
    assert qn == tuple(angle * DEGREES for angle in (0, 45, -180, 0, 45, 0))
    assert check_position("puma560", mechanism(robot), qn).is_good


def test_the_virtual_robot_modules_home_of_the_r1000ia_is_wrist_singular() -> None:
    report = at("fanuc_r1000ia", (0, 0, 0, 0, 0, 0))
    assert refused(report, "base") == ["+C", "+y", "-C", "-y"]
    assert refused(report, "tool") == ["+A", "+y", "-A", "-y"]


@pytest.mark.parametrize(
    ("name", "degrees"),
    [
        ("puma560", (0, 45, -180, 0, -45, 0)),
        ("kawasaki_ra10n", (0, 0, -90, 0, -90, 0)),
        ("abb_irb120", (0, 0, 0, 0, 90, 0)),
        ("abb_irb1410", (0, 0, 0, 0, 90, 0)),
        ("abb_irb2400", (0, 0, 0, 0, 90, 0)),
        ("abb_irb4400l30", (0, 0, 0, 0, 90, 0)),
        ("abb_irb6620", (0, 0, 0, 0, 90, 0)),
        ("abb_irb6650", (0, 0, 0, 0, 90, 0)),
        ("epson_c3", (0, 0, 0, 0, -90, 0)),
        ("fanuc_m410ib", (0, 0, 0, 0)),
        ("fanuc_r1000ia", (0, 0, 0, 0, -90, 0)),
    ],
)
def test_these_robots_are_at_home_where_the_table_says(
    name: str, degrees: tuple[float, ...]
) -> None:
    assert serial_robot(name).home == tuple(angle * DEGREES for angle in degrees)


@pytest.mark.parametrize(
    "name", ["abb_irb2400", "epson_c3", "kawasaki_ra10n", "puma560", "abb_irb4400l30"]
)
def test_the_hand_points_down_at_home(name: str) -> None:
    robot = serial_robot(name)
    approach = mechanism(robot).forward(robot.home_position).rotation
    out_of_flange = approach[:, 0] if name == "abb_irb4400l30" else approach[:, 2]
    assert out_of_flange == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


def test_the_flange_of_the_ra10n_is_the_outermost_of_its_last_link() -> None:
    (shape,) = serial_robot("kawasaki_ra10n").collision["link6"]
    assert shape.type == "box"
    assert shape.xyz[2] + shape.size[2] / 2.0 == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("name", ["fanuc_m410ib", "mitsubishi_rh6frh5520"])
def test_four_axes_cannot_tilt_and_nothing_else(name: str) -> None:
    beyond = check_home(load_robot(name)).beyond
    assert {each.label for each in beyond} == {"+A", "-A", "+B", "-B"}
    assert len(beyond) == 8


def test_at_a_singularity_nothing_is_beyond_an_arm_of_four_axes() -> None:
    robot = serial_robot("mitsubishi_rh6frh5520")
    stretched = (0.0, 0.0, *robot.home_position[2:])
    report = check_position(robot.name, mechanism(robot), stretched)
    assert report.outside is None
    assert report.beyond == ()
    assert not report.is_good


def test_outside_the_limits_no_increment_is_tried() -> None:
    report = at("ur5", (0, 0, 0, 0, 0, 400))
    assert (report.is_good, report.outside is None) == (False, False)
    assert [report.accepted(frame) for frame in FRAMES] == [0, 0]


def test_a_position_where_links_touch_is_not_good() -> None:
    report = at("ur5", (0, -90, 166, -90, -90, 0))
    assert report.contact is not None
    assert not report.is_good


def test_an_increment_near_a_limit_of_a_joint_is_refused() -> None:
    report = at("ur5", (0, -90, 90, -90, -90, 359))
    assert "+C" in refused(report, "tool") or "-C" in refused(report, "tool")


def test_an_increment_of_the_tool_goes_along_the_tools_own_axis() -> None:
    here = mechanism(serial_robot("ur5")).forward(serial_robot("ur5").home_position)
    for increment in (Increment("tool", 2, 1), Increment("base", 2, -1)):
        there = increment.target(here)
        assert there.position - here.position == pytest.approx([0.0, 0.0, -0.01], abs=1e-12)
    turned = Increment("base", 3, 1).target(here)
    assert turned.rotation_distance(here) == pytest.approx(5 * DEGREES)
    assert len(INCREMENTS) == len({(each.frame, each.label) for each in INCREMENTS}) == 24


def test_the_command_prints_a_line_for_each_robot_and_ends_with_0(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["home-check", "ur5", "fanuc_m410ib", "stewart_classroom"]) == ExitCode.OK
    told = capsys.readouterr().out
    assert [told.count(part) for part in ("12/12", "8/8", "good")] == [4, 2, 4]
    assert "3 of 3 homes are good" in told


def test_the_command_ends_with_1_where_a_home_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = serial_robot("puma560").model_dump(mode="json", by_alias=True)
    content |= {"name": "stretched", "home": [0.0, math.pi / 2, -math.pi / 2, 0.0, 0.0, 0.0]}
    file = tmp_path / "stretched.yaml"
    file.write_text(yaml.safe_dump(content))
    assert main(["home-check", "ur5", str(file)]) == ExitCode.FAILED
    told = capsys.readouterr().out
    assert "1 of 2 homes are good" in told
    assert "stretched: +y of base: " in told
    assert main(["home-check", str(file), "--json"]) == ExitCode.FAILED
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["good"], found["condition"], found["accepted"]) == (
        False,
        None,
        {"base": 5, "tool": 5},
    )


def test_the_command_wants_a_robot(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["home-check"]) == ExitCode.USAGE
    assert "--all" in capsys.readouterr().err
