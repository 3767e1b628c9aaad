"""The enumerated fields of STATE: members go out, and what a newer server says comes in."""

from dataclasses import replace
from enum import IntFlag

import pytest
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import PENDANT, Message, codec_for
from openpendant.simplemsg.declaration import Int
from openpendant.simplemsg.pendant import Activity, State

STATE = SAMPLES[State]
CODEC = codec_for(PENDANT)
ENUMERATED = {
    name: field.values
    for name, field in State.FIELDS.items()
    if isinstance(field, Int) and field.values is not None
}


def decoded(state: Message) -> State:
    message = CODEC.decode(CODEC.encode(state))
    assert isinstance(message, State)
    return message


def test_fourteen_fields_have_an_enumeration_as_their_type() -> None:
    spelled = State.__annotations__
    assert len(ENUMERATED) == 14
    assert all(kind.__name__ in str(spelled[name]) for name, kind in ENUMERATED.items())


@pytest.mark.parametrize("name", ENUMERATED)
def test_a_member_comes_back_as_an_equal_number(name: str) -> None:
    for member in ENUMERATED[name]:
        state = replace(STATE, **{name: member})
        assert CODEC.encode(state) == CODEC.encode(replace(STATE, **{name: int(member)}))
        assert getattr(decoded(state), name) == member


@pytest.mark.parametrize("name", ENUMERATED)
def test_a_value_of_a_newer_server_comes_through_as_a_number(name: str) -> None:
    unknown = 1 << 20 if issubclass(ENUMERATED[name], IntFlag) else 99
    state = decoded(replace(STATE, **{name: unknown}))
    assert getattr(state, name) == unknown
    assert CODEC.encode(state) == CODEC.encode(replace(STATE, **{name: unknown}))


def test_no_activity_has_the_number_that_the_test_takes_for_a_newer_one() -> None:
    assert 99 not in set(Activity)
