from __future__ import annotations

from pathlib import Path

import pytest
from message_samples import DECLARED

from openpendant.simplemsg import Message
from openpendant.simplemsg.declaration import Array, CountPlace, Reply, Tail, Topic
from openpendant.simplemsg.layout import WireForm

PAGE = (Path(__file__).parents[2] / "docs" / "simplemsg.md").read_text(encoding="utf-8")


def _usual(cls: type[Message]) -> str:
    return "reply" if issubclass(cls, Reply) else "topic" if issubclass(cls, Topic) else "request"


def _body_size(cls: type[Message], form: WireForm) -> str:
    fixed = {name: f for name, f in cls.FIELDS.items() if not isinstance(f, Array | Tail)}
    head = form.structure(fixed).size
    for field in cls.FIELDS.values():
        if isinstance(field, Tail):
            return f"{head} + tail"
        if isinstance(field, Array):
            assert field.of is not None
            head += 0 if field.count_place is CountPlace.NOWHERE else 4
            record = form.structure(field.of.FIELDS).size
            return (
                str(head + record * field.most)
                if field.least == field.most
                else (f"{head} + {record} n")
            )
    return str(head)


@pytest.mark.parametrize("declared", DECLARED)
def test_the_message_table_shows_what_is_declared(declared: str) -> None:
    cls = DECLARED[declared]
    place = cls.PLACE
    sizes = list(dict.fromkeys(_body_size(cls, WireForm("<", real)) for real in "fd"))
    row = (
        f"| {int(place.msg_type)} | `{place.name}` | {_usual(cls)} | {place.direction.value}"
        f" | {'; '.join(sizes)} | {place.about} |"
    )
    assert row in PAGE
