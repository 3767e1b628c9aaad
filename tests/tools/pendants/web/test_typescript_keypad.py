"""The keypad in the page: its tests in Node, with the golden frames and runs of the emulator."""

from pathlib import Path

from rigs.data.keypad_runs import write_keypad_cases
from rigs.processes.node_tests import run_node_test


def test_the_keypad_in_the_page_has_the_bytes_of_the_emulator(tmp_path: Path) -> None:
    write_keypad_cases(tmp_path / "cases.json")
    run_node_test("keypad", KEYPAD_CASES=str(tmp_path / "cases.json"))
