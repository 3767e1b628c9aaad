"""What is shown of the program that is under way: in the open program, or beside it by its name.

Owns that no other program is taken for the open one: its lines would be marked in the wrong text. A
program that the open one calls counts as another, and so does another revision.
"""

from __future__ import annotations

from . import words
from .panel import Panel


def _is_open(panel: Panel) -> bool:
    """Tell whether the run is in the open program, as it is shown."""
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or program is None:
        return False
    return (place.name, place.revision) == (program.name, program.revision)


def open_state(panel: Panel) -> str:
    """Return what the open program is doing; empty for nothing."""
    return words.program_state(panel.cell) if _is_open(panel) else ""


def running_statement(panel: Panel) -> int | None:
    """Return the statement that is run now, from 0; None for none of the open program."""
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or program is None or not _is_open(panel):
        return None
    return program.index_of(place.line)


def other_program(panel: Panel) -> str:
    """Return which program is under way beside the open one; empty for none.

    Its revision is said where the open one has the same name.
    """
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or _is_open(panel):
        return ""
    is_namesake = program is not None and program.name == place.name
    return f"{place.name} r{place.revision}" if is_namesake else place.name


def other_line(panel: Panel) -> str:
    """Return the same with what it is doing, and on which line; empty for none."""
    name, place = other_program(panel), panel.cell.program_place
    if not name or place is None:
        return ""
    where = f"line {place.line}" if place.line else ""
    told = (name, words.program_state(panel.cell), where)
    return f"under way: {', '.join(part for part in told if part)}"
