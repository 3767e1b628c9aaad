"""The goal of `openpendant plan` at a cell: which options go together, and what is no goal."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from openpendant.tools.pendants.commands.plan import _reader
from openpendant.tools.pendants.commands.plan_goals import plan_goal
from openpendant.tools.pendants.connection_errors import WrongArgument

TURN_AND_SLIDE = (False, True)
POSE = {"xyz": [0.1, 0.2, 0.3], "quat": [0, 0, 0, 1]}
PLACED = {"position": [0.1, 0.2, 0.3], "orientation": [0, 0, 0, 1]}


def asked(*words: str) -> dict[str, Any]:
    return dict(plan_goal(_reader().parse_args(words)).request(TURN_AND_SLIDE))


@pytest.mark.parametrize(
    ("words", "goal"),
    [
        (("--goal", "[1, 2]"), {"kind": "ptp", "joints": [1.0, 2.0]}),
        (("--to", "park"), {"kind": "position", "name": "park"}),
        (
            ("--pose", json.dumps(POSE), "--branch", "2"),
            {"kind": "ptp", "pose": PLACED, "frame": "base", "branch": 2},
        ),
        (
            ("--pose", json.dumps(POSE | {"frame": "tool"}), "--way", "lin"),
            {"kind": "lin", "pose": PLACED, "frame": "tool"},
        ),
        (
            ("--goal", "[1, 2]", "--way", "free", "--planner", "RRT", "--seed", "0"),
            {"kind": "free", "joints": [1.0, 2.0], "planner": "RRT", "seed": 0},
        ),
        (
            ("--goal", "[1, 2]", "--way", "free", "--margin", "0.01", "--time-limit", "2"),
            {"kind": "free", "joints": [1.0, 2.0], "margin": 0.01, "time_limit": 2.0},
        ),
    ],
)
def test_options_become_the_goal_of_a_request(words: tuple[str, ...], goal: dict[str, Any]) -> None:
    assert asked(*words) == goal


def test_degrees_turn_joints_and_leave_linear_axes_alone() -> None:
    assert asked("--goal", "[90, 0.5]", "--degrees")["joints"] == [math.pi / 2, 0.5]


def test_degrees_turn_roll_pitch_and_yaw() -> None:
    pose = json.dumps({"xyz": [0, 0, 0], "rpy": [0, 0, 90]})
    half = math.sqrt(0.5)
    quaternion = asked("--pose", pose, "--degrees")["pose"]["orientation"]
    assert quaternion == pytest.approx([0, 0, half, half])


def test_a_file_holds_the_waypoints_of_a_path(tmp_path: Path) -> None:
    file = tmp_path / "path.json"
    file.write_text(json.dumps([POSE, POSE]))
    path = {"kind": "path", "way": "lin", "waypoints": [PLACED, PLACED], "frame": "base"}
    assert asked("--path", str(file), "--way", "lin") == path


def test_the_poses_of_one_path_are_in_one_frame(tmp_path: Path) -> None:
    file = tmp_path / "path.json"
    file.write_text(json.dumps([POSE, POSE | {"frame": "tool"}]))
    with pytest.raises(WrongArgument, match="need one frame, not base or tool"):
        asked("--path", str(file))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--to", "park", "--way", "lin"), "--to takes no --way"),
        (("--goal", "[1, 2]", "--way", "lin"), "--goal takes free or ptp"),
        (("--goal", "[1, 2]", "--seed", "3"), "--seed needs --way free"),
        (("--goal", "[1, 2]", "--time-limit", "3"), "--time-limit needs --way free"),
        (("--goal", "[1, 2]", "--branch", "1"), "--branch needs --pose and --way ptp"),
        (("--pose", json.dumps(POSE), "--way", "lin", "--branch", "1"), "--branch needs"),
        (("--goal", "[1, 2"), "is no JSON"),
        (("--goal", "[1, NaN]"), "is no JSON"),
        (("--goal", "[1, 1e999]"), "accepted: finite numbers"),
        (("--goal", '[1, "2"]'), "accepted: a list of joint values"),
        (("--goal", "[1, true]"), "accepted: a list of joint values"),
        (("--goal", json.dumps(POSE)), "accepted: a JSON list of joint values"),
        (("--goal", "[1, 2, 3]", "--degrees"), "3 joint values for 2 joints"),
        (("--pose", "[1, 2]"), "accepted: {"),
        (("--pose", '{"xyz": [1, 2, 3]}'), "is no pose"),
        (("--pose", json.dumps(POSE | {"rpy": [0, 0, 0]})), "is no pose"),
        (("--pose", json.dumps(POSE | {"frame": 1})), "is no pose"),
        (("--pose", json.dumps(POSE | {"speed": 1})), "is no pose"),
        (("--pose", '{"xyz": [1, 2], "rpy": [0, 0, 0]}'), "accepted: three numbers as xyz"),
        (("--path", "/nowhere/path.json"), "No such file"),
    ],
)
def test_what_is_no_goal_is_told_with_what_is_accepted(words: tuple[str, ...], told: str) -> None:
    with pytest.raises(WrongArgument) as wrong:
        asked(*words)
    assert told in str(wrong.value)


@pytest.mark.parametrize("content", ["[]", "{}", "no JSON", "[" * 100_000, " " * (2 << 20), "\xff"])
def test_a_file_that_holds_no_path_is_named(tmp_path: Path, content: str) -> None:
    file = tmp_path / "path.json"
    file.write_bytes(content.encode("latin-1"))
    with pytest.raises(WrongArgument, match=r"path\.json"):
        asked("--path", str(file))
