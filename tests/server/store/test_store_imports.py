import itertools
import json
import os
from pathlib import Path
from typing import Any

import pytest
from rigs.data.program_samples import HEAD
from rigs.data.stored_documents import ANN, opened, save

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access.accounts import Account, StoredAccounts
from openpendant.server.access.passwords import NOBODYS_HASH
from openpendant.server.cli.store_commands import main
from openpendant.server.exchange import csv_format
from openpendant.server.exchange.text_format import FORMAT
from openpendant.server.programs.language.program_json import program_from_json
from openpendant.server.store import recording_format
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant.roles import Role
from openpendant.tools.cli import main as openpendant

Capture = pytest.CaptureFixture[str]

TEXT = HEAD.replace("main", "pick") + "move PTP a speed 12.5 %  # slow\n"
FRAMES = {"schema": "openpendant-frames/1"}
JOINTS, ZEROS = "j1,j2,j3,j4,j5,j6", "0,0,0,0,0,0"
UR5 = ["--robot", "ur5"]
SAMPLES = ["import", "samples.csv", "--kind", "recording", "--name", "r"]
HERE = {"xyz": [0.0, 0.0, 0.5], "quat": [0.0, 0.0, 0.0, 1.0]}
HANGING = FRAMES | {"frames": [HERE | {"name": "f", "parent": "g"}]}
A = {"robot": "ur5", "name": "a", "format": "openpendant-program/1"}
"""A program whose fields are in another order than they are kept in."""


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("OPENPENDANT_STORE", str(tmp_path / "store.db"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "store.db"


def account(name: str, role: Role = Role.ADMIN) -> Account:
    return Account(name=name, role=role, password=NOBODYS_HASH)


def add(path: Path, *accounts: Account) -> None:
    with opened(path) as store:
        for each in accounts:
            StoredAccounts(store, ANN).add(each)


def documents(*entries: dict[str, Any]) -> Path:
    file = Path("x.json")
    file.write_text(json.dumps({"format": FORMAT, "documents": entries}))
    return file


def document(kind: str, name: str, body: object) -> dict[str, Any]:
    return {"kind": kind, "name": name, "body": body}


def names(path: Path) -> list[tuple[str, str]]:
    with opened(path) as store:
        return [(heading.kind, heading.name) for heading in store.headings()]


GOOD = document("setting", "good", {})


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (document("account", "eve", {"role": "admin"}), "body.name: account 'eve': Field required"),
        (
            document("account", "eve", account("Ann").model_dump(mode="json")),
            "body.name: account 'eve': is 'Ann', which is kept as 'ann'",
        ),
        (document("program", "junk", {}), "body.format: program 'junk': Field required"),
        (document("program", "b", A), "body.name: program 'b': is 'a'; accepted: 'b'"),
        (document("frames", "left", {"x": 1}), "body.schema: frames 'left': is not"),
        (document("frames", "left", HANGING), "body.frames[0]: frames 'left'"),
        (document("tools", "left", FRAMES | {"selected_tool": "g"}), "body.selected_tool: tools"),
        (document("scene", "left", {}), "body.schema: scene 'left'"),
        (document("recording", "r", {"columns": ["x", "j1"]}), "body.columns[0]: recording 'r'"),
        (document("recording", "r", {}), "body.columns: recording 'r': Field required"),
        (
            document("recording", "r", {"columns": ["t", "j2", "j1", "temperature"]}),
            "body.columns[3]: recording 'r': is 'temperature'; accepted: t, j1 to j3, and gap",
        ),
        (
            document("recording", "r", {"columns": ["t", "gap"]}),
            "body.columns: recording 'r': no column is 'j1'; accepted: t, j1, and gap",
        ),
        (document("setting", "ü" * 33, {}), "has 66 bytes of UTF-8; accepted: up to 64"),
    ],
)
def test_one_bad_document_keeps_the_whole_file_out_and_is_named(
    path: Path, capsys: Capture, bad: dict[str, Any], says: str
) -> None:
    code = main(["import", str(documents(GOOD, bad)), "--accounts"])
    err = capsys.readouterr().err
    assert (code, err.count("\n")) == (2, 1)
    assert says in err
    assert "x.json: documents[1]." in err or "bytes of UTF-8" in err
    assert names(path) == []


def test_a_program_is_kept_as_a_server_would_keep_it(path: Path) -> None:
    assert main(["import", str(documents(document("program", "a", A)))]) == 0
    with opened(path) as store:
        kept = json.loads(store.load(DocumentKind.PROGRAM, "a").body)
    assert list(kept)[:3] == ["format", "name", "robot"]
    assert (kept["points"], kept["statements"]) == ([], [])


def test_a_program_of_an_unknown_robot_is_taken_and_it_is_said(path: Path, capsys: Capture) -> None:
    body = A | {"robot": "our own arm"}
    assert main(["import", str(documents(document("program", "a", body)))]) == 0
    assert "'our own arm', which is no robot of the catalogue" in capsys.readouterr().err
    assert names(path) == [("program", "a")]


def test_frames_may_hang_from_tools_of_the_same_file_or_of_the_store(path: Path) -> None:
    tools = document("tools", "left", FRAMES | {"tools": [HERE | {"name": "g"}]})
    frames = document("frames", "left", HANGING)
    assert main(["import", str(documents(frames, tools))]) == 0
    assert main(["import", str(documents(frames)), "--replace"]) == 0


def test_tools_that_frames_of_the_store_hang_from_are_not_lost(path: Path, capsys: Capture) -> None:
    test_frames_may_hang_from_tools_of_the_same_file_or_of_the_store(path)
    assert main(["import", str(documents(document("tools", "left", FRAMES))), "--replace"]) == 2
    assert "does not go with the document frames 'left'" in capsys.readouterr().err


def test_accounts_come_in_when_asked_for_whole(path: Path, tmp_path: Path, capsys: Capture) -> None:
    add(path, account("Ann"), account("otto", Role.OPERATOR))
    assert main(["export", "all.json", "--accounts"]) == 0
    other = ["--store", "other.db"]
    assert main(["import", "all.json", *other]) == 2
    assert "account 'ann' is taken with --accounts only" in capsys.readouterr().err
    assert main(["import", "all.json", "--accounts", *other]) == 0
    with opened(tmp_path / "other.db") as store:
        book = StoredAccounts(store, ANN).book()
    assert {each.name: each.role for each in book} == {"Ann": Role.ADMIN, "otto": Role.OPERATOR}


def test_an_import_leaves_somebody_who_can_manage_the_accounts(path: Path, capsys: Capture) -> None:
    add(path, account("ann"))
    body = account("ann", Role.VIEWER).model_dump(mode="json")
    file = documents(GOOD, document("account", "ann", body))
    assert main(["import", str(file), "--accounts", "--replace"]) == 3
    assert "nobody could log in as admin afterwards" in capsys.readouterr().err
    assert names(path) == [("account", "ann")]


def test_a_whole_account_replaces_one_that_cannot_be_read(path: Path) -> None:
    with opened(path) as store:
        kind = DocumentKind.ACCOUNT
        store.save(kind, "eve", '{"role":"admin"}', expected_revision=0, author=ANN)
    file = documents(document("account", "eve", account("eve").model_dump(mode="json")))
    assert main(["import", str(file), "--accounts", "--replace"]) == 0
    with opened(path) as store:
        assert StoredAccounts(store, ANN).book().unreadable == {}


@pytest.mark.parametrize("file", ["pick.program", "pick.txt", "pick.json"])
def test_a_program_comes_in_as_text_and_as_what_convert_makes_of_it(path: Path, file: str) -> None:
    Path("pick.program").write_text(TEXT)
    if file == "pick.txt":
        Path(file).write_text(TEXT)
    if file == "pick.json":
        assert openpendant(["program", "convert", "pick.program", "--output", file]) == 0
    assert main(["import", file]) == 0
    assert main(["import", file, "--name", "other"]) == 0
    with opened(path) as store:
        for name in ("pick", "other"):
            body = store.load(DocumentKind.PROGRAM, name).body
            assert program_from_json(body).name == name


def test_a_program_goes_out_as_its_text_and_comes_in_again_the_same(path: Path) -> None:
    Path("pick.program").write_text(TEXT)
    assert main(["import", "pick.program"]) == 0
    assert main(["export", "out.program", "--name", "pick"]) == 0
    assert main(["import", "out.program", "--name", "again"]) == 0
    assert main(["export", "all.json"]) == 0
    with opened(path) as store:
        body, again = (store.load(DocumentKind.PROGRAM, name).body for name in ("pick", "again"))
    assert json.loads(again) == json.loads(body) | {"name": "again"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("hello", "x.program: line 1, column 1: found 'hello'; accepted: openpendant-program/1"),
        ('{"format": "poem"}', f"accepted: '{FORMAT}' or 'openpendant-program/1'"),
        ('{"format": "openpendant-program/1"}', "x.program: name: Field required"),
    ],
)
def test_what_is_no_program_is_refused_with_what_would_be(
    path: Path, capsys: Capture, text: str, says: str
) -> None:
    Path("x.program").write_text(text)
    assert main(["import", "x.program"]) == 2
    assert says in capsys.readouterr().err


def test_one_document_may_come_in_under_another_name(path: Path, capsys: Capture) -> None:
    assert main(["import", str(documents(GOOD)), "--name", "b"]) == 0
    assert names(path) == [("setting", "b")]
    two = documents(GOOD, document("setting", "other", {}))
    assert main(["import", str(two), "--name", "c"]) == 2
    assert "this one has 2 documents" in capsys.readouterr().err


def test_points_make_a_program_of_the_robot_that_is_named(path: Path, capsys: Capture) -> None:
    columns = ",".join(f"joints[{index}]" for index in range(6))
    Path("points.csv").write_text(f"name,{columns}\np1,0.5,0,0.25,0,0,0\n")
    new = ["import", "points.csv", "--name", "new"]
    assert main(new) == 2
    assert "points do not name their robot; say --robot" in capsys.readouterr().err
    assert main([*new, "--robot", "scara"]) == 2
    assert main([*new, "--robot", "ur5"]) == 0
    with opened(path) as store:
        program = program_from_json(store.load(DocumentKind.PROGRAM, "new").body)
    assert (program.robot, program.points[0].joints[2]) == ("ur5", 0.25)
    assert main(["export", "again.csv", "--name", "new"]) == 0
    assert main(["import", "again.csv", "--name", "new", "--replace"]) == 0
    Path("points.csv").write_text("name,color\np1,red\n")
    capsys.readouterr()
    assert main([*new, "--replace"]) == 2
    assert "points[0].joints: program 'new'" in capsys.readouterr().err


def test_a_program_without_points_goes_out_and_in_as_a_table(path: Path, capsys: Capture) -> None:
    Path("none.csv").write_text("name\n")
    assert main(["import", "none.csv", "--name", "empty", "--robot", "ur5"]) == 0
    capsys.readouterr()
    assert main(["export", "again.csv", "--name", "empty"]) == 0
    assert capsys.readouterr().out == "wrote again.csv: 1 document\n"
    assert main(["import", "again.csv", "--name", "empty", "--replace"]) == 0
    assert main(["import", "again.csv", "--name", "second", "--robot", "ur5"]) == 0
    with opened(path) as store:
        assert json.loads(store.load(DocumentKind.PROGRAM, "second").body)["points"] == []


def test_samples_make_a_recording_that_the_robot_that_is_named_can_play(path: Path) -> None:
    Path("samples.csv").write_text(f"t,{JOINTS},gap\n0,{ZEROS},0\n0.01,{ZEROS},0\n")
    assert main([*SAMPLES, *UR5]) == 0
    with opened(path) as store:
        document = recording_format.read_document("r", store.load(DocumentKind.RECORDING, "r").body)
    assert isinstance(document, recording_format.RecordingDocument)
    assert document.joints == serial_robot("ur5").limits.names
    extract = recording_format.extract_for("r", document, "ur5", 6)
    assert extract == recording_format.Extract(8, (1, 2, 3, 4, 5, 6))


OF_UR5 = "recording 'r' of 'ur5': "
NOT_ADVANCING = "samples.csv: line 4, column 1 (t): is {} s, after 0.2 s in the row before"


@pytest.mark.parametrize(
    ("columns", "times", "robot", "says"),
    [
        (f"t,{JOINTS}", "0", [], "recording 'r': samples do not name their robot; say --robot"),
        (f"t,{JOINTS}", "0", ["--robot", "nobody"], "no robot or robot file is called 'nobody'"),
        (
            f"t,{JOINTS}",
            *("0", ["--robot", "rail_kr5_arc"]),
            "samples.csv: line 1: recording 'r' of 'rail_kr5_arc': no column is 'j7'; accepted: t,"
            " j1 to j7, and gap if you like, each once",
        ),
        ("j1,j2", "0", UR5, f"samples.csv: line 1: {OF_UR5}no column is 't'"),
        ("t,j1,j2,j3,j4,j5,temperature", "0", UR5, f"line 1, column 7: {OF_UR5}is 'temp"),
        (f"t,{JOINTS},current", "0", UR5, f"column 8: {OF_UR5}is 'current'; accepted"),
        ("t,j1,j2,j3,j4,j5,j7", "0", UR5, f"column 7: {OF_UR5}is 'j7'; accepted: t, j1 to j6"),
        ("t,j0,j1,j2,j3,j4,j5", "0", UR5, f"column 2: {OF_UR5}is 'j0'; accepted"),
        ("t,J1,j2,j3,j4,j5,j6", "0", UR5, f"column 2: {OF_UR5}is 'J1'; accepted"),
        ("t, j1,j2,j3,j4,j5,j6", "0", UR5, f"column 2: {OF_UR5}is ' j1'; accepted"),
        ("t,j1,j2,j3,j4,j5", "0", UR5, f"line 1: {OF_UR5}no column is 'j6'; accepted"),
        *(
            (f"t,{JOINTS}", f"0 0.2 {time}", UR5, NOT_ADVANCING.format(time))
            for time in ("0.1", "0.2", "-1.0")
        ),
    ],
)
def test_samples_that_the_robot_could_not_play_stay_out(
    path: Path, capsys: Capture, columns: str, times: str, robot: list[str], says: str
) -> None:
    zeros = ",0" * columns.count(",")
    rows = "".join(f"{time}{zeros}\n" for time in times.split())
    Path("samples.csv").write_text(f"{columns}\n{rows}")
    assert main([*SAMPLES, *robot]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert says in err
    assert ("and gap if you like" in err) == ("line 1" in err)
    assert names(path) == []


def _joints_of_rows(path: Path) -> list[tuple[float, ...]]:
    """Return the positions of the kept recording as a UR5 would play them."""
    with opened(path) as store:
        document = recording_format.read_document("r", store.load(DocumentKind.RECORDING, "r").body)
        assert isinstance(document, recording_format.RecordingDocument)
        extract = recording_format.extract_for("r", document, "ur5", 6)
        assert isinstance(extract, recording_format.Extract)
        rows = list(recording_format.recording_rows(store, "r", extract.width))
    assert [row[0] for row in rows] == [0.0, 0.5]
    return [tuple(row[place] for place in extract.joints) for row in rows]


SHUFFLED = ["gap", "j2", "t", "j6", "j1", "j5", "j3", "j4"]
SHUFFLED_ROWS: list[list[float]] = [[0, 2, 0, 6, 1, 5, 3, 4], [0, 20, 0.5, 60, 10, 50, 30, 40]]
IN_ORDER = [(1, 2, 3, 4, 5, 6), (10, 20, 30, 40, 50, 60)]


@pytest.mark.parametrize("form", ["CSV", "JSON"])
def test_columns_are_taken_by_their_names_in_any_order(path: Path, form: str) -> None:
    if form == "CSV":
        lines = [SHUFFLED, *([str(value) for value in row] for row in SHUFFLED_ROWS)]
        Path("samples.csv").write_text("\n".join(map(",".join, lines)))
        assert main([*SAMPLES, *UR5]) == 0
    else:
        recording = document("recording", "r", {"columns": SHUFFLED, "robot": "ur5"})
        assert main(["import", str(documents(recording | {"samples": SHUFFLED_ROWS}))]) == 0
    assert _joints_of_rows(path) == IN_ORDER


def test_a_server_saves_while_a_table_is_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = "".join(f"{number / 100},{ZEROS}\n" for number in range(200))
    Path("samples.csv").write_text(f"t,{JOINTS}\n{rows}")
    with opened(path) as server:
        server.connection.execute("PRAGMA busy_timeout = 0")
        numbers = itertools.count()

        def saved_between(before: float | None, time: float) -> str:
            save(server, f"p{next(numbers)}")
            return recording_format.time_fault(before, time)

        monkeypatch.setattr(csv_format, "time_fault", saved_between)
        assert main([*SAMPLES, *UR5]) == 0
        assert server.extent("r").size == 200 * 7 * 8
    assert next(numbers) == 200


def test_a_name_that_is_taken_is_told_before_a_table_is_read(path: Path, capsys: Capture) -> None:
    Path("samples.csv").write_text(f"t,{JOINTS}\n0,{ZEROS}\n")
    assert main([*SAMPLES, *UR5]) == 0
    Path("samples.csv").unlink()
    capsys.readouterr()
    assert main([*SAMPLES, *UR5]) == 3
    assert "recording 'r': the change was of a new document" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", ["json", "csv", "program"])
def test_a_pipe_is_refused_instead_of_waited_for(path: Path, capsys: Capture, suffix: str) -> None:
    os.mkfifo(f"pipe.{suffix}")
    robot = UR5 if suffix == "csv" else []
    assert main(["import", f"pipe.{suffix}", "--name", "x", *robot]) == 3
    assert "is not a regular file" in capsys.readouterr().err


def test_a_name_of_an_older_program_may_be_longer_than_a_new_one(path: Path) -> None:
    """Up to 64 letters once, 64 bytes now: what was kept is read, changed and renamed."""
    name = "ü" * 64
    body = json.dumps({"format": "openpendant-program/1", "name": name, "robot": "ur5"})
    with opened(path) as store:
        save(store, "old", body)
        store.connection.execute("UPDATE revision SET name = ?", (name,))
        assert program_from_json(store.load(DocumentKind.PROGRAM, name).body).name == name
        assert save(store, name, body, 1) == 2
    assert main(["export", "old.program", "--name", name]) == 0
    assert main(["import", "old.program", "--name", "new"]) == 0
    assert main(["delete", "program", name]) == 0


@pytest.mark.parametrize("robot", [[], ["--robot", "ur5"]])
def test_points_for_a_name_that_is_taken_are_taken_with_replace_only(
    path: Path, capsys: Capture, robot: list[str]
) -> None:
    Path("pick.program").write_text(TEXT)
    assert main(["import", "pick.program"]) == 0
    assert main(["export", "points.csv", "--kind", "program", "--name", "pick"]) == 0
    points = ["import", "points.csv", "--name", "pick"]
    capsys.readouterr()
    assert main([*points, *robot]) == 2
    error = capsys.readouterr().err
    assert "program 'pick': is there already; accepted: --replace" in error
    assert "new" not in error
    assert main([*points, "--replace"]) == 0


@pytest.mark.parametrize("time", [0.1, 0.2])
def test_samples_in_json_that_do_not_advance_stay_out(
    path: Path, capsys: Capture, time: float
) -> None:
    recording = document("recording", "r", {"columns": ["t", "j1"]})
    file = documents(GOOD, recording | {"samples": [[0.0, 0.0], [0.2, 0.0], [time, 0.0]]})
    assert main(["import", str(file)]) == 2
    says = f"x.json: documents[1].samples[2][0]: is {time} s, after 0.2 s in the row before"
    assert says in capsys.readouterr().err
    assert names(path) == []
