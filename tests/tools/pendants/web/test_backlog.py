"""What waits for a browser that reads slowly."""

from typing import Literal

import pytest

from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.pendant import State
from openpendant.tools.pendants.web.backlog import (
    MOST_WAITING,
    STATES_WAIT_BELOW,
    Backlog,
    TooSlow,
)

LITTLE, BIG = ByteOrder.LITTLE, ByteOrder.BIG


def frame(msg_type: int, size: int, order: ByteOrder = LITTLE) -> bytes:
    word: Literal["little", "big"] = "little" if order is LITTLE else "big"
    head = [size - 4, msg_type, 1, 0]
    return b"".join(each.to_bytes(4, word) for each in head).ljust(size, b"\0")


def state(size: int = 500, order: ByteOrder = LITTLE) -> bytes:
    return frame(State.PLACE.msg_type, size, order)


def test_all_that_waits_is_taken_in_its_order() -> None:
    backlog = Backlog()
    sent = [state(), frame(7, 40), state(600), frame(8, 20)]
    for each in sent:
        backlog.add(each, LITTLE, 0)
    assert backlog.take() == b"".join(sent)
    assert not backlog


@pytest.mark.parametrize("order", [LITTLE, BIG])
def test_a_state_is_left_out_once_64_kb_wait_in_the_socket(order: ByteOrder) -> None:
    backlog = Backlog()
    backlog.add(state(order=order), order, 65_536)
    assert (bool(backlog), backlog.skipped) == (True, 0)
    backlog.take()
    backlog.add(state(order=order), order, 65_537)
    assert (bool(backlog), backlog.skipped) == (False, 1)


def test_what_was_not_handed_to_the_socket_yet_counts_with_it() -> None:
    backlog = Backlog()
    backlog.add(frame(7, 40_000), LITTLE, 20_000)
    backlog.add(frame(7, 6_000), LITTLE, 20_000)
    backlog.add(state(), LITTLE, 20_000)
    assert backlog.skipped == 1
    backlog.take()
    backlog.add(state(), LITTLE, STATES_WAIT_BELOW)
    assert backlog.skipped == 1


def test_any_other_frame_is_kept_to_the_bound_and_none_is_ever_missing() -> None:
    backlog = Backlog()
    backlog.add(frame(7, 60_000), LITTLE, MOST_WAITING - 60_000)
    with pytest.raises(TooSlow, match="1048576 bytes"):
        backlog.add(frame(7, 16), LITTLE, MOST_WAITING - 60_000)
    assert backlog.take() == frame(7, 60_000)
