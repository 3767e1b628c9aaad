"""Tables of robots on a terminal of 80 columns: every number and every name is whole."""

import json
import re
from collections.abc import Callable, Iterator, Sequence

import pytest
from rich.console import Console
from rich.table import Table
from rigs.motion.increments_tried_before import take_increments_as_accepted

from openpendant.motion.cli import plan_command, robots
from openpendant.motion.cli.kinematics_tables import degrees, millimetres
from openpendant.motion.cli.table_layout import print_table
from openpendant.motion.description.robot import SerialRobot, load_robot, robot_names
from openpendant.motion.paths.mechanism import mechanism
from openpendant.tools.console import ExitCode, cells

Capture = pytest.CaptureFixture[str]
Show = Callable[..., str]

WIDTH = 80


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Show:
    """Run a command on a narrow terminal; return what it printed there."""

    def show(*argv: str) -> str:
        monkeypatch.setattr("sys.stdout.isatty", lambda: True)
        monkeypatch.setenv("COLUMNS", str(WIDTH))
        main = plan_command.main if argv[0] == "--robot" else robots.main
        assert main(argv) in (ExitCode.OK, ExitCode.FAILED)
        return re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)

    return show


def off_home(name: str) -> list[float]:
    """A position whose numbers are long."""
    arm = mechanism(load_robot(name))
    return [value + 0.0123456789 for value in arm.home_position]


def asked_for(name: str) -> str:
    pose = mechanism(load_robot(name)).forward(off_home(name), "base")
    return json.dumps({"xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()})


def commands_about(name: str) -> Iterator[Sequence[str]]:
    facts = load_robot(name)
    yield ("show", name)
    yield ("show", name, "--names", "file")
    yield ("home-check", name)
    yield ("ik", name, "--all", "--pose", asked_for(name))
    if isinstance(facts, SerialRobot):
        joints = json.dumps(off_home(name))
        yield ("show", name, "--frames")
        for names in ("display", "file"):
            yield ("jacobian", name, "--names", names, "--joints", joints)
        if facts.vrm is not None:
            yield ("show", name, "--vrm")


def is_whole(text: str) -> bool:
    return "…" not in text and max(map(len, text.splitlines())) <= WIDTH


@pytest.mark.parametrize("name", robot_names())
def test_no_table_about_a_robot_is_cut(
    shown: Show, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    take_increments_as_accepted(monkeypatch)
    cut = [command for command in commands_about(name) if not is_whole(shown(*command))]
    assert cut == []


def test_the_list_of_robots_is_not_cut(shown: Show) -> None:
    assert is_whole(shown("list"))


@pytest.mark.parametrize("name", ["ur5", "kuka_iiwa14", "stewart_classroom"])
def test_every_answer_is_shown_with_every_digit(shown: Show, name: str) -> None:
    command = ("ik", name, "--all", "--pose", asked_for(name))
    answers = [json.loads(line)["joints"] for line in shown(*command, "--json").splitlines()]
    facts = load_robot(name)
    slides = facts.limits.prismatic if isinstance(facts, SerialRobot) else [True] * 6
    printed = re.findall(r"-?[\d.]+", shown(*command))
    missing = [
        text
        for joints in answers
        for value, metres in zip(joints, slides, strict=True)
        if (text := millimetres(value) if metres else degrees(value)) not in printed
    ]
    assert (len(answers) > 0, missing) == (True, [])


@pytest.mark.parametrize("names", ["display", "file"])
@pytest.mark.parametrize("name", ["ur5", "kuka_iiwa14"])
def test_a_plans_table_is_not_cut(shown: Show, name: str, names: str) -> None:
    goal = json.dumps(off_home(name))
    asked = ("--goal", goal, "--angles", "controller", "--names", names, "--rows", "3")
    assert is_whole(shown("--robot", name, *asked))


def drawn(heads: Sequence[str], row: Sequence[str], width: int) -> str:
    made = Table(*heads, title="T")
    made.add_row(*cells(*row))
    console = Console(width=width)
    with console.capture() as capture:
        print_table(made, console)
    return "\n".join(line.rstrip() for line in capture.get().splitlines())


HEADS, ROW = ("joint", "Wrist-Twist °", "near"), ("Base", "-123.456789", "to a bound")


def test_a_table_with_room_keeps_its_grid() -> None:
    assert "│ Base  │ -123.456789   │ to a bound │" in drawn(HEADS, ROW, 80)


def test_a_narrower_table_folds_its_heads() -> None:
    narrow = drawn(HEADS, ROW, 32)
    assert (
        narrow == "T\n       Wrist-Twist\njoint  °            near\nBase   -123.456789  to a bound"
    )


def test_a_still_narrower_one_folds_cells_at_blanks() -> None:
    narrow = drawn(HEADS, ROW, 26)
    assert narrow.splitlines()[-2:] == ["Base   -123.456789  to a", "                    bound"]


def test_where_no_word_would_be_whole_each_row_is_a_block() -> None:
    narrow = drawn(HEADS, ROW, 22)
    assert narrow.splitlines() == [
        "T",
        "joint Base",
        "  Wrist-Twist °:",
        "    -123.456789",
        "  near: to a bound",
    ]
