"""Texts of the full screen around the display: lamps, status, joints, program, messages.

Owns these texts, and the same once as plain text for pipes, logs and screen readers. Each state is
given in words; `app` adds the colours. Whatever a server put into a name or a sentence, a row stays
one row of bounded length, without signs that a terminal acts on.
"""

from __future__ import annotations

import math
import textwrap
import time
from collections.abc import Iterable

from openpendant.simplemsg.pendant.management.cell import JointFacts

from ...console import one_line
from ..motions import roll_pitch_yaw
from ..panel import wording
from ..panel.cell_lists import Listing
from ..panel.commands import JOINTS
from ..panel.connection import Connect, LogIn
from ..panel.jog_pad import PULSE_NS, JogKind
from ..panel.panel import Panel, open_state, other_line, running_statement
from ..panel.prompts import ProgramChoice
from ..panel.taught_program import REACHABLE
from ..panel.teaching import Teaching

_LONGEST_ROW = 400
_LONGEST_NAME = 40
_BAR = 16
_SHOWN_LINES = 6


def _row(text: str) -> str:
    return one_line(text, "?", _LONGEST_ROW)


def _rows(*texts: str) -> str:
    return "\n".join(map(_row, texts))


def lamp_line(panel: Panel, now: int) -> str:
    """Return the three lamps."""
    return "   ".join(str(lamp) for lamp in wording.lamps(panel.cell, now))


def banner(panel: Panel, now: int) -> str:
    """Return the most important sentence; a stop that is not confirmed comes first."""
    wrong = wording.banner(panel.cell, now)
    if wrong == wording.slowed(panel.cell):
        wrong = panel.enabling.warning(now) or wrong
    return _row(panel.stop_key.doubt(now) or wrong)


def status_line(panel: Panel, now: int) -> str:
    """Return the owner of the authority, mode, activity, and age of the values."""
    cell, state = panel.cell, panel.cell.state
    stale = "STALE, " if cell.is_stale(now) else ""
    speed = "?" if state is None else f"{100 * state.override:.0f} %"
    mode = "?" if cell.mode is None else "{} ({})".format(*wording.MODES[cell.mode])
    who = f"{cell.robot} in {cell.cell}" if cell.robot else "no cell yet"
    return _row(
        f"{who}   control: {wording.owner(cell)}   mode: {mode}   "
        f"speed: {speed}   {wording.activity(cell)}   {stale}{_age(cell.age(now))}"
    )


def _age(age: float | None) -> str:
    """Return an age in words; no number below 0.1 s, so that the line does not flicker."""
    if age is None:
        return "no state"
    return f"{age:.1f} s old" if age >= 0.1 else "age below 0.1 s"


def jog_line(panel: Panel, now: int) -> str:
    """Return the settings of the jog keys and the enabling toggle."""
    jog = panel.jog
    frame = "joints" if jog.frame == JOINTS else f"frame {jog.frame}"
    if jog.kind is JogKind.STEP:
        how = f"steps of {jog.step.degrees:g}° or {jog.step.millimetres:g} mm"
    else:
        how = f"held: stops {PULSE_NS // 1_000_000} ms after the last key stroke"
    limit = panel.enabling.timeout_ns // 1_000_000_000
    if panel.enabling.is_on:
        enabling = f"HELD, {panel.enabling.seconds_left(now)} s left"
    else:
        enabling = f"let go; v holds it until {limit} s without a key"
    return _rows(f"jog: {frame}, {how}", f"enabling (training): {enabling}")


def joint_table(panel: Panel) -> str:
    """Return each joint with its value and its position between its limits."""
    positions = panel.cell.positions
    if positions is None:
        return "no joint values"
    called = map(panel.cell.name_of, panel.cell.joints)
    names = [one_line(name, "?", _LONGEST_NAME) for name in called]
    width = max(map(len, names))
    rows = []
    for number, (joint, name, value) in enumerate(
        zip(panel.cell.joints, names, positions, strict=True), start=1
    ):
        shown = (
            f"{math.degrees(value):z9.2f} °"
            if joint["unit"] == "rad"
            else f"{1000 * value:z9.1f} mm"
        )
        rows.append(f"{number:2} {name:<{width}} {shown} {_bar(_part(joint, value))}")
    return "\n".join(rows)


def pose_table(panel: Panel) -> str:
    """Return the tool's pose in base, as two rows: position, and rotations about x, y, z."""
    state = panel.cell.state
    if state is None or not panel.cell.knows_tool:
        return "no tool pose"
    angles = map(math.degrees, roll_pitch_yaw(state.tool_orientation))
    lengths = (1000.0 * each for each in state.tool_position)
    rows = (("XYZ", lengths, "mm"), ("ABC", angles, "°"))
    return "\n".join(f"{_named(axes, values)} {unit}" for axes, values, unit in rows)


def _named(axes: str, values: Iterable[float]) -> str:
    return "  ".join(f"{axis} {value:z8.1f}" for axis, value in zip(axes, values, strict=True))


def _part(joint: JointFacts, value: float) -> float:
    """Return where a value is between its joint's limits, 0 to 1."""
    room = joint["upper"] - joint["lower"]
    return (value - joint["lower"]) / room if room else 0.0


def _bar(part: float) -> str:
    """Return a bar with a mark at a fraction of its length; an arrow for one outside 0 to 1."""
    if not 0.0 <= part <= 1.0:
        return "[<" + "!" * (_BAR - 1) + "]" if part < 0 else "[" + "!" * (_BAR - 1) + ">]"
    place = min(int(part * _BAR), _BAR - 1)
    return "[" + "·" * place + "|" + "·" * (_BAR - 1 - place) + "]"


def program_list(panel: Panel) -> str:
    """Return the statements around the selected one; `>` is selected, `=` runs.

    While another program runs, the list names it and has no `=`.
    """
    if isinstance(panel.question, ProgramChoice):
        return _program_choice(panel.question)
    if isinstance(panel.question, Listing):
        return _listing(panel.question)
    program = panel.teaching.program
    other = [line] if (line := other_line(panel)) else []
    if program is None:
        return _rows("no program is open; n opens one", *other)
    running = running_statement(panel)
    selected = panel.teaching.selected
    room = _SHOWN_LINES - len(other)
    first = max(0, min(selected - room // 2, len(program.lines) - room))
    shown = list(enumerate(program.lines))[first : first + room]
    state = open_state(panel)
    head = f"{program.name}, revision {program.revision}{f', {state}' if state else ''}"
    rows = [
        f"{'>' if i == selected else ' '}{'=' if i == running else ' '}{i + 1:4} {line}"
        f"{_reach(panel.teaching.refusal(i))}"
        for i, line in shown
    ]
    if not rows:
        return _rows(head, *other, "empty; 1 records where the robot stands")
    return _rows(head, *other, _dry_run(panel.teaching), *rows)


def _program_choice(choice: ProgramChoice) -> str:
    """Return the offered programs around the selected one, with their full names."""
    head = f"open which program? {choice.text}_"
    if choice.names is None:
        return f"{head}\nasking for the list"
    if not choice.offers:
        return f"{head}\nthere are no programs; type the name of a new one"
    offers = [f"{name}  new" if name == choice.new else name for name in choice.offers]
    first = max(0, min(choice.selected - _SHOWN_LINES // 2, len(offers) - _SHOWN_LINES))
    shown = list(enumerate(offers))[first : first + _SHOWN_LINES]
    rows = [f"{'>' if index == choice.selected else ' '} {name}" for index, name in shown]
    return _rows(head, *rows, "type a part of its name, ↑ ↓, Enter")


def _listing(listing: Listing) -> str:
    """Return the entries around the selected one."""
    if not listing.entries:
        return _rows(f"{listing.title}: none", "Esc closes")
    entries = list(enumerate(listing.entries))
    first = max(0, min(listing.selected - _SHOWN_LINES // 2, len(entries) - _SHOWN_LINES))
    rows = [
        f"{'>' if index == listing.selected else ' '} {each.text}"
        for index, each in entries[first : first + _SHOWN_LINES]
    ]
    return _rows(listing.title, *rows, "↑ ↓, Enter; Esc closes")


def _reach(refusal: str | None) -> str:
    """Return the dry run's finding about a statement, to be shown behind it."""
    if refusal is None:
        return ""
    return "  reachable" if refusal == REACHABLE else f"  REFUSED: {refusal}"


def _dry_run(teaching: Teaching) -> str:
    """Return the state of the open program's dry run."""
    if teaching.is_walking:
        return "dry run under way"
    found = teaching.dry_run
    return "no dry run of this revision; . makes one" if found is None else found.summary


def message_list(panel: Panel, rows: int, columns: int) -> str:
    """Return the newest messages as rows that fit; the end of the newest one is always shown."""
    newest = panel.messages.lines[-rows:]
    wrapped = [row for text in newest for row in textwrap.wrap(text, columns) or [""]]
    return "\n".join(wrapped[-rows:])


_PATIENCE = 5.0


async def status_once(connect: Connect, log_in: LogIn, *, names_as_in_file: bool = False) -> str:
    """Connect, wait for one state, and return it in words.

    Raises:
        OSError: nobody listens there.
        PendantError: the server does not want us, or the connection ended.
        TimeoutError: no state came.
    """
    panel = Panel()
    panel.cell.names_as_in_file = names_as_in_file
    async with await connect() as client:
        await log_in(client)
        panel.cell.connected(client.hello, await client.snapshot())
        state = await client.wait_until(lambda _: True, within=_PATIENCE)
        now = time.monotonic_ns()
        panel.cell.take_state(state, now)
        texts = (
            lamp_line(panel, now),
            status_line(panel, now),
            banner(panel, now),
            joint_table(panel),
        )
    return "\n".join(text for text in texts if text)
