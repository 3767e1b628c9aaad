"""The C header of the keypad's frames is what the declarations say."""

import re
from pathlib import Path

from openpendant.tools.reference.files import stale_sources
from openpendant.tools.reference.firmware_header import HEADER, firmware_header

ROOT = Path(__file__).parents[3]
# Of the protocol's description, by hand.
SAID = {
    "HELLO": 0x01,
    "HELLO_SIZE": 12,
    "KEY_DOWN": 0x02,
    "KEY_UP_SIZE": 6,
    "BEAT": 0x04,
    "ACK_SIZE": 2,
    "WELCOME_SIZE": 4,
    "LCD_ROW": 0x82,
    "LCD_ROW_SIZE": 22,
    "LCD_PAGE_SIZE": 80,
    "HOST_BEAT_SIZE": 2,
    "ASK_HELLO": 0x85,
    "ASK_HELLO_SIZE": 0,
    "LONGEST_PIECE": 96,
    "PAGE_INCOMPLETE": 8,
    "HAS_CHARACTERS_JUMPER": 2,
    "WRONG_VERSION": 5,
}


def test_the_committed_header_is_what_the_declarations_say() -> None:
    assert (ROOT / HEADER).read_text("utf-8") == firmware_header(), "run: make reference"


def test_the_header_has_kinds_and_sizes_of_the_protocol() -> None:
    values = {
        name: int(value, 16) for name, value in re.findall(r"(\w+) = (0x\w+)", firmware_header())
    }
    assert {name: values.get(name) for name in SAID} == SAID


def test_a_header_that_is_missing_is_told(tmp_path: Path) -> None:
    assert f"{HEADER.as_posix()} is missing" in stale_sources(tmp_path)
