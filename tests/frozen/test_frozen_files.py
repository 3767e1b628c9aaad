"""Files that were written before are read as they were: nothing that somebody kept is lost."""

import contextlib
import io
import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from frozen.file_readings import copy_files, readings
from frozen.frozen_files import FILES, READINGS

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_file import frames_to_json, load_frames
from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_file import load_scene, save_scene
from openpendant.server.access.accounts import StoredAccounts
from openpendant.server.access.passwords import Secret, is_password
from openpendant.server.store.sqlite_store import open_store
from openpendant.tools.cli import main


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files, which is the current one."""
    copy_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(*command: str) -> str:
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        assert main(list(command)) == 0, command
    return output.getvalue()


def test_the_commands_find_in_the_files_what_they_found(folder: Path) -> None:
    found = [
        f"{was['command']}:\n  then {was}\n  now  {now}"
        for was, now in zip(json.loads(READINGS.read_text("utf-8")), readings(), strict=True)
        if was != now
    ]
    assert not found, "\n".join(found)


def test_what_the_commands_found_is_what_is_in_the_files() -> None:
    found = {each["command"]: each for each in json.loads(READINGS.read_text("utf-8"))}
    assert {each["code"] for each in found.values()} == {0, 1, 2}
    check = json.loads(found["store check --store store.db --json"]["prints"])
    assert (check["documents"], check["revisions"], check["is_sound"]) == (8, 12, True)
    verify = json.loads(found["audit verify audit.jsonl --json"]["prints"])
    assert (verify["intact"], verify["lines"]) == (True, 8)
    program = (FILES / "pick.program").read_text("utf-8")
    command = "store show program pick --revision 1 --store store.db --json"
    assert json.loads(found[command]["prints"])["body"] == json.loads(
        (FILES / "pick.json").read_text("utf-8")
    )
    assert found["program print pick.json"]["prints"].splitlines()[1:3] == [
        program.splitlines()[1],
        program.splitlines()[2],
    ]


def test_an_export_comes_back_in(folder: Path) -> None:
    printed("store", "import", "documents.json", "--store", "new.db")
    of_points = ("--name", "points", "--robot", "ur5", "--store", "new.db")
    printed("store", "import", "points.csv", *of_points)
    of_motion = ("--kind", "recording", "--name", "again", "--robot", "ur5", "--store", "new.db")
    printed("store", "import", "motion.csv", *of_motion)
    documents = json.loads((FILES / "documents.json").read_text("utf-8"))["documents"]
    for each in documents:
        shown = ("store", "show", each["kind"], each["name"], "--json", "--store", "new.db")
        assert json.loads(printed(*shown))["body"] == each["body"]
    for name in ("arc", "again"):
        of_it = ("--kind", "recording", "--name", name, "--store", "new.db")
        printed("store", "export", f"{name}.csv", *of_it)
        assert Path(f"{name}.csv").read_text("utf-8") == (FILES / "motion.csv").read_text("utf-8")
    (pick,) = [each["body"] for each in documents if each["name"] == "pick"]
    shown = ("store", "show", "program", "points", "--json", "--store", "new.db")
    assert json.loads(printed(*shown))["body"]["points"] == pick["points"]


def test_whoever_had_an_account_logs_in_by_the_same_password(folder: Path) -> None:
    with contextlib.closing(open_store(folder / "store.db")) as store:
        account = StoredAccounts(store, "a test").book().find("ada")
    assert account is not None
    assert is_password(Secret("a long enough password"), account.password)
    assert not is_password(Secret("a long enough passwore"), account.password)


def test_the_frames_are_where_they_were(folder: Path) -> None:
    tree = load_frames(folder / "frames.json")
    assert tree.selected_tool == "gripper"
    assert [tool.name for tool in tree.tools] == ["gripper", "Größe 2"]
    assert [(frame.name, frame.parent) for frame in tree.user_frames] == [
        ("table", "base"),
        ("corner", "table"),
    ]
    assert json.loads(frames_to_json(tree)) == json.loads(Path("frames.json").read_text("utf-8"))


def test_the_scene_has_its_objects_and_may_touch_what_it_might(folder: Path) -> None:
    scene = load_scene(folder / "scene.json")
    assert scene == Scene(
        (
            SceneObject("table", Box((1.0, 1.0, 0.125)), (0.5, 0.0, -0.0625)),
            SceneObject("ball", Sphere(0.125), (0.0, 1.0, 0.5), frame="root"),
            SceneObject("post", Cylinder(0.0625, 2.0), (1.0, 1.0, 1.0)),
            SceneObject("rail", Capsule(0.0625, 1.0), (-1.0, 0.0, 0.0)),
        ),
        frozenset({("ball", "table"), ("post", "table")}),
        7,
    )
    save_scene(scene, folder / "again.json")
    assert load_scene(folder / "again.json") == scene


def test_the_robot_has_its_axes(folder: Path) -> None:
    robot = serial_robot(folder / "bench_scara.yaml")
    assert robot.limits == JointLimits(
        names=("first", "second", "lift", "turn"),
        lower=(-2.5, -2.25, 0.125, -6.25),
        upper=(2.5, 2.25, 0.375, 6.25),
        velocity=(3.0, 4.0, 1.0, 10.0),
        acceleration=(12.0, 16.0, 8.0, 100.0),
        prismatic=(False, False, True, False),
    )
    assert robot.home_position == (0.0, 1.5, 0.25, 0.0)
    assert printed("robots", "check", "bench_scara.yaml").startswith("ok  bench_scara\n")


@pytest.mark.parametrize(
    ("file", "command"), [("cell.toml", "serve"), ("cells.toml", "serve"), ("cell.toml", "emulate")]
)
def test_all_that_a_configuration_says_is_in_force(folder: Path, file: str, command: str) -> None:
    written = tomllib.loads((folder / file).read_text("utf-8"))
    in_force = tomllib.loads(printed(command, "--config", file, "--print-config"))
    emulator = {"emulator": written.pop("emulator")} if "emulator" in written else {}
    assert _lost(emulator if command == "emulate" else written, in_force) == []


def _lost(said: Any, in_force: Any, place: str = "") -> list[str]:
    """Return the places of what is not in force as it is said."""
    if isinstance(said, dict):
        return [
            lost
            for key, value in said.items()
            for lost in _lost(value, in_force.get(key), f"{place}.{key}")
        ]
    if isinstance(said, list) and said and isinstance(said[0], dict):
        pairs = zip(said, in_force, strict=True)
        return [lost for at, pair in enumerate(pairs) for lost in _lost(*pair, f"{place}.{at}")]
    return [] if said == in_force else [f"{place}: {said!r}, in force {in_force!r}"]
