"""`openpendant packets`: packets to JSON and back, the dissector, and what a user is told."""

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rigs.data.golden_vectors import FILES, GOLDEN, exact

from openpendant.tools.packets import decode, record, rerun, show
from openpendant.tools.packets.cli import main
from openpendant.tools.packets.console import MAX_LINE
from openpendant.tools.reference.dissector import lua_dissector

PING = "0c000000010000000200000000000000"
PING_PACKET = {"msg_type": 1, "comm_type": 2, "reply_code": 0, "name": "ping", "fields": {}}


class Terminal:
    """Runs the command in this process, with given standard input."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys

    def run(
        self, arguments: list[str], stdin: str | bytes = b""
    ) -> tuple[int, list[str], list[str]]:
        raw = stdin.encode() if isinstance(stdin, str) else stdin
        self._monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(raw)))
        status = main(arguments)
        captured = self._capsys.readouterr()
        return status, captured.out.splitlines(), captured.err.splitlines()


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Terminal:
    return Terminal(monkeypatch, capsys)


def _options(file: str) -> list[str]:
    order = "little" if "-le-" in file else "big"
    dialect = "standard" if file.startswith("standard") else "motoman"
    real = "4" if file.endswith("f32") else "8"
    return ["--order", order, "--real", real, "--dialect", dialect]


def _strict(line: str) -> Any:
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(line, parse_constant=refuse)


@pytest.mark.parametrize("file", FILES)
def test_golden_packets_go_to_json_and_back(terminal: Terminal, file: str) -> None:
    golden = [packet for packet in GOLDEN if packet.file == file]
    digits = [packet.entry["hex"] for packet in golden]
    status, lines, errors = terminal.run(["decode", *_options(file)], "\n".join(digits))
    assert (status, errors) == (0, [])
    for packet, line in zip(golden, lines, strict=True):
        decoded = _strict(line)
        assert decoded.pop("name")
        assert exact(decoded) == exact(packet.packet), packet.id
    status, encoded, errors = terminal.run(["encode", *_options(file)], "\n".join(lines))
    assert (status, errors) == (0, [])
    assert encoded == digits


def test_reals_that_are_not_finite_are_words(terminal: Terminal) -> None:
    reals = "0000c07f" + "0000807f" + "000080ff" + "00000000" * 7
    _, (line,), _ = terminal.run(["decode"], f"380000000a000000010000000000000000000000{reals}")
    assert _strict(line)["fields"]["joints"][:3] == ["nan", "inf", "-inf"]
    assert terminal.run(["encode"], line)[1] == [f"380000000a000000010000000000000000000000{reals}"]


@pytest.mark.parametrize(
    "spelling",
    [
        PING.upper(),
        "0x" + PING,
        "0X" + PING.upper(),
        f"   {PING}\t\r",
        "0c 00 00 00  01 00 00 00\t02000000 00000000",
        "0x0c000000 0x01000000 0x02000000 0x00000000",
        "\ufeff" + PING,
    ],
)
def test_digits_are_read_as_people_write_them(terminal: Terminal, spelling: str) -> None:
    status, (line,), _ = terminal.run(["decode"], spelling)
    assert status == 0
    assert json.loads(line) == PING_PACKET


def test_blank_lines_are_skipped_but_counted(terminal: Terminal) -> None:
    status, lines, errors = terminal.run(["decode"], f"\n  \n{PING}\n\nzz\n")
    assert status == 1
    assert len(lines) == 1
    assert errors == ["line 5: 'z' is no hexadecimal digit"]


def test_no_input_is_no_error(terminal: Terminal) -> None:
    assert terminal.run(["decode"]) == (0, [], [])


ERRORS: dict[str, dict[str, tuple[str | bytes, str]]] = {
    "decode": {
        "odd digits": ("abc", "an odd number of hexadecimal digits: 3"),
        "another script's digits": ("٠" * 32, "'٠' is no hexadecimal digit"),
        "a control character": ("\x1b[31m", r"'\x1b' is no hexadecimal digit"),
        "bytes that are no UTF-8": (b"0c\xff", "not UTF-8: byte 0xff at 2"),
        "too short": ("0c000000", "4 bytes are less than a header"),
        "a wrong length": (PING + "00", "declared length 12 is not the 13 bytes that follow"),
        "a broken header": ("0c000000010000000300000000000000", "reply code 0 does not go with"),
        "a short body": (
            "100000000a000000010000000000000000000000",
            "the body has 4 bytes, not 44",
        ),
        "a line without end": ("0" * (3 * MAX_LINE), f"longer than {MAX_LINE} bytes"),
    },
    "encode": {
        "no JSON": ("{", "no JSON: Expecting property name"),
        "not a number": ('{"msg_type": NaN}', 'no JSON: NaN; write "nan"'),
        "a list": ("[]", "a packet is a JSON object, not []"),
        "deep nesting": ("[" * 100_000, "no packet: nested too deeply"),
        "a huge integer": ("9" * 5_000, "no packet: an integer of thousands of digits"),
        "bytes that are no UTF-8": (b'{"\xff"', "not UTF-8: byte 0xff at 2"),
        "a lone surrogate as key": (r'{"\ud800": 1}', r"a packet has no key '\ud800'"),
        "33 bits": (
            json.dumps({**PING_PACKET, "msg_type": 13, "fields": dict.fromkeys("abc", 2**32)}),
            "status has no field 'a'",
        ),
        "a huge type": (json.dumps({**PING_PACKET, "msg_type": 2**70}), "no integer of 32 bits"),
    },
}


@pytest.mark.parametrize(
    ("tool", "case"), [(tool, case) for tool in ERRORS for case in ERRORS[tool]]
)
def test_a_line_that_is_no_packet_is_reported_and_the_rest_converted(
    terminal: Terminal, tool: str, case: str
) -> None:
    line, reason = ERRORS[tool][case]
    raw = line if isinstance(line, bytes) else line.encode()
    as_json = json.dumps(PING_PACKET)
    good, made = (PING, as_json) if tool == "decode" else (as_json, PING)
    status, lines, (error,) = terminal.run([tool], raw + b"\n" + good.encode())
    assert status == 1
    assert error.startswith("line 1: ")
    assert reason in error
    assert len(error) < 300
    assert [line if tool == "encode" else json.dumps(json.loads(line)) for line in lines] == [made]


def test_a_lone_surrogate_in_a_text_is_not_encoded(terminal: Terminal) -> None:
    fields = r'{"request_id": 1, "reason": "\ud800"}'
    line = f'{{"msg_type": 65014, "comm_type": 2, "reply_code": 0, "fields": {fields}}}'
    status, lines, (error,) = terminal.run(["encode", "--dialect", "pendant"], line)
    assert (status, lines) == (1, [])
    assert r"software_stop.reason is '\ud800'" in error


def test_texts_of_any_script_survive_a_terminal_of_ascii_only(terminal: Terminal) -> None:
    fields = {"request_id": 1, "reason": "näher 手"}
    packet = {"msg_type": 65014, "comm_type": 2, "reply_code": 0, "fields": fields}
    arguments = ["--dialect", "pendant"]
    _, digits, _ = terminal.run(["encode", *arguments], json.dumps(packet, ensure_ascii=False))
    _, (line,), _ = terminal.run(["decode", *arguments], digits[0])
    assert line.isascii()
    assert json.loads(line)["fields"] == fields


def test_a_file_is_read_in_place_of_standard_input(terminal: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "packets.txt"
    file.write_text(f"{PING}\n{PING}")
    status, lines, _ = terminal.run(["decode", str(file), "--order", "little"])
    assert (status, len(lines)) == (0, 2)


def test_a_file_that_cannot_be_read_is_a_usage_error(terminal: Terminal, tmp_path: Path) -> None:
    missing = str(tmp_path / "nowhere")
    assert terminal.run(["decode", missing]) == (2, [], [f"{missing}: No such file or directory"])
    assert terminal.run(["decode", str(tmp_path)])[0] == 2


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["decode", "--order", "middle"],
        ["decode", "--input", "usb"],
        ["decode", "--max-packets", "0"],
        ["decode", "--real", "5"],
        ["decode", "--real", "x"],
        ["encode", "--dialect", "abb"],
        ["encode", "--ord", "big"],
        ["encode", "one", "two"],
    ],
)
def test_wrong_arguments_are_a_usage_error(terminal: Terminal, arguments: list[str]) -> None:
    status, lines, errors = terminal.run(arguments)
    assert (status, lines) == (2, [])
    assert errors[0].startswith("usage: openpendant packets")


def test_an_unknown_tool_is_a_usage_error(terminal: Terminal) -> None:
    status, lines, (error,) = terminal.run(["sniff"])
    assert (status, lines) == (2, [])
    assert error.startswith("openpendant packets: unknown tool 'sniff'; known: decode, encode")


def test_help_is_no_error(terminal: Terminal) -> None:
    status, lines, errors = terminal.run(["decode", "--help"])
    assert (status, errors) == (0, [])
    assert "--order" in "\n".join(lines)


def _start(*arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "openpendant.tools.packets.cli", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_each_line_is_answered_before_the_next_one_comes() -> None:
    with _start("decode") as process:
        assert process.stdin
        assert process.stdout
        for _ in range(3):
            process.stdin.write(PING.encode() + b"\n")
            process.stdin.flush()
            assert json.loads(process.stdout.readline()) == PING_PACKET
        process.stdin.close()
        assert process.wait(20) == 0


def test_a_reader_that_goes_away_ends_the_command_quietly() -> None:
    with _start("decode") as process:
        assert process.stdin
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        process.stdin.write((PING + "\n").encode())
        process.stdin.close()
        assert process.stderr.read() == b""
        assert process.wait(20) == 1


TRACE = str(Path(__file__).parents[2] / "vectors" / "capture-motoman-driver.json")


@pytest.mark.parametrize(
    ("main", "arguments"),
    [
        (decode.main, [TRACE]),
        (show.main, [TRACE]),
        (rerun.main, [TRACE, "--json"]),
        (record.main, ["--listen", "0", "--to", "1", "-o", "-"]),
    ],
    ids=["decode", "show", "rerun", "record"],
)
def test_a_closed_output_is_one_line_and_exit_code_1(
    main: object,
    arguments: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert callable(main)
    with monkeypatch.context() as patched:
        patched.setattr(sys, "stdout", None)
        code = main(arguments)
    assert code == 1
    assert capsys.readouterr().err == "standard output is closed\n"


def test_the_dissector_is_written_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dissector"]) == 0
    assert capsys.readouterr().out == lua_dissector()


def test_the_dissector_is_written_to_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dissector", "-o", str(tmp_path / "openpendant.lua")]) == 0
    assert (tmp_path / "openpendant.lua").read_text(encoding="utf-8") == lua_dissector()
    assert capsys.readouterr().out == ""


def test_a_file_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dissector", "-o", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(tmp_path) in line


def test_writing_it_loads_neither_server_nor_pydantic() -> None:
    script = (
        "import sys; from openpendant.tools.packets.dissector import main; main([]);"
        "sys.exit(bool({'pydantic', 'numpy', 'openpendant.server'} & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr


ROOT = Path(__file__).parents[3]
PACKETS_PAGE = ROOT / "docs" / "packets.md"


def _examples() -> list[tuple[str, str]]:
    """Commands of the page, each with the output that follows it there."""
    blocks = re.findall(r"```console\n(.*?)```", PACKETS_PAGE.read_text("utf-8"), re.DOTALL)
    parts = [part for block in blocks for part in re.split(r"(?m)^\$ ", block) if part]
    return [(command, output) for command, _, output in (part.partition("\n") for part in parts)]


@pytest.mark.parametrize(("command", "output"), _examples(), ids=lambda text: text[:40])
def test_the_examples_of_the_page_print_what_it_says(command: str, output: str) -> None:
    folder = Path(sys.executable).parent
    path = f"{folder}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-c", command],
        cwd=ROOT,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout == output
