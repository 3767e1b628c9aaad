"""The page docs/command-to-motion.md says what the walks are, on one screen."""

from walks.motion_page import PAGE, page
from walks.walk_table import gone


def test_the_page_is_what_the_walks_give() -> None:
    written = PAGE.read_text(encoding="utf-8")
    assert written == page(), "`make reference` writes the page anew"


def test_each_folder_of_a_walk_has_its_row_and_its_function_a_summary() -> None:
    text = page()
    for file in gone("a1").files:
        assert f"| `{file.rpartition('/')[0]}/` |" in text
    assert " |  |" not in text, "a function without a docstring"


def test_the_page_fits_a_screen() -> None:
    assert len(page().splitlines()) <= 100
