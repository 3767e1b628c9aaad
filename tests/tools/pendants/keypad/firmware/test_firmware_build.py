"""The compiled firmware: how big it is, how deep its stack, how fast it runs in simavr."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from rigs.firmware.simulated_board import SOURCES, Board, Firmware

from openpendant.simplemsg.serial_frames import FrameWriter, HostBeat, LcdPage

from .conftest import StartBoard

pytestmark = pytest.mark.firmware

Record = Callable[[str, object], None]

FLASH, MEMORY = 8 * 1024, 1024
MEMORY_BEGINS = 0x200
UART_0, DOUBLE_SPEED = 0xC0, 2
TOO_DEAR = ("malloc", "printf", "__mulsf3", "__divsf3", "__addsf3")


def test_the_firmware_takes_at_most_8_KiB_of_flash(
    firmware: Firmware, record_property: Record
) -> None:
    flash = firmware.sizes[".text"] + firmware.sizes[".data"]
    record_property("flash [bytes]", flash)
    assert flash <= FLASH


def test_the_firmware_takes_at_most_1_KiB_of_memory_with_its_stack(
    board: Board, record_property: Record
) -> None:
    free = board.firmware.symbols["_end"] & 0xFFFF
    board.order("reset")
    board.order("paint", free)
    board.run(100)
    board.welcome(debounce=20)
    for key in range(15):
        board.down(key, bounce=2)
        board.send(LcdPage(bytes([65 + key]) * 80))
        board.send_bytes(b"rubbish" * 30 + b"\0")
        board.run(60)
    for key in range(15):
        board.up(key, bounce=2)
    board.run(1_500)
    answer = board.order("painted", free)
    static, stack = free - MEMORY_BEGINS, answer["of"] - answer["painted"]
    record_property("static memory [bytes]", static)
    record_property("deepest stack [bytes]", stack)
    assert static + stack <= MEMORY


def test_compiler_and_linker_have_nothing_to_say(firmware: Firmware) -> None:
    flags = re.search(r"-Wall -Wextra -Werror", (SOURCES / "Makefile").read_text("utf-8"))
    assert flags
    assert firmware.said == ""


def test_with_the_button_fitted_they_have_nothing_to_say_either(tmp_path: Path) -> None:
    assert Firmware.compiled(tmp_path, ENABLING_BUTTON=1).said == ""


@pytest.mark.parametrize("baud", [9_600, 19_200, 38_400, 57_600, 115_200])
def test_the_speed_of_the_line_is_within_2_5_percent(
    start_board: StartBoard, tmp_path: Path, baud: int
) -> None:
    board = start_board(Firmware.compiled(tmp_path, LINE_BAUD=baud), baud)
    board.run(5)
    registers = bytes.fromhex(board.order("peek", UART_0, 6)["memory"])
    assert registers[0] & DOUBLE_SPEED
    assert abs(16e6 / 8 / (int.from_bytes(registers[4:6], "little") + 1) / baud - 1) <= 0.025


def test_the_firmware_has_no_heap_no_printf_and_no_floating_point(firmware: Firmware) -> None:
    assert {name for name in firmware.symbols if name in TOO_DEAR} == set()


def test_the_intel_hex_holds_the_whole_program(firmware: Firmware) -> None:
    said = subprocess.run(
        ["avr-size", "--target=ihex", firmware.elf.with_suffix(".hex")],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert int(said[7]) == firmware.sizes[".text"] + firmware.sizes[".data"]


@pytest.mark.parametrize("is_busy", [False, True])
def test_simavr_runs_it_at_least_twice_as_fast_as_a_real_one(
    ready: Board, is_busy: bool, record_property: Record
) -> None:
    writer = FrameWriter(100)
    began, simulated = ready.processor, ready.now
    for turn in range(100):
        line = b"".join(
            writer.write(LcdPage(bytes([97 + (turn + part) % 26]) * 80))[1] for part in range(2)
        )
        ready.send_bytes(line if is_busy else writer.write(HostBeat(0))[1])
        ready.order("run", 20)
    ratio = (ready.now - simulated) / (ready.processor - began)
    record_property(f"times real time, {'busy' if is_busy else 'idle'}", round(ratio, 1))
    assert ratio >= 2
