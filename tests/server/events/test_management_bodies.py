"""Bodies of management requests: what is read of them, and up to where."""

import json

import pytest

from openpendant.server.events import management_requests
from openpendant.server.events.management_requests import parse
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.cell import WhyRequest
from openpendant.simplemsg.pendant.management.programs import SetBreakpoints
from openpendant.simplemsg.verdicts import VerdictCode as V


def refused(body: bytes) -> str:
    _, refusal = parse(body)
    assert isinstance(refusal, Refusal)
    assert refusal.code is V.BAD_ARGUMENT
    return refusal.text


@pytest.mark.parametrize(
    ("body", "key"),
    [
        (b'{"op":"why","kind":"move","kind":"run"}', "kind"),
        (b'{"op":"why","op":"why"}', "op"),
        (b'{"op":"scene.add","object":{"name":"a","name":"a"},"expected_revision":0}', "name"),
        (b'{"op":"why","x":[{"y":[{"z":1,"z":1}]}]}', "z"),
    ],
)
def test_a_key_that_stands_twice_in_an_object_is_refused_by_its_name(body: bytes, key: str) -> None:
    assert refused(body) == f"the key {key!r} stands twice in one object"


def test_the_operation_is_told_all_the_same() -> None:
    assert parse(b'{"op":"why","kind":1,"kind":1}')[0] == "why"


def test_a_key_that_stands_twice_is_told_in_a_few_plain_characters() -> None:
    key = "\\u001b" + "k" * 1_000
    text = refused(f'{{"{key}":1,"{key}":1}}'.encode())
    assert len(text) < 100
    assert text.isprintable()


@pytest.mark.parametrize("body", [b'{"op":"why"}', b' {"op" : "why", "kind": "move"} '])
def test_keys_of_different_objects_and_names_may_be_equal(body: bytes) -> None:
    assert isinstance(parse(body)[1], WhyRequest)
    twice = json.dumps({"op": "scene.import", "content": [{"a": 1}, {"a": 1}]}).encode()
    assert "twice" not in refused(twice)


@pytest.mark.parametrize("body", [b"null", b" null", b"[]", b"{}", b'[{"op":"why"}]', b"", b"{"])
def test_what_is_no_request_names_no_operation(body: bytes) -> None:
    name, refusal = parse(body)
    assert (name, type(refusal)) == ("", Refusal)


def test_the_first_wrong_element_of_a_list_is_told() -> None:
    body = {"op": "programs.breakpoints", "name": "a", "statements": [0, "x", *["y"] * 5_000]}
    text = refused(json.dumps(body).encode())
    assert text.startswith("programs.breakpoints.statements.1: Input should be a valid integer")


def test_a_list_is_read_up_to_its_first_wrong_element(monkeypatch: pytest.MonkeyPatch) -> None:
    faults: list[int] = []
    fault = management_requests._fault

    def counted(name: str, body: bytes, error: object, version: int) -> Refusal:
        faults.append(error.error_count())  # type: ignore[attr-defined]  # a ValidationError
        return fault(name, body, error, version)  # type: ignore[arg-type]

    monkeypatch.setattr(management_requests, "_fault", counted)
    for field, value in (("positions", [["a"] * 900] * 4), ("positions", ["a"] * 20)):
        refused(json.dumps({"op": "tools.calibrate", field: value}).encode())
    # The element, and that the list is too short without it.
    assert faults == [2, 2]


def test_a_right_list_is_read_to_its_end() -> None:
    body = {"op": "programs.breakpoints", "name": "a", "statements": list(range(1_000))}
    _, asked = parse(json.dumps(body).encode())
    assert isinstance(asked, SetBreakpoints)
    assert len(asked.statements) == 1_000
