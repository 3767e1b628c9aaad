import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rigs.data.case_table import every
from rigs.data.golden_vectors import FOLDER, GOLDEN, Golden, load
from rigs.data.message_samples import SAMPLES
from rigs.data.pcap_files import Conversation, pcap

from openpendant.simplemsg import (
    DIALECTS,
    ByteOrder,
    CommType,
    JointPosition,
    JointTrajPt,
    Message,
    Ping,
    Status,
    accepted,
    codec_for,
    refused,
)
from openpendant.simplemsg.motoman import MotomanGroup, MotomanJointTrajPtFullEx
from openpendant.simplemsg.pendant import JointMove, Outcome, SoftwareStop, Verdict
from openpendant.tools.packets.cli import main
from openpendant.tools.packets.reading.field_table import field_values
from openpendant.tools.packets.reading.reader import ALL, Reader, Reading
from openpendant.tools.packets.trace import (
    Entry,
    Event,
    Packet,
    TraceDirection,
    entry_line,
    header_line,
)

UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT
LITTLE, BIG = codec_for(ALL, ByteOrder.LITTLE), codec_for(ALL, ByteOrder.BIG)
CAPTURES = ("capture-industrial-robot-client", "capture-motoman-driver")
BROKEN_ON_PURPOSE = {"capture-industrial-robot-client": 6, "capture-motoman-driver": 0}
ZEROS = (0.0,) * 10

Lines = list[str]


class Tool:
    """Runs `openpendant packets` in this process."""

    def __init__(
        self, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, folder: Path
    ) -> None:
        self._capsys, self._monkeypatch = capsys, monkeypatch
        self._file = folder / "trace.jsonl"

    def run(self, *arguments: str, stdin: bytes = b"") -> tuple[int, Lines, Lines]:
        self._monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        status = main(list(arguments))
        captured = self._capsys.readouterr()
        return status, captured.out.splitlines(), captured.err.splitlines()

    def show(self, entries: list[Entry], *arguments: str) -> tuple[int, Lines, Lines]:
        lines = [header_line("2026-01-01T00:00:00+00:00"), *map(entry_line, entries)]
        self._file.write_text("\n".join(lines))
        return self.run("show", str(self._file), *arguments)

    def numbers(self, entries: list[Entry], *arguments: str) -> list[int]:
        status, lines, errors = self.show(entries, "--json", *arguments)
        assert (status, errors) == (0, [])
        objects = map(json.loads, lines)
        return [found["number"] for found in objects if found["dir"] != "event"]


@pytest.fixture
def tool(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Tool:
    return Tool(capsys, monkeypatch, tmp_path)


def packet(
    milliseconds: float, way: TraceDirection, message: Message, port: int = 11_000, **more: Any
) -> Packet:
    return Packet(round(milliseconds * 1e6), way, LITTLE.encode(message), port, **more)


def point(sequence: int) -> JointTrajPt:
    return JointTrajPt(sequence, (0.1 * sequence, *ZEROS[1:]), 0.1, 1.0)


def status(in_motion: int) -> Status:
    return Status(1, 0, 0, 0, in_motion, 2, 1)


MOTION: list[Entry] = [
    Event(0, "client-connected", 11_000, 1),
    packet(1, DOWN, JointPosition(0, ZEROS), 11_002),
    packet(2, UP, point(0)),
    packet(5, DOWN, accepted(point(0))),
    packet(10, DOWN, status(0), 11_002),
    packet(50, DOWN, JointPosition(0, (0.05, *ZEROS[1:])), 11_002),
    packet(51, DOWN, status(1), 11_002),
    packet(60, UP, Ping(), 11_002),
    packet(100, DOWN, status(0), 11_002),
    packet(150, DOWN, status(0), 11_002),
    packet(151, UP, point(1)),
    packet(151.5, DOWN, refused(point(1))),
]


@pytest.mark.parametrize("name", CAPTURES)
@pytest.mark.parametrize("command", ["decode", "show"])
def test_every_recorded_packet_decodes_but_those_broken_on_purpose(
    tool: Tool, name: str, command: str
) -> None:
    found, lines, errors = tool.run(command, str(FOLDER / f"{name}.json"), "--json")
    objects = [json.loads(line) for line in lines]
    faults = [item for item in objects if "fault" in item]
    assert (found, errors) == (1 if faults else 0, [])
    assert len(faults) == BROKEN_ON_PURPOSE[name]
    recorded = [item for item in load(name) if item["dir"] != "event"]
    packets = [item for item in objects if item["dir"] != "event"]
    assert [item["t"] for item in packets] == [item["t"] for item in recorded]
    assert "unknown" not in {item.get("name") for item in packets if item.get("msg_type") != 999}


@pytest.mark.parametrize("form", ["line", "tree"])
@pytest.mark.parametrize("name", CAPTURES)
def test_people_see_every_recorded_packet_too(tool: Tool, name: str, form: str) -> None:
    arguments = ["show", str(FOLDER / f"{name}.json"), "--format", form]
    _, lines, errors = tool.run(*arguments)
    assert errors == []
    assert sum("MALFORMED" in line for line in lines) == BROKEN_ON_PURPOSE[name]
    assert "== " + load(name)[0]["scenario"] == lines[0]


@pytest.mark.parametrize("form", ["line", "tree"])
def test_golden_packets_have_a_form_for_people(tool: Tool, form: str) -> None:
    def check(golden: Golden) -> None:
        order = "little" if golden.byte_order is ByteOrder.LITTLE else "big"
        wire = ["--order", order, "--real", str(golden.real_size), "--dialect", "all"]
        digits = golden.entry["hex"].encode()
        found, lines, errors = tool.run("decode", "--format", form, *wire, stdin=digits)
        assert (found, errors) == (0, [])
        assert (len(lines) == 1) == (form == "line")

    every([(golden.id, golden) for golden in GOLDEN[::7]], check)


@pytest.mark.parametrize("real_size", [4, 8])
def test_the_offsets_of_fields_cover_the_frame(real_size: int) -> None:
    samples = [(cls.__name__, (sample, real_size)) for cls, sample in SAMPLES.items()]
    every(samples, _offsets_cover_the_frame)


def _offsets_cover_the_frame(case: tuple[Message, int]) -> None:
    sample, real_size = case
    codec = codec_for(ALL, ByteOrder.LITTLE, real_size)
    frame = codec.encode(sample)
    fields = field_values(codec.decode(frame), codec)
    offsets = [field.offset for field in fields]
    assert offsets == sorted(set(offsets))
    assert offsets[:1] in ([], [16])
    if fields and isinstance(fields[0].value, int):
        assert int.from_bytes(frame[16:20], "little", signed=True) == fields[0].value


def test_a_tree_has_offset_unit_and_name_of_each_value(tool: Tool) -> None:
    digits = LITTLE.encode(point(-4)).hex().encode()
    _, lines, _ = tool.run("decode", "--format", "tree", stdin=digits)
    assert lines[1:] == [
        "     0  length           64  [byte]",
        "     4  msg_type         11  joint_traj_pt",
        "     8  comm_type        2  request",
        "    12  reply_code       0  unused",
        "    16  sequence         -4  STOP",
        "    20  joints           -0.400000006 0 0 0 0 0 0 0 0 0  [rad, m for a linear axis]",
        "    60  velocity         0.100000001",
        "    64  duration         1  [s]",
    ]


def test_a_line_has_time_direction_name_and_latency(tool: Tool) -> None:
    _, lines, _ = tool.show(MOTION[2:4])
    assert lines == [
        "     1    0.002000 -> 11000/1   joint_traj_pt request sequence=0 joints=[] velocity=0.1"
        " duration=1",
        "     2    0.005000 <- 11000/1   joint_traj_pt reply success (answers 1 after 3.000 ms)",
    ]


def test_hexadecimal_lines_are_little_endian_and_standard_unless_told(tool: Tool) -> None:
    verdict = LITTLE.encode(Verdict(1, 0, -1, 0.0, 0.0, "taken"))
    found, (line,), _ = tool.run("decode", stdin=verdict.hex().encode())
    assert (found, json.loads(line)["name"]) == (0, "unknown")
    found, (line,), _ = tool.run("decode", "--dialect", "all", stdin=verdict.hex().encode())
    assert (found, json.loads(line)["name"]) == (0, "verdict")


def test_no_two_messages_of_any_dialect_have_the_same_number() -> None:
    places = {(cls.PLACE.msg_type, cls.PLACE.is_reply) for cls in ALL.messages}
    assert len(places) == len(ALL.messages)
    assert set(ALL.messages) == {cls for each in DIALECTS.values() for cls in each.messages}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--type", "status"], [4, 6, 8, 9]),
        (["--type", "1", "--type", "joint_position"], [1, 5, 7]),
        (["--comm", "request"], [2, 7, 10]),
        (["--comm", "reply"], [3, 11]),
        (["--port", "11002", "--direction", "to-server"], [7]),
        (["--direction", "to-server"], [2, 7, 10]),
        (["--conn", "2"], []),
        (["--scenario", "nowhere"], []),
        (["--since", "0.06", "--until", "0.15"], [7, 8, 9]),
        (["--malformed"], []),
        (["--field", "in_motion=TRUE"], [6]),
        (["--field", "in_motion=1"], [6]),
        (["--field", "in_motion!=true"], [4, 8, 9]),
        (["--field", "sequence>=1"], [10]),
        (["--field", "joints>0"], [5, 10]),
        (["--field", "joints[0]<0.06", "--type", "10"], [1, 5]),
        (["--field", "joints[77]<0.06"], []),
        (["--max-packets", "2"], [1, 2]),
        (["--type", "status", "--max-packets", "2"], [4, 6]),
        (["--follow", "2"], [2, 3, 4, 5, 6, 8]),
        (["--follow", "10"], [10, 11]),
    ],
)
def test_what_is_shown_can_be_chosen(tool: Tool, arguments: list[str], expected: list[int]) -> None:
    assert tool.numbers(MOTION, *arguments) == expected


def test_conditions_on_packets_leave_no_event(tool: Tool) -> None:
    assert sum("client-connected" in line for line in tool.show(MOTION)[1]) == 1
    assert sum("*" in line for line in tool.show(MOTION, "--comm", "topic")[1]) == 0


def test_the_fields_of_repeated_records_can_be_compared(tool: Tool) -> None:
    groups = tuple(MotomanGroup(number, 7, 0.5, ZEROS, ZEROS, ZEROS) for number in range(2))
    entries: list[Entry] = [packet(1, UP, MotomanJointTrajPtFullEx(2, 5, groups))]
    assert tool.numbers(entries, "--field", "groups.robot_id=1") == [1]
    assert tool.numbers(entries, "--field", "groups[1].robot_id=1") == [1]
    assert tool.numbers(entries, "--field", "groups[0].robot_id=1") == []


def test_a_pendants_motion_is_followed_to_its_outcome(tool: Tool) -> None:
    move = JointMove(7, 0.5, 6, ZEROS)
    end = Outcome(7, 1, 0, -1, 0.0, 0.0, 0.1, 1.0, "")
    other = Outcome(6, 1, 0, -1, 0.0, 0.0, 0.1, 1.0, "")
    taken = Verdict(7, 0, -1, 0.0, 0.0, "")
    entries: list[Entry] = [
        packet(1, UP, move, 11_010),
        packet(2, DOWN, taken, 11_010),
        packet(3, DOWN, end, 11_010, connection=2),
        packet(4, DOWN, other, 11_010),
        packet(5, DOWN, end, 11_010),
        packet(6, DOWN, end, 11_010),
    ]
    assert tool.numbers(entries, "--follow", "1") == [1, 2, 5]


def test_any_other_request_is_followed_to_its_reply(tool: Tool) -> None:
    taken = Verdict(8, 0, -1, 0.0, 0.0, "")
    entries: list[Entry] = [
        packet(1, UP, SoftwareStop(8, "test"), 11_010),
        packet(2, DOWN, status(0), 11_010),
        packet(3, DOWN, taken, 11_010),
        packet(4, DOWN, status(0), 11_010),
    ]
    assert tool.numbers(entries, "--follow", "1") == [1, 3]


@pytest.mark.parametrize(
    ("number", "found", "reason"),
    [
        (7, 1, "request 7 has no reply in this trace"),
        (3, 2, "packet 3 is no request; it answers request 2"),
        (4, 2, "packet 4 is no request"),
        (99, 2, "no packet 99: the trace has 11"),
        (-1, 2, "no packet -1: the trace has 11"),
    ],
)
def test_what_cannot_be_followed_is_told(tool: Tool, number: int, found: int, reason: str) -> None:
    assert tool.show(MOTION, "--follow", str(number))[::2] == (found, [reason])


def test_a_table_counts_types_by_direction(tool: Tool) -> None:
    _, lines, _ = tool.show(MOTION, "--count")
    assert lines[0].split() == [
        "direction", "type", "name", "comm", "count", "malformed", "rate/s", "first", "last",
        "bytes", "latency/ms",
    ]  # fmt: skip
    rows = {tuple(line.split()[:4]): line.split()[4:] for line in lines[1:]}
    assert rows["to-client", "13", "status", "topic"] == [
        "4", "0", "21.4", "0.010", "0.150", "176",
    ]  # fmt: skip
    assert rows["to-client", "11", "joint_traj_pt", "reply"][-1] == "1.750"
    _, lines, _ = tool.show(MOTION, "--count", "--json")
    assert sum(json.loads(line)["count"] for line in lines) == 11


def read_all(entries: list[Entry]) -> list[Reading]:
    reader = Reader(ALL, None, 4)
    return [item for entry in entries if isinstance(item := reader.read(entry), Reading)]


def test_replies_answer_requests_in_order_and_topics_never() -> None:
    readings = read_all(
        [
            packet(1, UP, point(0)),
            packet(2, UP, point(1)),
            packet(3, DOWN, status(0)),
            packet(4, DOWN, accepted(point(0))),
            packet(5, DOWN, Ping()),
            packet(6, DOWN, accepted(point(1))),
            packet(7, DOWN, accepted(point(1))),
            packet(8, UP, accepted(Ping())),
        ]
    )
    answers = [reading.answers for reading in readings]
    assert answers == [None, None, None, 1, None, 2, None, 5]
    assert [reading.latency for reading in readings if reading.latency] == [3e6, 4e6, 3e6]


def test_a_new_connection_owes_nothing_to_the_one_before() -> None:
    again = Event(0, "client-connected", 11_000, 1)
    entries: list[Entry] = [packet(1, UP, point(0)), again, packet(2, DOWN, accepted(point(0)))]
    assert read_all(entries)[-1].answers is None


def test_each_connection_has_a_byte_order_that_it_keeps() -> None:
    big = BIG.encode(Ping())
    readings = read_all(
        [
            packet(1, UP, Ping()),
            Packet(2, UP, big, 11_000, 2),
            Packet(3, UP, big, 11_000, 1),
            packet(4, UP, Ping()),
        ]
    )
    assert [reading.fault for reading in readings] == [
        "",
        "",
        "in big-endian, the connection is little-endian",
        "",
    ]
    assert readings[1].message == Ping(comm_type=CommType.REQUEST)


def test_a_byte_order_that_is_told_is_not_detected(tool: Tool) -> None:
    found, (line,), _ = tool.show([packet(1, UP, Ping())], "--order", "big")
    assert found == 1
    assert "MALFORMED" in line


def test_texts_of_a_peer_do_not_steer_the_terminal(tool: Tool) -> None:
    entries: list[Entry] = [
        Event(0, "\x1b[2J\x07", 1, 1, "\x1b[31m"),
        packet(1, UP, SoftwareStop(1, "\x1b[2J\n\u202e"), scenario="\x1b[31m"),
    ]
    for form in ("line", "tree"):
        _, lines, _ = tool.show(entries, "--format", form)
        text = "".join(lines)
        assert text.isprintable()
        assert r"\x1b[2J\n\u202e" in text


def test_colour_is_asked_for_or_for_a_terminal(tool: Tool, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "\x1b[" in "".join(tool.show(MOTION, "--color", "always")[1])
    assert "\x1b[" not in "".join(tool.show(MOTION)[1])
    monkeypatch.setattr(type(sys.stdout), "isatty", lambda _: True)
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert "\x1b[" in "".join(tool.show(MOTION)[1])
    assert "\x1b[" not in "".join(tool.show(MOTION, "--color", "never")[1])
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[" not in "".join(tool.show(MOTION)[1])


def test_a_terminal_gets_lines_and_a_pipe_json(tool: Tool, monkeypatch: pytest.MonkeyPatch) -> None:
    digits = LITTLE.encode(Ping()).hex().encode()
    assert json.loads(tool.run("decode", stdin=digits)[1][0])["name"] == "ping"
    monkeypatch.setattr(type(sys.stdout), "isatty", lambda _: True)
    assert tool.run("decode", "--color", "never", stdin=digits)[1] == ["ping request"]
    assert json.loads(tool.run("decode", "--json", stdin=digits)[1][0])["name"] == "ping"


def test_a_file_that_breaks_off_is_shown_up_to_there(tool: Tool, tmp_path: Path) -> None:
    link = Conversation()
    frames = [*link.opened(), *link.asked(LITTLE.encode(Ping()), LITTLE.encode(accepted(Ping())))]
    file = tmp_path / "cut.pcap"
    file.write_bytes(pcap(frames)[:-1])
    for command in ("decode", "show"):
        found, lines, errors = tool.run(command, str(file))
        assert (found, len(lines)) == (2, 2)
        assert errors == [
            f"{file}: offset 423: the file ends inside a record: 69 of 70 bytes",
        ]
    found, lines, errors = tool.run("show", str(file), "--count")
    assert (found, len(lines), len(errors)) == (2, 2, 1)


@pytest.mark.parametrize("command", ["decode", "show"])
@pytest.mark.parametrize(
    ("content", "found", "reason"),
    [
        (b"[1]", 2, "entry 1: an entry is a JSON object"),
        (b'{"format": 1}', 2, "line 1: the file ends here: the format is 1, not"),
        (b"\xd4\xc3\xb2\xa1", 2, "offset 4: the file ends inside the file header"),
    ],
)
def test_a_file_that_is_no_trace_is_one_line(
    tool: Tool, command: str, content: bytes, found: int, reason: str
) -> None:
    code, lines, (error,) = tool.run(command, "-", stdin=content)
    assert (code, lines) == (found, [])
    assert error.startswith("standard input: " + reason)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"hello", b"0c00"])
def test_what_decode_takes_for_digits_is_no_trace_for_show(tool: Tool, content: bytes) -> None:
    code, lines, errors = tool.run("show", "-", stdin=content)
    assert (code, lines, len(errors)) == (2, [], 1)


@pytest.mark.parametrize("command", ["decode", "show"])
def test_a_directory_and_a_missing_file_are_one_line(
    tool: Tool, command: str, tmp_path: Path
) -> None:
    assert tool.run(command, str(tmp_path)) == (2, [], [f"{tmp_path}: Is a directory"])
    missing = str(tmp_path / "nowhere")
    assert tool.run(command, missing) == (2, [], [f"{missing}: No such file or directory"])


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["-", "--type", "no_such_message"],
        ["-", "--comm", "gossip"],
        ["-", "--since", "nan"],
        ["-", "--since", "soon"],
        ["-", "--field", "nothing"],
        ["-", "--field", "name>text"],
        ["-", "--count", "--follow", "1"],
        ["-", "--max-packets", "-3"],
        ["-", "--input", "hex"],
        ["-", "--follow", "x"],
    ],
)
def test_wrong_arguments_of_show_are_a_usage_error(tool: Tool, arguments: list[str]) -> None:
    found, lines, errors = tool.run("show", *arguments)
    assert (found, lines) == (2, [])
    assert errors[0].startswith("usage: openpendant packets show")


def test_show_ends_quietly_when_nobody_reads() -> None:
    name = str(FOLDER / "capture-motoman-driver.json")
    command = [sys.executable, "-m", "openpendant.tools.packets.cli", "show", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(20) == 1
