"""What was written, sent and answered before is so today, to the byte, and nothing kept is lost.

A journal of another version says another name in its hello: before a version is changed, they are
recorded anew (`record.py`) with what is behind it unchanged.
"""

import contextlib
import difflib
import gzip
import io
import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from frozen.bodies_to_ask import Answer, AskedCell, Question, Step, line_of, read_steps, steps
from frozen.client_calls import Calls
from frozen.conversations import CONVERSATIONS
from frozen.files_to_make import copy_files, readings
from frozen.frozen_files import (
    BODIES,
    FILES,
    FROZEN,
    JOURNALS,
    QUESTIONS,
    READINGS,
    SCHEMAS,
    SIGNATURES,
)
from frozen.questions import KINDS, kinds_of, lines

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_file import frames_to_json, load_frames
from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_file import load_scene, save_scene
from openpendant.server.access.accounts import StoredAccounts
from openpendant.server.access.passwords import Secret, is_password
from openpendant.server.store.sqlite_store import open_store
from openpendant.simplemsg import __version__
from openpendant.tools.cli import main
from openpendant.tools.packets.rerun import main as rerun


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


def differing(file: Path) -> dict[str, str]:
    """Make the requests of a file; return those whose answers differ, and how."""
    cells: dict[str, AskedCell] = {}
    found = {}
    for name, step, then in read_steps(file):
        if name not in cells:
            cells[name] = AskedCell()
        now = cells[name].make(step)
        if isinstance(step, Question) and now != then:
            found[step.name] = f"then {_shown(then)}\n  now  {_shown(now)}"
    return found


def _shown(answer: Answer | None) -> str:
    assert answer is not None
    return f"{'done' if answer.done else 'refused'}: {answer.text}"


def questions() -> list[tuple[Question, Answer]]:
    return [
        (step, answer)
        for _, step, answer in read_steps(BODIES)
        if isinstance(step, Question) and answer is not None
    ]


def test_every_request_is_answered_as_it_was() -> None:
    found = differing(BODIES)
    assert not found, "\n".join(f"{name}:\n  {how}" for name, how in found.items())


def test_an_answer_that_differs_is_told_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "bodies.jsonl"
    steps: list[tuple[str, Step, Answer | None]] = [
        ("cell", Question("cells", "viewer", '{"op":"cells"}'), Answer(True, "{}")),
        ("cell", Question("no text", "viewer", {"hex": "ff"}), Answer(False, "{}")),
        ("cell", Question("sessions", "viewer", '{"op":"access.whoami"}'), Answer(True, "{}")),
    ]
    file.write_text("".join(line_of(*step) + "\n" for step in steps), "utf-8")
    found = differing(file)
    assert set(found) == {"cells", "no text", "sessions"}
    then, now = found["cells"].split("\n  now  ")
    assert then == "then done: {}"
    assert now.startswith("done: {")
    assert '"cell":"cell","robot":"ur5"' in now


def test_every_operation_was_asked_for_and_refused() -> None:
    published = {file.name.removesuffix("-request.json") for file in SCHEMAS.glob("*-request.json")}
    done: set[str] = set()
    refused: set[str] = set()
    for question, answer in questions():
        if isinstance(question.body, str) and question.name.partition(":")[0] in published:
            (done if answer.done else refused).add(json.loads(question.body)["op"])
    # The last digits of what is calculated differ between machines, and the robot has no mesh.
    inexact = {"tools.calibrate", "kinematics.ik", "kinematics.jacobian", "shapes.show"}
    inexact |= {"plans.make", "plans.samples", "plans.drop", "shapes.mesh"}
    assert done == published - inexact
    assert refused == published


def test_requests_have_names_of_their_own() -> None:
    names = Counter(question.name for question, _ in questions())
    assert [name for name, count in names.items() if count > 1] == []
    assert len(names) > 400


def test_what_can_be_wrong_with_a_new_request_is_made_up_in_front_of_it(tmp_path: Path) -> None:
    file = tmp_path / "bodies.jsonl"
    new = {"cell": "cell", "id": "cells: right", "by": "viewer", "body": '{"op":"cells"}'}
    file.write_text(json.dumps(new) + "\n", "utf-8")
    assert [step for _, step in steps(file)] == [
        Question("cells: by who is visitor", "visitor", '{"op":"cells"}'),
        Question("cells: a key too many", "viewer", '{"op":"cells","colour":"red"}'),
        Question("cells: right", "viewer", '{"op":"cells"}'),
    ]


EVENTS = {
    *("opened", "closed", "in", "up", "down", "tick", "operate", "planned", "stored"),
    *("accounts", "checked", "account", "shut-down", "hang-up"),
}
ASKED = {"gone", "paired", "stopped"}


def unpacked(folder: Path) -> list[Path]:
    """Write the frozen journals to a folder, as `packets rerun` reads them."""
    files = []
    for packed in sorted(JOURNALS.glob("*.journal.gz")):
        files.append(folder / packed.stem)
        files[-1].write_bytes(gzip.decompress(packed.read_bytes()))
    return files


def run_again(files: list[Path], capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    code = rerun([*map(str, files), "--json"])
    told = capsys.readouterr()
    assert told.err == ""
    reports = [json.loads(line) for line in told.out.splitlines()]
    assert code == (0 if all(report["identical"] for report in reports) else 1)
    return reports


def test_promise_42_every_conversation_runs_again_without_a_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = unpacked(tmp_path)
    assert [file.name for file in files] == [
        f"{name}.{kind}.journal"
        for name in sorted(CONVERSATIONS)
        for kind in ("emulator", "server")
    ]
    reports = run_again(files, capsys)
    assert {report["version"] for report in reports} == {__version__}
    found = {
        Path(report["file"]).name: report["difference"]
        for report in reports
        if not report["identical"]
    }
    assert not found, "\n".join(f"{name}: {how}" for name, how in found.items())
    # None was left out, and none ended early.
    noted_lines = [list(map(json.loads, file.read_text("ascii").splitlines())) for file in files]
    assert [report["events"] for report in reports] == [
        sum("on" in line for line in each) for each in noted_lines
    ]
    assert [report["bytes_out"] for report in reports] == [
        sum(len(line["hex"]) // 2 for line in each if "out" in line) for each in noted_lines
    ]


def test_the_conversations_hold_every_kind_of_event() -> None:
    noted_lines = [
        json.loads(line)
        for packed in JOURNALS.glob("*.journal.gz")
        for line in gzip.decompress(packed.read_bytes()).splitlines()
    ]
    assert {line["on"] for line in noted_lines if "on" in line} == EVENTS
    assert {line["ask"] for line in noted_lines if "ask" in line} == ASKED


@pytest.mark.parametrize("kind", ["emulator", "server"])
def test_a_single_byte_that_differs_is_told(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (file,) = [each for each in unpacked(tmp_path) if each.name == f"jog.{kind}.journal"]
    noted_lines = file.read_text("ascii").splitlines(keepends=True)
    at = [number for number, line in enumerate(noted_lines) if line.startswith('{"out"')][100]
    one = json.loads(noted_lines[at])
    data = bytearray.fromhex(one["hex"])
    data[-1] ^= 1
    noted_lines[at] = json.dumps({**one, "hex": data.hex()}) + "\n"
    file.write_text("".join(noted_lines), "ascii")
    (report,) = run_again([file], capsys)
    assert not report["identical"]
    assert report["difference"]["event"] == sum('"on": ' in line for line in noted_lines[:at])


def test_every_question_is_written_as_it_was() -> None:
    then = QUESTIONS.read_text("utf-8").splitlines()
    found = list(difflib.unified_diff(then, lines(), "then", "now", lineterm="", n=0))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("kind", KINDS)
def test_none_of_a_kind_is_left_out(kind: str) -> None:
    union, asked = KINDS[kind]
    assert {type(each) for each in asked} == kinds_of(union)


def test_every_call_of_the_clients_is_as_it_was() -> None:
    then = SIGNATURES.read_text("utf-8").splitlines()
    found = list(difflib.unified_diff(then, Calls().lines(), "then", "now", lineterm="", n=0))
    assert not found, "\n".join(found)


DATA = sorted(
    file
    for file in FROZEN.rglob("*")
    if file.is_file() and file.suffix != ".py" and "__pycache__" not in file.parts
)

OF_MODULES = re.compile(
    # No `tools`: operations begin so.
    rb"\b(?:openpendant|server|motion|simplemsg|controller_emulator|tests)"
    rb"(?:\.[a-z_]+)+\b|\w\.py\b|Traceback|\bat 0x[0-9a-f]"
)
OF_MACHINES = re.compile(rb"/(?:tmp|home|root|work|Users|var|usr|opt|private)\b|[A-Z]:\\")
ADDRESSES = re.compile(rb"\b\d+\.\d+\.\d+\.\d+\b")
NOBODYS = re.compile(rb"127\.0\.0\.1|192\.0\.2\.\d+")
MAIL = re.compile(rb"[A-Za-z][\w.+-]*@[\w-]+\.[A-Za-z]{2,}")

_HEX = re.compile(rb'(?<="hex": ")[0-9a-f]*')
_BASE64 = re.compile(rb'"[A-Za-z0-9+/]{200,}=*"')

MOST_BYTES = 1_500_000


def contents(file: Path) -> Iterator[bytes]:
    """Yield what is in a file: its text without what is encoded in it, and each of that."""
    data = file.read_bytes()
    if file.suffix == ".gz":
        data = gzip.decompress(data)
    yield from (bytes.fromhex(match.decode()) for match in _HEX.findall(data))
    yield _BASE64.sub(b"", _HEX.sub(b"", data))


def traces(data: bytes) -> list[bytes]:
    found = [match.group() for rule in (OF_MODULES, OF_MACHINES) for match in rule.finditer(data)]
    return found + [each for each in ADDRESSES.findall(data) if not NOBODYS.fullmatch(each)]


def test_nothing_tells_of_modules_and_machines() -> None:
    found = {}
    for file in DATA:
        *encoded, text = contents(file)
        told = {trace for data in (*encoded, text) for trace in traces(data)}
        found[file.name] = told | set(MAIL.findall(text))
    assert {name: told for name, told in found.items() if told} == {}
    assert len(found) > 30


@pytest.mark.parametrize(
    "told",
    [
        b"openpendant.server.core",
        b"server.programs.statements.Move",
        b"core.py",
        b"<object at 0x7f2a>",
        b"/tmp/pytest-of-somebody",
        b"192.168.1.7",
    ],
)
def test_what_tells_of_them_would_be_found(told: bytes, tmp_path: Path) -> None:
    file = tmp_path / "some.journal"
    for line in (b'{"note": "%s"}' % told, b'{"out": "1", "hex": "%s"}' % told.hex().encode()):
        file.write_bytes(line)
        assert [trace for data in contents(file) for trace in traces(data)]


def test_all_of_it_is_small() -> None:
    assert sum(file.stat().st_size for file in DATA) < MOST_BYTES
