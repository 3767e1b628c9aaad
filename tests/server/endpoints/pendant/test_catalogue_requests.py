"""The catalogue over the wire is the published one, in chunks that fit."""

import json
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.server_rig import ready
from rigs.peers.server_clients import Pendant

from openpendant.server.endpoints.pendant import catalogue_requests
from openpendant.server.endpoints.pendant.catalogue_requests import MOST_CHUNK
from openpendant.simplemsg.pendant import PENDANT_MESSAGES, Management
from openpendant.simplemsg.pendant.catalogue import PARTS
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

PUBLISHED = Path(__file__).parents[4] / "docs" / "generated" / "catalogue.json"


@pytest.fixture
def pendant() -> Pendant:
    return ready().pendant()


def read(pendant: Pendant, part: str) -> list[dict[str, Any]]:
    """Return all entries of a part, however many chunks they take."""
    found: list[dict[str, Any]] = []
    offset: int | None = 0
    while offset is not None:
        chunk = pendant.ask("catalogue", part=part, offset=offset)
        assert (chunk["version"], chunk["part"], chunk["offset"]) == (3, part, offset)
        assert chunk["entries"]
        found += chunk["entries"]
        offset = chunk["next"]
        assert offset is None or offset == len(found)
        assert chunk["total"] >= len(found)
    return found


@pytest.mark.parametrize("part", PARTS)
def test_what_is_served_is_what_is_published(pendant: Pendant, part: str) -> None:
    published = json.loads(PUBLISHED.read_text("utf-8"))
    assert published["version"] == 3
    assert read(pendant, part) == published[part]


@pytest.mark.parametrize("part", PARTS)
def test_no_chunk_is_larger_than_48_kb(pendant: Pendant, part: str) -> None:
    read(pendant, part)
    sizes = [len(each.body) for each in pendant.all(Management)]
    assert sizes
    assert max(sizes) <= MOST_CHUNK == 48_000


@pytest.mark.parametrize("most", [8_000, 20_000])
@pytest.mark.parametrize("part", PARTS)
def test_what_does_not_fit_one_chunk_comes_in_several(
    pendant: Pendant, monkeypatch: pytest.MonkeyPatch, part: str, most: int
) -> None:
    whole = read(pendant, part)
    pendant.got.clear()
    monkeypatch.setattr(catalogue_requests, "MOST_CHUNK", most)
    assert read(pendant, part) == whole
    sizes = [len(each.body) for each in pendant.all(Management)]
    assert max(sizes) <= most
    # As many as fit: no entry is half as large as a chunk.
    assert min(sizes[:-1], default=most) > most / 2


def test_every_code_message_and_operation_is_in_it(pendant: Pendant) -> None:
    assert [each["number"] for each in read(pendant, "codes")] == sorted(CATALOGUE)
    messages = [(each["id"], each["is_reply"]) for each in read(pendant, "messages")]
    assert messages == [(kind.PLACE.msg_type, kind.PLACE.is_reply) for kind in PENDANT_MESSAGES]
    assert [each["op"] for each in read(pendant, "operations")] == list(OPERATIONS)


def test_a_field_is_told_with_its_place_its_unit_and_its_values(pendant: Pendant) -> None:
    (state,) = [each for each in read(pendant, "messages") if each["name"] == "state"]
    fields = {each["name"]: each for each in state["fields"]}
    assert fields["tool_speed"]["unit"] == "m/s"
    assert fields["sequence"]["offset"] == "16"
    assert fields["activity"]["values"]["MOVING"] == 2
    assert fields["valid_fields"]["is_bits"]
    assert not fields["activity"]["is_bits"]


def test_an_offset_behind_the_last_entry_is_refused_with_the_last_one(pendant: Pendant) -> None:
    told = pendant.ask("catalogue", part="codes", offset=len(CATALOGUE))
    assert (told["code"], told["limit"]) == (V.BAD_ARGUMENT, len(CATALOGUE) - 1)


def test_an_unknown_part_is_refused_with_the_known_ones(pendant: Pendant) -> None:
    told = pendant.ask("catalogue", part="recipes")
    assert told["code"] == V.BAD_ARGUMENT
    assert all(part in told["text"] for part in PARTS)


def test_version_2_is_named_the_operations_that_it_has() -> None:
    older = ready().stranger()
    older.hello(version=2)
    assert older.ask("dance")["text"] == "op: 'dance'; accepted: snapshot, cells, why"
    assert older.ask("catalogue", part="codes")["code"] == V.BAD_ARGUMENT
