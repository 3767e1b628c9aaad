"""The typed calls of both clients against the models of the server: every operation and field."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import BaseModel, TypeAdapter

from openpendant.server.pendant.served_cells import ServedCells
from openpendant.server.pendant.snapshot import Snapshot
from openpendant.server.programs import edits as server_edits
from openpendant.server.programs import statements as server_statements
from openpendant.server.recording.document import RecordingDocument
from openpendant.server.why import WhyReply
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.management import edits, statements
from openpendant.tools.pendants.management.calls import AsyncCalls, Request, asks, call
from openpendant.tools.pendants.management.recordings import play
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.reference.operations import (
    GROUPS,
    PublishedOperation,
    made_by,
    published_operations,
    request_models,
)
from openpendant.tools.reference.typed_data import is_optional

ALL = published_operations()
each_operation = pytest.mark.parametrize("operation", ALL.values(), ids=list(ALL))


def test_every_operation_of_the_server_has_a_call() -> None:
    assert set(ALL) == set(request_models())


def _default(field: Any) -> Any:
    value = field.get_default(call_default_factory=True)
    return value.model_dump() if isinstance(value, BaseModel) else value


@each_operation
def test_a_call_takes_the_fields_of_its_request_with_the_same_defaults(
    operation: PublishedOperation,
) -> None:
    fields = {name: each for name, each in operation.request.model_fields.items() if name != "op"}
    arguments = {each.name: each for each in operation.arguments}
    assert set(arguments) == set(fields)
    for name, field in fields.items():
        argument = arguments[name]
        assert field.is_required() == (argument.default is argument.empty), name
        if not field.is_required():
            assert argument.default == _default(field), name
            assert argument.kind is argument.KEYWORD_ONLY, name


@each_operation
def test_a_request_holds_each_argument_under_its_own_name(operation: PublishedOperation) -> None:
    values = {each.name: object() for each in operation.arguments}
    made = made_by(operation.make, **values)
    assert made.op == operation.name
    assert made.fields == values


@each_operation
def test_a_call_says_what_each_argument_means(operation: PublishedOperation) -> None:
    told = operation.told
    assert told.about
    assert list(told.section("Args")) == [each.name for each in operation.arguments]


def _by_tag(union: Any, tag: str) -> dict[str, Any]:
    """Return the members of a union, by their tag."""
    found = {}
    for member in get_args(union):
        (value,) = get_args(get_type_hints(member)[tag])
        found[value] = member
    return found


TAGGED = [
    ("edit", server_edits.Edit, edits.Edit),
    ("statement", server_statements.Statement, statements.Statement),
]


@pytest.mark.parametrize(("tag", "theirs", "ours"), TAGGED, ids=["edits", "statements"])
def test_edits_and_statements_have_the_fields_of_the_server(
    tag: str, theirs: Any, ours: Any
) -> None:
    known, typed = _by_tag(theirs, tag), _by_tag(ours, tag)
    assert set(typed) == set(known)
    for value, kind in typed.items():
        properties, required = _fields(known[value])
        keys = get_type_hints(kind)
        assert set(keys) == set(properties), value
        needed = {name for name in keys if not is_optional(kind, name)} - {tag}
        assert needed == required - {tag}, value


def _fields(kind: Any) -> tuple[Mapping[str, Any], set[str]]:
    schema = TypeAdapter(kind).json_schema()
    return schema["properties"], set(schema.get("required", ()))


@pytest.mark.parametrize(
    ("name", "nested"),
    [
        ("Move", "speed"),
        ("RecordPoint", "point"),
        ("TouchUp", "pose"),
        ("TouchUp", "configuration"),
    ],
)
def test_what_is_inside_an_edit_has_the_fields_of_the_server(name: str, nested: str) -> None:
    theirs = getattr(server_edits if name != "Move" else server_statements, name)
    ours = getattr(edits if name != "Move" else statements, name)
    their_kind, our_kind = (_inner(get_type_hints(kind)[nested]) for kind in (theirs, ours))
    assert set(get_type_hints(our_kind)) == set(_fields(their_kind)[0])


def _inner(kind: Any) -> Any:
    choices = [each for each in get_args(kind) if each is not type(None)]
    return choices[0] if choices else kind


@pytest.mark.parametrize(
    ("name", "theirs"),
    [
        ("snapshot", Snapshot),
        ("cells", ServedCells),
        ("why", WhyReply),
        ("recordings.stop", RecordingDocument),
    ],
)
def test_a_reply_that_the_server_has_a_model_of_has_its_fields(
    name: str, theirs: type[BaseModel]
) -> None:
    assert _paths(ALL[name].returned) == _paths(theirs)


def _paths(kind: Any) -> set[str]:
    """Return the names of all fields, those of objects inside among them."""
    schema = TypeAdapter(kind).json_schema(mode="serialization")
    inside = schema.get("$defs", {}).values()
    return {name for each in (schema, *inside) for name in each.get("properties", {})}


def test_both_clients_have_the_same_groups_with_the_same_calls() -> None:
    thread = LoopThread("nobody")
    background = PendantClient()
    blocking = SyncPendantClient(thread, background)
    try:
        for group, kind in GROUPS.items():
            own, other = (
                getattr(client, group) if group else client for client in (background, blocking)
            )
            assert isinstance(own, kind)
            assert isinstance(other, kind)
            extra = {"programs": ["run"], "recordings": ["play"]}.get(group, [])
            for name in extra:
                assert inspect.signature(getattr(own, name)).parameters.keys() == (
                    inspect.signature(getattr(other, name)).parameters.keys()
                )
    finally:
        thread.end()


class Echo:
    """A group of one call, which returns what was asked."""

    @call
    def say(self, word: str, *, loud: bool = False) -> Request[dict[str, Any]]:
        """Say something."""
        return asks("echo.say", word=word, loud=loud)

    @call
    def hear(self) -> Request[str]:
        """Return one field of the reply."""
        return Request("echo.hear", {}, part="op")


class AsyncEcho(Echo, AsyncCalls):
    """It, awaited."""


async def _manage(request: dict[str, Any]) -> dict[str, Any]:
    return request


@pytest.mark.asyncio
async def test_an_awaited_call_returns_the_reply_or_the_part_of_it_that_is_meant() -> None:
    echo = AsyncEcho(_manage)
    assert await echo.say("ho", loud=True) == {"op": "echo.say", "word": "ho", "loud": True}
    assert await echo.hear() == "echo.hear"
    assert echo.say.__doc__ == "Say something."


def test_a_wrong_argument_is_python_s_own_error_and_never_leaves() -> None:
    with pytest.raises(TypeError, match="louder"):
        AsyncEcho(_manage).say("ho", louder=True)  # type: ignore[call-arg, unused-coroutine]


def test_playing_back_is_documented_at_the_function_that_makes_its_request() -> None:
    assert play("swing").body["op"] == "recordings.play"
    assert "soft" in (play.__doc__ or "")
