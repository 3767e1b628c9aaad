"""What `docs/motion.md` shows: its blocks run one after the other, and do what it says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "motion.md").read_text("utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def after(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the names that the blocks of the page define."""
    names: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("page"))
        for number, block in enumerate(BLOCKS, start=1):
            exec(compile(block, f"docs/motion.md, block {number}", "exec"), names)
    return names


def test_every_answer_of_ik_is_the_same_pose(after: dict[str, Any]) -> None:
    assert after["near"] == pytest.approx(after["start"], abs=1e-6)
    assert len(after["answers"]) > len(after["flipped"]) > 0
    for answer in after["answers"]:
        assert after["arm"].forward(answer.joint_position).position_distance(after["pose"]) < 1e-5


def test_the_jacobian_of_the_books_begins_with_the_turn(after: dict[str, Any]) -> None:
    np.testing.assert_array_equal(after["of_the_books"][:3], after["jacobian"][3:])


def test_values_and_axes_turn_differently(after: dict[str, Any]) -> None:
    assert after["more_yaw"].rotation_distance(after["about_base_z"]) < 1e-9
    assert after["more_yaw"].rotation_distance(after["about_tool_z"]) > 1e-3


def test_frames_come_back_from_their_file(after: dict[str, Any]) -> None:
    assert after["tree"].selected_tool == "gripper"
    tree = after["tree"]
    corner = tree.transform("table", "base").compose(tree.transform("tray", "table"))
    assert after["tray"].position_distance(corner) < 1e-12
    assert after["force"] == pytest.approx([0.0, 0.0, -5.0])


def test_the_history_knows_where_the_tool_was(after: dict[str, Any]) -> None:
    arm, start = after["arm"], after["start"]
    tool = after["tree"].transform("gripper", "flange")
    earlier, later = (
        arm.forward(start + 0.1 * second * np.eye(6)[0]).compose(tool) for second in (1, 3)
    )
    assert after["moved"].position_distance(later.inverse().compose(earlier)) < 1e-9


def test_what_is_planned_ends_where_it_should(after: dict[str, Any]) -> None:
    assert after["trajectory"].final == pytest.approx(after["start"] + 0.2)
    assert after["certificate"].valid
    assert after["again"].position.tolist() == after["move"].position.tolist()
    assert after["around"].final[0] == pytest.approx(after["start"][0] + 1.2)


def test_a_platform_is_planned_and_jogged_as_an_arm_is(after: dict[str, Any]) -> None:
    platform = after["platform"]
    assert after["run"].final == pytest.approx(after["legs"])
    rise = platform.forward(after["step"].position).position - after["home"].position
    assert rise[2] > 0.0
    assert np.abs(rise[:2]).max() < 1e-6
