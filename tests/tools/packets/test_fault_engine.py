"""Faults on the pure engine: which frames a rule fits, and what then comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.peers.loopback_peers import PING, PONG

from openpendant import simplemsg as wire
from openpendant.simplemsg.motoman import MotomanMotionReply
from openpendant.tools.packets.faulty.fault_engine import FaultDone, FaultEngine
from openpendant.tools.packets.faulty.fault_script import RULE_CLASSES, load_script, make_script
from openpendant.tools.packets.live.relay import (
    Action,
    CloseBoth,
    Freeze,
    ProxyLinkId,
    ResetBoth,
    SendBytes,
)
from openpendant.tools.packets.trace import TraceDirection

MS = 1_000_000
LINK = ProxyLinkId(1, 11000, 1)
UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT
ZEROS = (0.0,) * 10
EXAMPLES = Path(__file__).parents[3] / "examples" / "faults"


def point(sequence: int, codec: wire.Codec | None = None) -> bytes:
    return (codec or wire.codec_for()).encode(wire.JointTrajPt(sequence, ZEROS, 0.1, 1.0))


def full_point(sequence: int) -> bytes:
    return wire.codec_for().encode(wire.JointTrajPtFull(0, sequence, 7, 0.5, ZEROS, ZEROS, ZEROS))


def taken(sequence: int) -> bytes:
    return wire.codec_for().encode(wire.HeaderOnly(11, reply_code=wire.ReplyCode.SUCCESS))


@dataclass
class Bench:
    """An engine, its clock in milliseconds, and what came out: (ms, direction, bytes)."""

    rules: list[dict[str, Any]]
    options: dict[str, Any] = field(default_factory=dict)
    seed: int | None = None

    def __post_init__(self) -> None:
        script = make_script({"rule": self.rules, **self.options}, "test")
        self.done: list[FaultDone] = []
        self.engine = FaultEngine(script, self.seed, self.done.append)
        self.engine.opened(LINK, 0)
        self.now = 0.0
        self.sent: list[tuple[float, TraceDirection, bytes]] = []
        self.others: list[Action] = []

    def feed(self, direction: TraceDirection, *frames: bytes, link: ProxyLinkId = LINK) -> Bench:
        for frame in frames:
            self.note(self.engine.take(direction, link, frame, round(self.now * MS)))
        return self

    def wait(self, ms: float) -> Bench:
        until = self.now + ms
        while (due := self.engine.next_due()) is not None and due <= until * MS:
            self.now = due / MS
            self.note(self.engine.due(due))
        self.now = until
        return self

    def note(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, SendBytes):
                self.sent.append((round(self.now, 3), action.direction, action.data))
            else:
                self.others.append(action)

    def came(self, direction: TraceDirection) -> list[bytes]:
        return [data for _, way, data in self.sent if way is direction]

    def times(self, direction: TraceDirection) -> list[float]:
        return [time for time, way, _ in self.sent if way is direction]


def bench(fault: str, match: dict[str, Any] | None = None, **parameters: Any) -> Bench:
    options: dict[str, Any] = {}
    if "dialect" in parameters:
        options["dialect"] = parameters.pop("dialect")
    return Bench([{"fault": fault, "match": match or {}, **parameters}], options)


def test_what_no_rule_fits_passes_at_once() -> None:
    run = bench("drop", {"type": 13}).feed(UP, PING, point(0)).feed(DOWN, PONG)
    assert run.sent == [(0, UP, PING), (0, UP, point(0)), (0, DOWN, PONG)]
    assert run.done == []


def test_a_delayed_frame_holds_up_what_follows_it() -> None:
    run = bench("delay", {"nth": 1}, ms=20).feed(UP, point(0)).wait(5).feed(UP, point(1)).wait(50)
    assert run.sent == [(20, UP, point(0)), (20, UP, point(1))]


def test_a_delay_does_not_hold_up_the_other_direction() -> None:
    assert bench("delay", {"nth": 1}, ms=20).feed(UP, PING).feed(DOWN, PONG).sent == [
        (0, DOWN, PONG)
    ]


def test_jitter_stays_in_its_bounds() -> None:
    run = bench("delay", ms=10, jitter_ms=5)
    for _ in range(50):
        run.feed(UP, PING).wait(100)
    waits = [time - 100 * index for index, time in enumerate(run.times(UP))]
    assert all(10 <= wait <= 15 for wait in waits)
    assert len(set(waits)) > 40


def test_a_frame_is_split_at_an_offset() -> None:
    run = bench("split", at=[4, 16, 999], gap_ms=2).feed(UP, point(0)).wait(20)
    assert run.times(UP) == [0, 2, 4]
    assert run.came(UP) == [point(0)[:4], point(0)[4:16], point(0)[16:]]


def test_each_byte_is_sent_alone_and_the_next_frame_waits() -> None:
    run = bench("split", {"nth": 1}, size=1, gap_ms=1).feed(UP, PING, point(0)).wait(100)
    assert run.came(UP) == [*(bytes([byte]) for byte in PING), point(0)]
    assert run.times(UP) == [*range(16), 15]


def test_coalesced_frames_come_as_one_piece() -> None:
    run = bench("coalesce", {"type": 1}, frames=3, within_ms=50).feed(UP, PING, point(0), PING)
    assert run.came(UP) == [PING + point(0) + PING]


def test_what_is_coalesced_does_not_wait_for_ever() -> None:
    run = bench("coalesce", frames=3, within_ms=50).feed(UP, PING, PING).wait(100)
    assert run.sent == [(50, UP, PING + PING)]


def test_a_dropped_frame_is_gone() -> None:
    run = bench("drop", {"nth": 2}).feed(UP, point(0), point(1), point(2))
    assert run.came(UP) == [point(0), point(2)]


def test_a_duplicate_follows_its_original() -> None:
    run = bench("duplicate", {"nth": 1}, copies=2).feed(UP, point(0), point(1))
    assert run.came(UP) == [point(0)] * 3 + [point(1)]


def test_flipped_bits_are_as_many_as_asked() -> None:
    run = bench("corrupt", how="bits", bits=3, offset=20).feed(UP, point(0))
    (changed,) = run.came(UP)
    differing = [at for at in range(len(changed)) if changed[at] != point(0)[at]]
    assert differing == [20]
    assert (changed[20] ^ point(0)[20]).bit_count() == 3


@pytest.mark.parametrize(("by", "length"), [(4, 68), (-60, 4), (-65_535, -65_471)])
def test_a_length_field_lies(by: int, length: int) -> None:
    (changed,) = bench("corrupt", how="length", by=by).feed(UP, point(0)).came(UP)
    assert int.from_bytes(changed[:4], "little", signed=True) == length
    assert changed[4:] == point(0)[4:]


def test_a_truncated_body_stays_in_step() -> None:
    (changed,) = bench("corrupt", how="truncate", by=8).feed(UP, point(0)).came(UP)
    assert len(changed) == len(point(0)) - 8
    assert int.from_bytes(changed[:4], "little") == len(changed) - 4


def test_valid_fields_get_garbage_above_the_four_bits_that_are_meant() -> None:
    (changed,) = bench("corrupt", how="valid_fields").feed(UP, full_point(0)).came(UP)
    message = wire.codec_for().decode(changed)
    assert isinstance(message, wire.JointTrajPtFull)
    assert message.valid_fields & 15 == 7
    assert message.valid_fields not in (7, -9)
    assert changed[:24] + changed[28:] == full_point(0)[:24] + full_point(0)[28:]


def test_a_frame_without_valid_fields_passes_and_is_logged() -> None:
    run = bench("corrupt", how="valid_fields").feed(UP, PING)
    assert run.came(UP) == [PING]
    assert run.done[0].detail == "forwarded as it was: it has no valid_fields"


@pytest.mark.parametrize(
    ("fault", "action"), [("reset", ResetBoth), ("close", CloseBoth), ("half_open", Freeze)]
)
@pytest.mark.parametrize("forward", [False, True])
def test_an_ending_comes_with_or_without_the_frame(
    fault: str, action: type[ResetBoth | CloseBoth | Freeze], forward: bool
) -> None:
    run = bench(fault, forward=forward).feed(UP, point(0), point(1)).feed(DOWN, PONG)
    assert run.came(UP) == ([point(0)] if forward else [])
    assert run.others == [action(LINK)]
    assert run.came(DOWN) == []


def test_only_the_reply_to_the_request_is_lost() -> None:
    run = bench("lost_reply", {"direction": "to_server", "nth": 2})
    for sequence in range(3):
        run.feed(UP, point(sequence)).feed(DOWN, taken(sequence))
    assert run.came(UP) == [point(0), point(1), point(2)]
    assert run.came(DOWN) == [taken(0), taken(2)]
    assert [(done.frame, done.detail) for done in run.done] == [(taken(1), "the reply is lost")]


def test_topics_in_between_do_not_take_the_place_of_a_reply() -> None:
    status = bytes.fromhex("28000000 0d000000 01000000 00000000") + bytes(28)
    run = bench("lost_reply", {"direction": "to_server"}).feed(UP, PING)
    run.feed(DOWN, status, PONG)
    assert run.came(DOWN) == [status]


def test_a_refused_request_is_answered_and_not_forwarded() -> None:
    run = bench("refuse", {"type": "joint_traj_pt"}).feed(UP, point(0))
    assert run.came(UP) == []
    (reply,) = run.came(DOWN)
    assert wire.codec_for().decode(reply) == wire.HeaderOnly(11, reply_code=wire.ReplyCode.FAILURE)


def test_a_refusal_waits_for_the_replies_before_it() -> None:
    run = bench("refuse", {"sequence": 1}).feed(UP, point(0), point(1))
    assert run.came(DOWN) == []
    run.feed(DOWN, taken(0))
    assert [wire.codec_for().decode(reply).reply_code for reply in run.came(DOWN)] == [1, 2]


def test_a_refusal_has_the_byte_order_of_the_request() -> None:
    big = wire.codec_for(byte_order=wire.ByteOrder.BIG)
    (reply,) = bench("refuse").feed(UP, point(0, big)).came(DOWN)
    assert big.decode(reply).reply_code == wire.ReplyCode.FAILURE


def _motion_reply(run: Bench) -> MotomanMotionReply:
    message: wire.Message = wire.codec_for(wire.MOTOMAN).decode(run.came(DOWN)[0])
    assert isinstance(message, MotomanMotionReply)
    return message


@pytest.mark.parametrize(("fault", "result"), [("busy", 1), ("refuse", 2)])
def test_a_motoman_says_so_in_the_body(fault: str, result: int) -> None:
    run = bench(fault, dialect="motoman").feed(UP, full_point(5))
    assert run.came(UP) == []
    reply = _motion_reply(run)
    assert (reply.result, reply.sequence, reply.command) == (result, 5, 14)
    assert reply.reply_code == wire.ReplyCode.SUCCESS


def test_without_a_busy_answer_the_reply_is_withheld() -> None:
    run = bench("busy", {"direction": "to_server"}, ms=300).feed(UP, point(0))
    run.wait(10).feed(DOWN, taken(0)).wait(1000)
    assert run.sent == [(0, UP, point(0)), (310, DOWN, taken(0))]


def test_the_other_byte_order_says_the_same() -> None:
    (changed,) = bench("wrong_byte_order").feed(UP, full_point(3)).came(UP)
    assert wire.codec_for(byte_order=wire.ByteOrder.BIG).decode(changed) == wire.codec_for().decode(
        full_point(3)
    )


def test_unknown_words_are_turned_round_one_by_one() -> None:
    frame = bytes.fromhex("12000000 e7030000 02000000 00000000 01020304 0506")
    (changed,) = bench("wrong_byte_order").feed(UP, frame).came(UP)
    assert changed == bytes.fromhex("00000012 000003e7 00000002 00000000 04030201 0506")


def test_a_slow_line_takes_its_time() -> None:
    run = bench("throttle", bytes_per_s=1000).feed(UP, point(0), point(1)).wait(1000)
    assert b"".join(run.came(UP)) == point(0) + point(1)
    assert run.times(UP)[-1] == pytest.approx(2 * len(point(0)), abs=11)


def test_a_frame_is_overtaken() -> None:
    run = bench("reorder", {"sequence": 0}, overtaken_by=2)
    run.feed(UP, *map(point, range(4)))
    assert run.came(UP) == [point(1), point(2), point(0), point(3)]


def test_a_frame_that_nothing_overtakes_is_sent_in_the_end() -> None:
    assert bench("reorder", within_ms=30).feed(UP, point(0)).wait(100).sent == [(30, UP, point(0))]


def test_a_frame_is_never_put_inside_another_one() -> None:
    rules = [
        {"fault": "reorder", "match": {"sequence": 0}, "overtaken_by": 2},
        {"fault": "split", "match": {"sequence": 1}, "at": [4, 8, 12], "gap_ms": 0},
    ]
    run = Bench(rules).feed(UP, *map(point, range(3)))
    assert b"".join(run.came(UP)) == point(1) + point(2) + point(0)


def test_the_first_rule_that_fits_is_the_only_one() -> None:
    run = Bench([{"fault": "drop", "match": {"nth": 1}}, {"fault": "duplicate"}])
    run.feed(UP, point(0), point(1))
    assert run.came(UP) == [point(1), point(1)]


def test_an_end_comes_behind_everything_that_waits() -> None:
    rules = [
        {"fault": "coalesce", "frames": 9, "match": {"sequence": 0}},
        {"fault": "delay", "ms": 30, "match": {"sequence": 1}},
    ]
    run = Bench(rules).feed(UP, point(0), point(1))
    run.note(run.engine.end(UP, LINK, 0))
    run.wait(100)
    assert b"".join(run.came(UP)) == point(0) + point(1)
    assert len(run.others) == 1


def test_stray_bytes_stay_behind_delayed_frames() -> None:
    run = bench("delay", ms=20).feed(UP, PING)
    run.note(run.engine.pass_on(UP, LINK, b"stray", 0))
    assert run.wait(30).came(UP) == [PING, b"stray"]


def test_a_connection_that_is_gone_owes_nothing() -> None:
    run = bench("delay", ms=20).feed(UP, PING)
    run.engine.forget(LINK)
    assert run.wait(100).sent == []
    assert run.engine.next_due() is None
    assert run.engine.held(LINK, UP) == 0


def test_every_fault_is_tried_above() -> None:
    text = Path(__file__).read_text("utf-8")
    assert [name for name in RULE_CLASSES if f'"{name}"' not in text] == []


RULES = [
    {"fault": "delay", "ms": 3, "jitter_ms": 4},
    {"fault": "split", "size": 7, "gap_ms": 0.3},
    {"fault": "coalesce", "frames": 4, "within_ms": 5},
    {"fault": "throttle", "bytes_per_s": 20_000},
    {"fault": "busy", "ms": 4},
]


@given(
    st.lists(st.sampled_from(RULES), min_size=1, max_size=4),
    st.lists(st.tuples(st.sampled_from([UP, DOWN]), st.integers(0, 9), st.booleans()), max_size=40),
)
def test_faults_of_time_alone_lose_and_change_nothing(
    rules: list[dict[str, Any]], frames: list[tuple[TraceDirection, int, bool]]
) -> None:
    run = Bench([{**rule, "match": {"probability": 0.5}} for rule in rules])
    expected: dict[TraceDirection, bytes] = {UP: b"", DOWN: b""}
    for direction, sequence, waits in frames:
        frame = point(sequence) if direction is UP else taken(sequence)
        expected[direction] += frame
        run.feed(direction, frame).wait(2 if waits else 0)
    run.wait(10_000)
    assert {way: b"".join(run.came(way)) for way in (UP, DOWN)} == expected
    assert run.engine.held(LINK, UP) == run.engine.held(LINK, DOWN) == 0


@given(st.sampled_from(list(RULE_CLASSES)), st.binary(min_size=12, max_size=200))
def test_no_frame_is_too_strange_for_a_fault(fault: str, rest: bytes) -> None:
    needed: dict[str, Any] = {
        "delay": {"ms": 1},
        "split": {"size": 3},
        "coalesce": {"frames": 2},
        "corrupt": {"how": "valid_fields"},
        "throttle": {"bytes_per_s": 1e4},
    }
    frame = len(rest).to_bytes(4, "little") + rest
    run = bench(fault, dialect="motoman", **needed.get(fault, {}))
    run.feed(UP, frame, frame).feed(DOWN, frame).wait(10_000)
    assert run.done or fault in ("lost_reply", "busy")  # they are done to a reply


# Which frames a rule fits, and that chance repeats.


MATCHES: dict[str, tuple[dict[str, Any], set[int]]] = {
    "nothing in particular": ({}, {0, 1, 2, 3, 4, 5}),
    "a direction": ({"direction": "to_client"}, {1, 4}),
    "a type by number": ({"type": 11}, {0, 1, 2, 3, 5}),
    "a type by name": ({"type": "ping"}, {4}),
    "a kind of exchange": ({"comm": "reply"}, {1, 4}),
    "a reply code": ({"reply_code": 1}, {1, 4}),
    "a sequence": ({"sequence": 2}, {3}),
    "the n-th": ({"type": 11, "nth": 3}, {2}),
    "every n-th": ({"direction": "to_server", "every": 2}, {2, 5}),
    "at most so often": ({"times": 2}, {0, 1}),
    "from a time on": ({"after_s": 0.03}, {3, 4, 5}),
    "until a time": ({"before_s": 0.03}, {0, 1, 2}),
    "another connection": ({"connection": 2}, set()),
    "another pair": ({"pair": 2}, set()),
}


@pytest.mark.parametrize("case", MATCHES)
def test_a_rule_fits_what_it_says(case: str) -> None:
    match, fitting = MATCHES[case]
    frames = [
        (UP, point(0)),
        (DOWN, taken(0)),
        (UP, point(1)),
        (UP, point(2)),
        (DOWN, PONG),
        (UP, point(-4)),
    ]
    run = bench("drop", match)
    dropped = set()
    for index, (direction, frame) in enumerate(frames):
        before = len(run.sent)
        run.feed(direction, frame)
        if len(run.sent) == before:
            dropped.add(index)
        run.wait(10)
    assert dropped == fitting


def test_a_share_of_the_frames_is_about_that_share() -> None:
    run = bench("drop", {"probability": 0.2}).feed(UP, *[PING] * 2000)
    assert len(run.done) == pytest.approx(400, abs=80)


def _noise(seed: int | None) -> tuple[Any, ...]:
    script = load_script(EXAMPLES / "noisy.toml")
    run = Bench([])
    run.engine = FaultEngine(script, seed, run.done.append)
    run.engine.opened(LINK, 0)
    for sequence in range(2000):
        run.feed(UP, point(sequence)).feed(DOWN, taken(sequence)).wait(1)
    return run.sent, run.others, run.done


def test_the_same_seed_and_input_give_the_same_output() -> None:
    assert _noise(7) == _noise(7)
    assert _noise(None) == _noise(1)
    assert _noise(7)[2] != _noise(8)[2]
