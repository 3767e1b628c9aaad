"""The recording relay without sockets: whatever comes goes on, and is written down once."""

from hypothesis import given
from hypothesis import strategies as st
from rigs.peers.loopback_peers import PING, PONG

from openpendant.tools.packets.live.relay import ProxyLinkId, RecordingRelay, ResetBoth, SendBytes
from openpendant.tools.packets.trace import Entry, Event, Packet, TraceDirection

LINK = ProxyLinkId(1, 11000, 1)
UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT

chunks = st.lists(
    st.tuples(
        st.sampled_from(TraceDirection), st.binary(max_size=50) | st.sampled_from([PING, PONG])
    ),
    max_size=30,
)


def _relay() -> tuple[RecordingRelay, list[Entry]]:
    entries: list[Entry] = []
    relay = RecordingRelay(entries.append, 0)
    relay.opened(LINK, 0)
    return relay, entries


@given(chunks)
def test_every_portion_goes_on_at_once_as_it_came(
    portions: list[tuple[TraceDirection, bytes]],
) -> None:
    relay, entries = _relay()
    for now, (direction, data) in enumerate(portions):
        assert list(relay.received(LINK, direction, data, now)) == [
            SendBytes(LINK, direction, data)
        ]
        assert relay.held(LINK, direction) == 0
    relay.finish(len(portions))
    for direction in TraceDirection:
        recorded = [
            entry.data
            for entry in entries
            if isinstance(entry, Packet) and entry.direction is direction
        ]
        assert b"".join(recorded) == b"".join(data for way, data in portions if way is direction)


def test_bytes_are_sent_before_they_are_written_down() -> None:
    relay, entries = _relay()
    actions = iter(relay.received(LINK, UP, PING, 5))
    assert next(actions) == SendBytes(LINK, UP, PING)
    assert not any(isinstance(entry, Packet) for entry in entries)
    assert list(actions) == []
    assert entries[-1] == Packet(5, UP, PING, 11000)


def test_a_stream_out_of_step_is_noted_once() -> None:
    relay, entries = _relay()
    for _ in range(3):
        list(relay.received(LINK, DOWN, bytes(8), 0))
    notes = [entry.text for entry in entries if isinstance(entry, Event)]
    assert notes == ["client-connected", "out-of-step server"]


def test_a_reset_passes_on_and_leaves_no_half_frame_behind() -> None:
    relay, entries = _relay()
    list(relay.received(LINK, UP, PING[:7], 0))
    assert relay.reset(LINK, DOWN, 1) == [ResetBoth(LINK)]
    relay.closed(LINK, 2)
    assert [entry.data for entry in entries if isinstance(entry, Packet)] == [PING[:7]]
