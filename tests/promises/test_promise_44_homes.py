"""Promise 44: from home every first Cartesian increment works, on each robot of the catalogue."""

import math
import os
from functools import cache
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.data.urdf_files import ROBOTS_FILES
from rigs.motion.loaded_robots import load_robot

from openpendant.motion.cli.robots import main
from openpendant.motion.description.robot import robot_names
from openpendant.motion.robot_report import home_check
from openpendant.motion.robot_report.home_check import (
    FRAMES,
    INCREMENTS,
    SHIFT,
    TURN,
    HomeReport,
    check_home,
)
from openpendant.tools.console import ExitCode

OF_A_FRAME = figure(44, "increments").count
OF_FOUR_AXES = figure(44, "four").count
NEW_ROBOTS = ("arm_on_a_rail", "bench_arm", "flat_arm", "gantry_arm", "seven_axes", "six_axes")


def test_promise_44_the_increments_are_those_promised() -> None:
    assert pytest.approx(figure(44, "shift").bound / 1e3) == SHIFT
    assert pytest.approx(math.radians(figure(44, "turn").bound)) == TURN
    for frame in FRAMES:
        tried = {(each.axis, each.sign) for each in INCREMENTS if each.frame == frame}
        assert len(tried) == OF_A_FRAME


@cache
def report_of(name: str) -> HomeReport:
    """What the check says of a robot's home, found once for the tests of this file."""
    return check_home(load_robot(name))


@pytest.mark.parametrize("name", robot_names())
def test_promise_44_every_first_increment_from_home_works(name: str) -> None:
    robot = load_robot(name)
    report = report_of(name)
    assert [(each.increment, str(each.error)) for each in report.refused] == []
    assert report.is_good
    able = OF_FOUR_AXES if robot.dof == 4 else OF_A_FRAME
    assert [report.accepted(frame) for frame in FRAMES] == [able, able]


def test_promise_44_the_command_finds_every_home_good(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(home_check, "check_home", lambda robot: report_of(robot.name))
    assert main(["home-check", "--all"]) == ExitCode.OK
    count = len(robot_names())
    assert f"{count} of {count} homes are good" in capsys.readouterr().out


@pytest.mark.parametrize("name", NEW_ROBOTS)
def test_promise_44_an_import_chooses_such_a_home(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"{name}.yaml"
    assert main(["import", os.fspath(ROBOTS_FILES / f"{name}.urdf"), "--yes", "-o", str(file)]) == 0
    assert "the nearest from which all work" in capsys.readouterr().err
    assert main(["home-check", str(file)]) == ExitCode.OK
