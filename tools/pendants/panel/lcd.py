"""Pages of a display of 20 columns and 4 rows, the size of the display in the second paper.

Owns the text of each page: exactly four rows of exactly twenty ASCII characters in every state of
the cell. Serves any device that can show them; angles in degrees, lengths in millimetres.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable
from itertools import zip_longest

from openpendant.simplemsg.pendant import LinkState

from ..motions import roll_pitch_yaw
from . import wording
from .cell_lists import Listing
from .cell_view import CellView
from .commands import JOINTS
from .jog_pad import JogKind
from .keyboard import Page
from .panel import Panel, open_state, other_program, running_statement
from .prompts import Choice, ProgramChoice, TextEntry
from .taught_program import REACHABLE

COLUMNS, ROWS = 20, 4

_ASCII = str.maketrans({"°": "d", "–": "-", "×": "x", "±": "~", "’": "'", "…": "."})
_JOINTS_SHOWN = 6


def page(panel: Panel, now: int) -> tuple[str, str, str, str]:
    """Return the page that is shown: a question, or the selected page.

    While a stop is not confirmed, the first row of every page says so.
    """
    first, *others = _page(panel, now)
    return screen(["STOP NOT CONFIRMED" if panel.stop_key.doubt(now) else first, *others])


def _page(panel: Panel, now: int) -> tuple[str, str, str, str]:
    question = panel.question
    if isinstance(question, Choice):
        return screen(_choice(question))
    if isinstance(question, TextEntry):
        return screen(_entry(question))
    if isinstance(question, ProgramChoice):
        return screen(_program_choice(question))
    if isinstance(question, Listing):
        return screen(_listing(question))
    return screen(_PAGES[panel.page](panel, now))


def screen(lines: Iterable[str]) -> tuple[str, str, str, str]:
    """Return lines cut or filled to the four rows of the display."""
    rows = [row(line) for line in lines][:ROWS]
    first, second, third, fourth = [*rows, *[" " * COLUMNS] * (ROWS - len(rows))]
    return first, second, third, fourth


def row(text: str) -> str:
    """Return a text cut or filled to one row of printable ASCII."""
    plain = text.translate(_ASCII).encode("ascii", "replace").decode()
    printable = "".join(each if each.isprintable() else "?" for each in plain)
    return printable[:COLUMNS].ljust(COLUMNS)


def spread(left: str, right: str) -> str:
    """Return a row of two texts, one at each end; the left one is cut."""
    room = max(0, COLUMNS - len(right))
    return f"{left[:room]:<{room}}{right}"


def _head(panel: Panel, now: int) -> str:
    """Return the first row of most pages: what is wrong, else mode, frame, step and enabling."""
    cell = panel.cell
    if not cell.is_connected:
        return "NO LOGIN" if cell.is_greeted else "NO LINK"
    if cell.is_stopped:
        return f"STOP {cell.stopped_by}"
    if cell.is_stale(now):
        return stale(cell, now)
    held = f"EN{panel.enabling.seconds_left(now)}s" if panel.enabling.is_on else "en--"
    control = "*" if cell.in_control else "o"
    return spread(f"{wording.mode_name(cell)} {frame_name(panel)}", f"{control} {held}")


def stale(cell: CellView, now: int) -> str:
    """Return a row that says why the values may be old."""
    age = cell.age(now)
    if age is None:
        return "STALE"
    if cell.state is not None and cell.state.link == LinkState.DOWN and not cell.is_silent(now):
        return "CONTROLLER DOWN"
    return f"STALE {age:.1f} s"


def frame_name(panel: Panel) -> str:
    """Return the frame of the jog keys as it stands on the display."""
    return "JOINT" if panel.jog.frame == JOINTS else panel.jog.frame.upper()


def _jog(panel: Panel) -> str:
    """Return the page of the jog keys: frame, size and speed."""
    if panel.jog.kind is JogKind.HOLD:
        return "hold"
    return f"{panel.jog.step.degrees:g}deg {panel.jog.step.millimetres:g}mm"


def _mode(panel: Panel, now: int) -> list[str]:
    cell = panel.cell
    left = panel.enabling.seconds_left(now)
    return [
        _head(panel, now),
        f"Jog {frame_name(panel)} {_jog(panel)}",
        f"Control: {wording.owner(cell)}",
        f"Enabling: {f'{left} s left' if left else 'let go'}",
    ]


def joint_rows(panel: Panel) -> list[str]:
    """Return the rows of the joints' values, two in each."""
    positions = panel.cell.positions
    if positions is None:
        return ["no joint values"]
    cells = [
        _joint(index, value, panel.cell.joints[index]["unit"] == "m")
        for index, value in enumerate(positions)
    ]
    first = min(2 * panel.scroll, max(0, len(cells) - _JOINTS_SHOWN + len(cells) % 2))
    shown = cells[first : first + _JOINTS_SHOWN]
    return ["".join(shown[i : i + 2]) for i in range(0, len(shown), 2)]


def _joint(index: int, value: float, linear: bool) -> str:
    """Return one joint in half a row; a number that needs more room loses its decimals."""
    shown = value * 1000 if linear else math.degrees(value)
    text = f"{shown:z.2f}" if abs(shown) < 1000 else f"{shown:.0f}"
    return f"{(index + 1) % 10}:{text[:7]:>7} "


def pose_rows(panel: Panel) -> list[str]:
    """Return the rows of the tool's pose in base."""
    state = panel.cell.state
    if state is None or not panel.cell.knows_tool:
        return ["no tool pose"]
    angles = map(math.degrees, roll_pitch_yaw(state.tool_orientation))
    rows = zip("XYZ", state.tool_position, "ABC", angles, strict=True)
    return [f"{x}{1000 * mm:z8.1f} {a}{degrees:z8.1f} " for x, mm, a, degrees in rows]


def speed_rows(panel: Panel) -> list[str]:
    """Return the rows of the speeds."""
    state = panel.cell.state
    if state is None:
        return ["no values"]
    cap = f"{1000 * state.tool_speed_cap:.0f} mm/s" if state.tool_speed_cap else "none"
    return [
        spread("Override", f"{100 * state.override:.0f} %"),
        spread("Tool cap", cap),
        spread("Tool now", f"{1000 * state.tool_speed:.0f} mm/s"),
    ]


def program_rows(panel: Panel, head: str) -> list[str]:
    """Return the rows of the open program; without one the head that other pages have."""
    program, other = panel.teaching.program, _other_program(panel)
    if program is None:
        return [head, "No program is open", *other]
    head = spread(program.name, open_state(panel) or f"r{program.revision}")
    if not program.lines:
        return [head, *other, "empty"]
    running = running_statement(panel)
    room = ROWS - 1 - len(other)
    first = max(0, min(panel.teaching.selected - 1, len(program.lines) - room))
    shown = range(first, min(first + room, len(program.lines)))
    return [head, *other, *(_statement(panel, index, running) for index in shown)]


def _other_program(panel: Panel) -> list[str]:
    """Return the row of a program that runs and is not the open one; none without one."""
    name = other_program(panel)
    return [spread(f"={name}", f" {wording.program_state(panel.cell)}")] if name else []


def _statement(panel: Panel, index: int, running: int | None) -> str:
    assert panel.teaching.program is not None
    selected = ">" if index == panel.teaching.selected else " "
    run = "=" if index == running else " "
    line = panel.teaching.program.lines[index].strip()
    return f"{selected}{run}{index + 1}{_reach(panel.teaching.refusal(index))}{line}"


def _reach(refusal: str | None) -> str:
    """Return the dry run's finding about a statement as one character."""
    if refusal is None:
        return " "
    return "+" if refusal == REACHABLE else "!"


def wrapped(lines: Iterable[str], scroll: int) -> list[str]:
    """Return four rows of long lines, from a row on; the last four at most."""
    rows = [row for line in lines for row in textwrap.wrap(line, COLUMNS) or [""]]
    first = max(0, min(scroll, len(rows) - ROWS))
    return rows[first : first + ROWS]


def message_rows(panel: Panel) -> list[str]:
    """Return the rows of the messages, the newest first."""
    lines = tuple(reversed(panel.messages.lines))
    return wrapped(lines, panel.scroll) or ["No messages"]


def _why(panel: Panel, now: int) -> list[str]:
    return wrapped(panel.why, panel.scroll) or ["Why not moving?", "? asks the server"]


_PAGES: dict[Page, Callable[[Panel, int], list[str]]] = {
    Page.MODE: _mode,
    Page.JOINTS: lambda panel, now: [_head(panel, now), *joint_rows(panel)],
    Page.POSE: lambda panel, now: [_head(panel, now), *pose_rows(panel)],
    Page.SPEED: lambda panel, now: [_head(panel, now), *speed_rows(panel)],
    Page.PROGRAM: lambda panel, now: program_rows(panel, _head(panel, now)),
    Page.MESSAGES: lambda panel, now: message_rows(panel),
    Page.WHY: _why,
}


def _choice(question: Choice) -> list[str]:
    options = [f"{key} {text}" for key, (text, _) in question.options.items()]
    half = COLUMNS // 2
    columns = zip_longest(options[::2], options[1::2], fillvalue="")
    rows = [f"{left[: half - 1]:<{half}}{right[:half]}" for left, right in columns]
    if len(rows) >= ROWS:
        # Each option counts more than the words of the question, which are those of its key.
        return rows
    return [question.title, *rows, *[""] * (2 - len(rows)), *["other key: no"] * (len(rows) < 3)]


def _program_choice(choice: ProgramChoice) -> list[str]:
    head = f"Open: {choice.text[-(COLUMNS - len('Open: _')) :]}_"
    if not choice.offers:
        return [head, "asking" if choice.names is None else "none; type a name"]
    first = max(0, min(choice.selected - 1, len(choice.offers) - (ROWS - 1)))
    shown = list(enumerate(choice.offers))[first : first + ROWS - 1]
    return [
        head,
        *(
            f"{'>' if index == choice.selected else ' '}{'+' if name == choice.new else ''}{name}"
            for index, name in shown
        ),
    ]


def _listing(listing: Listing) -> list[str]:
    if not listing.entries:
        return [listing.title, "none", "Esc: close"]
    first = max(0, min(listing.selected - 1, len(listing.entries) - (ROWS - 1)))
    shown = list(enumerate(listing.entries))[first : first + ROWS - 1]
    rows = (f"{'>' if index == listing.selected else ' '}{each.text}" for index, each in shown)
    return [listing.title, *rows]


def _entry(question: TextEntry) -> list[str]:
    shown = question.text[-(COLUMNS - 1) :] + "_"
    return [question.wanted.value, shown, "Enter: done", "Esc: no  SPACE: stop"]
