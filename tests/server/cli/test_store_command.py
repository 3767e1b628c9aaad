import json
from pathlib import Path
from typing import Any

import pytest
from rigs.data.stored_documents import ANN, opened, save

from openpendant.server.cli.store_commands import main
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows
from openpendant.server.store.store_client import default_path
from openpendant.tools.cli import main as openpendant

Capture = pytest.CaptureFixture[str]

RECORDING = DocumentKind.RECORDING

HEADINGS = ",".join(["name", *(f"joints[{number}]" for number in range(6))])

# Readers may leave them behind, empty.
SHARED = ("store.db-shm", "store.db-wal", "store.db-reserve")


def welding(joint: float) -> str:
    points = [{"name": "p1", "joints": [0.5, joint, 0.0, 0.0, 0.0, 0.0]}]
    return json.dumps(
        {"format": "openpendant-program/1", "name": "weld", "robot": "ur5", "points": points}
    )


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "store.db"
    monkeypatch.setenv("OPENPENDANT_STORE", str(path))
    with opened(path) as store:
        save(store, "weld", welding(1.0))
        save(store, "weld", welding(2.0), 1)
        store.save(RECORDING, "r", '{"columns": ["t", "j1"]}', expected_revision=0, author=ANN)
        store.append_chunk("r", 0, pack_rows([(0.0, 0.5), (0.01, 0.25)]))
        secret = '{"hash": "secret"}'
        store.save(DocumentKind.ACCOUNT, ANN, secret, expected_revision=0, author=ANN)
    return path


def run(capsys: Capture, *arguments: object) -> tuple[int, str, str]:
    code = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return code, out, err


def run_json(capsys: Capture, *arguments: object) -> Any:
    code, out, err = run(capsys, *arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)


def joints(capsys: Capture, *revision: object) -> list[float]:
    """Return the first two joints of the program's point."""
    shown = run_json(capsys, "show", "program", "weld", *revision)
    first: list[float] = shown["body"]["points"][0]["joints"][:2]
    return first


def test_it_is_a_command_of_openpendant(path: Path, capsys: Capture) -> None:
    assert openpendant(["store", "list"]) == 0
    assert "weld" in capsys.readouterr().out


def test_documents_are_listed(path: Path, capsys: Capture) -> None:
    listed = run_json(capsys, "list")
    assert [(item["kind"], item["name"], item["revision"]) for item in listed] == [
        ("account", "ann", 1),
        ("program", "weld", 2),
        ("recording", "r", 1),
    ]
    assert [item["name"] for item in run_json(capsys, "list", "program")] == ["weld"]
    code, out, err = run(capsys, "list", "program")
    assert (code, err) == (0, "1 document\n")
    assert out.split()[:4] == ["program", "weld", "revision", "2"]


def test_a_document_is_shown_with_its_past(path: Path, capsys: Capture) -> None:
    assert joints(capsys) == [0.5, 2.0]
    assert joints(capsys, "--revision", 1) == [0.5, 1.0]
    history = run_json(capsys, "show", "program", "weld", "--history")
    assert [item["revision"] for item in history] == [1, 2]
    assert run(capsys, "show", "program", "weld", "--history")[2] == "2 revisions\n"
    shown = run_json(capsys, "show", "recording", "r")
    assert (shown["chunks"], shown["size"]) == (1, 32)
    code, out, _ = run(capsys, "show", "program", "weld")
    assert (code, out.splitlines()[0]) == (0, "program weld, revision 2 by ann")


def test_all_but_accounts_goes_out_and_comes_in_again(
    path: Path, tmp_path: Path, capsys: Capture
) -> None:
    file, other = tmp_path / "all.json", tmp_path / "other.db"
    assert run(capsys, "export", file)[:2] == (0, f"wrote {file}: 2 documents\n")
    assert "secret" not in file.read_text()
    assert file.stat().st_mode & 0o777 == 0o600
    came_in = run_json(capsys, "import", file, "--store", other)
    assert [item["name"] for item in came_in] == ["weld", "r"]
    code, _, err = run(capsys, "import", file, "--store", other)
    assert code == 3
    assert "saved as revision 1 by" in err
    again = run_json(capsys, "import", file, "--store", other, "--replace")
    assert [item["revision"] for item in again] == [2, 3]  # the recording was deleted as its 2
    assert run(capsys, "check", "--store", other)[0] == 0


def test_accounts_go_out_when_asked_for(path: Path, tmp_path: Path, capsys: Capture) -> None:
    assert run(capsys, "export", tmp_path / "all.json", "--accounts")[0] == 0
    assert "secret" in (tmp_path / "all.json").read_text()


def test_points_and_samples_go_out_and_come_in_as_csv(
    path: Path, tmp_path: Path, capsys: Capture
) -> None:
    points, samples = tmp_path / "points.csv", tmp_path / "samples.csv"
    assert run(capsys, "export", points, "--kind", "program")[0] == 0
    assert points.read_text() == f"{HEADINGS}\np1,0.5,2.0,0.0,0.0,0.0,0.0\n"
    assert run(capsys, "export", samples, "--name", "r")[0] == 0
    assert samples.read_text() == "t,j1\n0.0,0.5\n0.01,0.25\n"
    points.write_text(f"{HEADINGS}\np1,0.5,3.0,0,0,0,0\n")
    assert run_json(capsys, "import", points, "--name", "weld", "--replace")[0]["revision"] == 3
    assert joints(capsys) == [0.5, 3.0]
    samples.write_text("t,j1,j2,j3,j4,j5,j6\n0.0,0.5,0,0,0,0,0\n0.01,0.25,0,0,0,0,0\n")
    of_r2 = ["--kind", "recording", "--name", "r2", "--robot", "ur5"]
    assert run_json(capsys, "import", samples, *of_r2)[0]["revision"] == 1
    assert run_json(capsys, "show", "recording", "r2")["size"] == 2 * 7 * 8


def test_a_backup_is_a_store_and_overwrites_nothing(
    path: Path, tmp_path: Path, capsys: Capture
) -> None:
    copy = tmp_path / "copy.db"
    with opened(path) as server:
        save(server, "later")
        assert run(capsys, "backup", copy)[0] == 0
    assert "later" in {item["name"] for item in run_json(capsys, "list", "--store", copy)}
    code, _, err = run(capsys, "backup", copy)
    assert (code, "exists" in err) == (3, True)
    assert run(capsys, "backup", copy, "--force")[0] == 0
    assert run(capsys, "check", "--store", copy)[0] == 0


@pytest.mark.parametrize("name", ["out.json", "out.csv", "out.program"])
def test_an_export_overwrites_only_what_it_is_told_to(
    path: Path, tmp_path: Path, capsys: Capture, name: str
) -> None:
    (tmp_path / name).write_text("mine")
    export = ["export", tmp_path / name, "--kind", "program"]
    code, _, err = run(capsys, *export)
    assert (code, "exists already; choose another file, or say --force" in err) == (3, True)
    assert (tmp_path / name).read_text() == "mine"
    assert run(capsys, *export, "--force")[0] == 0
    assert "p1" in (tmp_path / name).read_text()


@pytest.mark.parametrize("command", ["export", "backup"])
def test_nothing_is_written_over_the_store_itself(
    path: Path, capsys: Capture, command: str
) -> None:
    code, _, err = run(capsys, command, path, "--force")
    assert (code, "is the store itself" in err) == (3, True)
    assert run(capsys, "check")[0] == 0


def test_a_document_is_deleted_whatever_is_in_it(path: Path, capsys: Capture) -> None:
    with opened(path) as store:
        store.save(DocumentKind.FRAMES, "left", '{"x": 1}', expected_revision=0, author=ANN)
    gone = run_json(capsys, "delete", "frames", "left")
    assert [(item["revision"], item["deleted"]) for item in gone] == [(2, True)]
    code, _, err = run(capsys, "delete", "frames", "left")
    assert (code, "there is no frames 'left'" in err) == (2, True)
    code, _, err = run(capsys, "delete", "account", ANN)
    assert (code, "openpendant users remove NAME" in err) == (2, True)


def test_a_check_says_what_is_there_and_what_is_wrong(path: Path, capsys: Capture) -> None:
    report = run_json(capsys, "check")
    assert report == {
        "documents": 3,
        "revisions": 4,
        "chunks": 1,
        "problems": [],
        "file": str(path),
        "is_sound": True,
    }
    with opened(path) as store:
        store.connection.execute("UPDATE revision SET body = '{' WHERE revision = 2")
        store.connection.execute("UPDATE recording_chunk SET sequence = 4")
        store.connection.execute("UPDATE revision SET kind = 'poem' WHERE kind = 'account'")
    code, out, _ = run(capsys, "check")
    assert code == 1
    assert "program 'weld', revision 2: has 1 bytes, not" in out
    assert "program 'weld', revision 2: is not JSON" in out
    assert "recording 'r': 1 chunks of 32 bytes are there, 5 of 32 bytes were saved" in out
    assert "poem 'ann', revision 1: unknown kind" in out
    assert "BAD" in out


def test_a_check_of_a_damaged_file_says_so_and_leaves_it_there(path: Path, capsys: Capture) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    damaged = path.read_bytes()
    assert run(capsys, "check")[0] in (1, 3)
    assert path.read_bytes() == damaged
    assert {file.name for file in path.parent.iterdir()} <= {"store.db", *SHARED}


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["show", "program", "nothing"], 2, "there is no program 'nothing'"),
        (["show", "program", "weld", "--revision", "9"], 2, "no such revision"),
        (["show", "program", "../etc"], 2, "accepted: a name without /"),
        (["show", "poem", "weld"], 2, "poem"),
        (["export", "x.csv"], 2, "one document, not 2; say --kind and --name"),
        (["export", "x.json", "--name", "nothing"], 2, "there is no document 'nothing'"),
        (["export", "missing/x.json"], 3, "No such file or directory"),
        (["import", "missing.json"], 3, "No such file or directory"),
        (["import", "missing.csv", "--name", "a"], 3, "No such file or directory"),
        (["import", "missing.csv"], 2, "say --name"),
        (["list", "--store", "missing.db"], 3, "there is no such file"),
        (["check", "--store", "missing.db"], 3, "there is no such file"),
        (["nothing"], 2, "nothing"),
    ],
)
def test_what_cannot_be_done_is_one_line_on_standard_error(
    path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capture,
    arguments: list[str],
    code: int,
    says: str,
) -> None:
    monkeypatch.chdir(path.parent)
    got, out, err = run(capsys, *arguments)
    assert (got, out, err.count("\n")) == (code, "", 1)
    assert says in err
    assert {file.name for file in path.parent.iterdir()} <= {"store.db", *SHARED}


def test_a_name_from_a_file_cannot_steer_the_terminal(
    path: Path, tmp_path: Path, capsys: Capture
) -> None:
    (tmp_path / "a\x1b[2J.json").write_text("{")
    _, _, err = run(capsys, "import", tmp_path / "a\x1b[2J.json")
    assert err.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"OPENPENDANT_STORE": "/a/b.db", "XDG_DATA_HOME": "/x"}, Path("/a/b.db")),
        ({"XDG_DATA_HOME": "/x"}, Path("/x/openpendant/store.db")),
        ({}, Path.home() / ".local/share/openpendant/store.db"),
    ],
)
def test_the_store_is_where_the_environment_says(
    environment: dict[str, str], expected: Path
) -> None:
    assert default_path(environment) == expected
