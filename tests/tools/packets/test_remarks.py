"""What people read about a Motoman packet beyond its fields."""

from pathlib import Path

import pytest

from openpendant.simplemsg import MOTOMAN, Message, Ping, codec_for
from openpendant.simplemsg import motoman as m
from openpendant.tools.packets.cli import main
from openpendant.tools.packets.reading.field_table import is_failed_verdict, remark_on
from openpendant.tools.packets.trace import Packet, TraceDirection, entry_line, header_line

ZEROS = (0.0,) * 10
HOLD = m.MotomanMotionReply(0, 4, 200121, 5, 5007, ZEROS)
HOLD_REMARK = "NOT_READY/NOT_READY_HOLD: Hold is active. Release it at the controller."
NO_ADDRESS = m.MotomanReadSingleIoReply(0, 1001)
NO_ADDRESS_REMARK = (
    "READ_ADDRESS_INVALID: This address cannot be read. See the address ranges of the controller."
)
FAILURES: list[tuple[Message, str]] = [
    (HOLD, HOLD_REMARK),
    (m.MotomanMotionReply(0, 4, 14, 9, 0, ZEROS), "result 9: This result is unknown. "),
    (NO_ADDRESS, NO_ADDRESS_REMARK),
    (m.MotomanReadGroupIoReply(0, 1001), NO_ADDRESS_REMARK),
    (m.MotomanReadMregisterReply(0, 1001), NO_ADDRESS_REMARK),
    (m.MotomanWriteSingleIoReply(1002), "WRITE_ADDRESS_INVALID: "),
    (m.MotomanWriteGroupIoReply(1003), "WRITE_VALUE_INVALID: "),
    (m.MotomanWriteMregisterReply(-7), "result -7: This result is unknown."),
]
SILENT: list[Message] = [
    Ping(),
    m.MotomanMotionReply(0, 4, 200102, 0, 5, ZEROS),
    m.MotomanReadSingleIoReply(1, 0),
    m.MotomanWriteMregisterReply(0),
]
ADDRESSES: list[tuple[Message, str]] = [
    (m.MotomanReadSingleIo(10), "bit 10: general input"),
    (m.MotomanWriteGroupIo(1001, 255), "bit 10010: general output (can be written)"),
    (m.MotomanReadSingleIo(19), "bit 19: nothing"),
    (
        m.MotomanWriteSingleIo(25010, 1),
        "bit 25010: network input (can be written) on DX100, FS100;"
        " external input on DX200, YRC1000; nothing on YRC1000micro",
    ),
]


@pytest.mark.parametrize(("message", "remark"), FAILURES)
def test_a_verdict_that_is_no_success_has_meaning_and_remedy(message: Message, remark: str) -> None:
    assert is_failed_verdict(message)
    assert remark_on(message).startswith(remark)


@pytest.mark.parametrize("message", SILENT)
def test_there_is_nothing_to_say_about_the_usual(message: Message) -> None:
    assert not is_failed_verdict(message)
    assert remark_on(message) == ""


@pytest.mark.parametrize(("message", "remark"), ADDRESSES)
def test_an_address_is_named_for_each_model(message: Message, remark: str) -> None:
    assert not is_failed_verdict(message)
    assert remark_on(message) == remark


@pytest.mark.parametrize("message", [HOLD, NO_ADDRESS], ids=["2002", "2004"])
@pytest.mark.parametrize("tool", ["decode", "show"])
def test_a_tree_ends_with_the_remark_and_json_has_none(
    message: Message, tool: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    packet = Packet(0, TraceDirection.TO_CLIENT, codec_for(MOTOMAN).encode(message), 50240)
    file = tmp_path / "trace"
    file.write_text(f"{header_line('2026-01-01T00:00:00+00:00')}\n{entry_line(packet)}\n")
    assert main([tool, str(file), "--format", "tree"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"        {remark_on(message)}"
    assert main([tool, str(file), "--format", "json"]) == 0
    assert remark_on(message) not in capsys.readouterr().out
