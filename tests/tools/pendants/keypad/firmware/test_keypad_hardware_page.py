"""The page on the keypad's hardware, its drawing and `board.h` say the same of each pin."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[5]
BOARD = (ROOT / "tools" / "pendants" / "keypad" / "firmware" / "board.h").read_text("utf-8")
PAGE = (ROOT / "docs" / "keypad-hardware.md").read_text("utf-8")
DRAWING = ElementTree.parse(ROOT / "docs" / "keypad-wiring.svg").getroot()
TEXTS = ["".join(each.itertext()) for each in DRAWING.iter("{http://www.w3.org/2000/svg}text")]

# Of the board's own documentation: pin of the Mega 2560, and of its chip.
MEGA = {
    **{f"A{8 + pin}": f"PK{pin}" for pin in range(8)},
    **{f"D{37 - pin}": f"PC{pin}" for pin in range(2, 8)},
    "D2": "PE4",
    "D48": "PL1",
    "D49": "PL0",
}


def test_the_drawing_names_each_pin_of_the_board_as_the_chip_does() -> None:
    drawn = dict(text.split() for text in TEXTS if re.fullmatch(r"[AD]\d+ +P[A-Z]\d", text))
    assert drawn == MEGA


@pytest.mark.parametrize("pins", [("D35", "PC2"), ("D34", "PC3"), ("D2", "PE4"), ("D48", "PL1")])
def test_the_table_names_single_pins_as_the_drawing_does(pins: tuple[str, str]) -> None:
    assert f"| {pins[0]} | {pins[1]} |" in PAGE
    assert MEGA[pins[0]] == pins[1]


def test_the_table_names_groups_of_pins_as_the_drawing_does() -> None:
    assert "| A8 to A11 | PK0 to PK3 |" in PAGE
    assert "| A12 to A15 | PK4 to PK7 |" in PAGE
    assert "| D33, D32, D31, D30 | PC4 to PC7 |" in PAGE


@pytest.mark.parametrize(
    "said",
    [
        "RS on D35 (PC2), E on D34 (PC3), D4 to D7 on D33 to D30 (PC4 to PC7)",
        "R1 to R4 on A8 to A11 (PK0 to PK3), columns C1 to C4 on A12 to A15 (PK4 to PK7)",
        "Enabling button on D2 (PE4), jumpers on D48 (PL1) and D49 (PL0)",
        "LCD_RS = 1 << PC2, LCD_E = 1 << PC3",
        "return !(PINE & 1 << PE4);",
        "return !(PINL & 1 << PL1);",
        "return !(PINL & 1 << PL0);",
    ],
)
def test_the_firmware_uses_the_pins_of_the_drawing(said: str) -> None:
    assert said in BOARD


def test_the_page_shows_what_the_display_shows_without_a_bridge() -> None:
    for row in ("NO BRIDGE", "USE THE ROBOT'S OWN", "STOP BUTTON", "keypad 1.0   115200"):
        assert f"   {row}\n" in PAGE
