from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from rigs.data.program_samples import program

from openpendant.server.programs.language.program import Program
from openpendant.server.programs.language.program_errors import ProgramTooLarge
from openpendant.server.programs.language.program_json import (
    MOST_JSON_BYTES,
    program_from_json,
    program_from_source,
    program_to_json,
    source_of,
)
from openpendant.simplemsg.pendant.management.words import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def document() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(program_to_json(program("move PTP a\nwait 1 s")))
    return found


def refused(body: Any) -> ProgramError:
    text = body if isinstance(body, str) else json.dumps(body)
    with pytest.raises(ProgramError) as caught:
        program_from_json(text, "body")
    return caught.value


def test_the_format_is_named(document: dict[str, Any]) -> None:
    assert document["format"] == "openpendant-program/1"
    assert document["statements"][1] == {"statement": "wait", "duration": 1.0, "comment": ""}


@pytest.mark.parametrize(
    ("path", "value", "message", "code"),
    [
        (["format"], "openpendant-program/2", "body: format: ", V.PROGRAM_SYNTAX),
        (["name"], "a/b", "the name of the program has '/'", V.BAD_NAME),
        (["name"], 7, "body: name: ", V.PROGRAM_SYNTAX),
        (["extra"], 7, "body: extra: ", V.PROGRAM_SYNTAX),
        (["points", 0, "joints", 2], "1", "body: points[0].joints[2]: ", V.PROGRAM_SYNTAX),
        (["points", 0, "joints", 2], 1e9, "body: points[0]: joint 3 of ", V.PROGRAM_INVALID),
        (["points", 1, "name"], "a", "there is a point 'a' already", V.POINT_EXISTS),
        (["statements", 0, "point"], "x", "no point is named 'x'", V.POINT_UNKNOWN),
        (["statements", 0, "statement"], "fly", "body: statements[0]: ", V.PROGRAM_SYNTAX),
        (["statements", 0, "way"], "ptp", "body: statements[0].move.way: ", V.PROGRAM_SYNTAX),
        (["statements", 0, "zone"], True, "body: statements[0].move.zone: ", V.PROGRAM_SYNTAX),
        (["linear_axes"], [2, 1], "the linear axes are [2, 1]", V.PROGRAM_INVALID),
    ],
)
def test_a_wrong_field_is_named(
    document: dict[str, Any], path: list[Any], value: Any, message: str, code: V
) -> None:
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    error = refused(document)
    assert message in f"body: {error}" if "body: the" in message else message in str(error)
    assert error.code is code


@pytest.mark.parametrize(
    "body",
    [
        *("", "[]", "null", "{}", "{", "[" * 100_000, '{"format":' * 100_000),
        *("\udc00", '{"name": NaN}', '{"format": "openpendant-program/1", "name": "\\u0000"}'),
    ],
)
def test_what_is_no_program_is_refused(body: str) -> None:
    assert refused(body).code is V.PROGRAM_SYNTAX


def test_numbers_that_are_none_are_refused(document: dict[str, Any]) -> None:
    document["points"][0]["joints"][0] = float("nan")
    assert "joint 1 of point a is nan" in str(refused(document))


def test_a_body_that_is_too_large_is_refused_unread() -> None:
    with pytest.raises(ProgramTooLarge, match=str(MOST_JSON_BYTES)):
        program_from_json(" " * (MOST_JSON_BYTES + 1))


@pytest.mark.parametrize(
    ("once", "twice", "key"),
    [
        ('"name":"main"', '"name":"main","name":"other"', "name"),
        ('"point":"a"', '"point":"a","point":"b"', "point"),
        ('"duration":1.0', '"duration":1.0,"duration":1.0', "duration"),
    ],
)
@pytest.mark.parametrize(
    "read", [program_from_source, lambda text, file: source_of(text.encode(), file).program]
)
def test_a_key_that_stands_twice_in_what_somebody_wrote_is_refused(
    document: dict[str, Any], read: Callable[[str, str], Program], once: str, twice: str, key: str
) -> None:
    text = json.dumps(document, separators=(",", ":"))
    assert text.count(once) == 1
    with pytest.raises(ProgramError, match=f"^body: has the key '{key}' twice") as caught:
        read(text.replace(once, twice), "body")
    assert caught.value.code is V.PROGRAM_SYNTAX


@pytest.mark.parametrize(
    "read", [program_from_source, lambda text, file: source_of(text.encode(), file).program]
)
def test_a_byte_order_mark_is_taken_before_json_as_before_text(
    document: dict[str, Any], read: Callable[[str, str], Program]
) -> None:
    text = json.dumps(document)
    assert read("\ufeff" + text, "body") == program_from_json(text)
    with pytest.raises(ProgramError):
        read("\ufeff\ufeff" + text, "body")


@pytest.mark.parametrize("body", ["\udc00", "[" * 100_000, "{", b"\xff{}"])
def test_what_is_no_json_is_refused_as_what_is_no_program(body: str | bytes) -> None:
    with pytest.raises(ProgramError) as caught:
        program_from_source(body)
    assert caught.value.code is V.PROGRAM_SYNTAX
