"""What the full screen shows around the display: lamps, status, joints, program, messages.

Owns these texts. Every sign is a word; colours come on top, elsewhere.
"""

from __future__ import annotations

import math
import textwrap

from . import words
from .commands import JOINTS
from .enabling_toggle import TIMEOUT_NS
from .jog_keys import PULSE_NS, JogKind
from .panel import Panel
from .program_choice import ProgramChoice
from .reachability import REACHABLE
from .teaching import Teaching
from .under_way import open_state, other_line, running_statement

_BAR = 16
_SHOWN_LINES = 6


def lamp_line(panel: Panel, now: int) -> str:
    """Return the three lamps."""
    return "   ".join(str(lamp) for lamp in words.lamps(panel.cell, now))


def banner(panel: Panel, now: int) -> str:
    """Return the one sentence that matters most: first of all a stop that may not be heard."""
    return panel.stop_key.doubt(now) or words.banner(panel.cell, now)


def status_line(panel: Panel, now: int) -> str:
    """Return who, in which mode, what, and how old that is."""
    cell, state = panel.cell, panel.cell.state
    stale = "STALE, " if cell.is_stale(now) else ""
    speed = "?" if state is None else f"{100 * state.override:.0f} %"
    mode = "?" if cell.mode is None else "{} ({})".format(*words.MODES[cell.mode])
    who = f"{cell.robot} in {cell.cell}" if cell.robot else "no cell yet"
    return (
        f"{who}   control: {words.owner(cell)}   mode: {mode}   "
        f"speed: {speed}   {words.activity(cell)}   {stale}{_age(cell.age(now))}"
    )


def _age(age: float | None) -> str:
    """Return an age; what is fresh is not counted, or the line would never rest."""
    if age is None:
        return "no state"
    return f"{age:.1f} s old" if age >= 0.1 else "age below 0.1 s"


def jog_line(panel: Panel, now: int) -> str:
    """Return what the jog keys and the enabling toggle do now."""
    jog = panel.jog
    frame = "joints" if jog.frame == JOINTS else f"frame {jog.frame}"
    if jog.kind is JogKind.STEP:
        how = f"steps of {jog.step.degrees:g}° or {jog.step.millimetres:g} mm"
    else:
        how = f"held: stops {PULSE_NS // 1_000_000} ms after the last key stroke"
    limit = TIMEOUT_NS // 1_000_000_000
    if panel.enabling.is_on:
        enabling = f"HELD, {panel.enabling.seconds_left(now)} s left"
    else:
        enabling = f"let go; v holds it until {limit} s without a key"
    return f"jog: {frame}, {how}\nenabling (training): {enabling}"


def joint_table(panel: Panel) -> str:
    """Return each joint with its value and where it stands between its limits."""
    positions = panel.cell.positions
    if positions is None:
        return "no joint values"
    width = max(len(joint["name"]) for joint in panel.cell.joints)
    rows = []
    for number, (joint, value) in enumerate(
        zip(panel.cell.joints, positions, strict=True), start=1
    ):
        shown = (
            f"{math.degrees(value):z9.2f} °"
            if joint["unit"] == "rad"
            else f"{1000 * value:z9.1f} mm"
        )
        part = (value - joint["lower"]) / (joint["upper"] - joint["lower"])
        rows.append(f"{number:2} {joint['name']:<{width}} {shown} {_bar(part)}")
    return "\n".join(rows)


def _bar(part: float) -> str:
    """Return a bar with a mark at a part of its length; outside of it an arrow says so."""
    if not 0.0 <= part <= 1.0:
        return "[<" + "!" * (_BAR - 1) + "]" if part < 0 else "[" + "!" * (_BAR - 1) + ">]"
    place = min(int(part * _BAR), _BAR - 1)
    return "[" + "·" * place + "|" + "·" * (_BAR - 1 - place) + "]"


def program_list(panel: Panel) -> str:
    """Return the statements round the selected one; `>` is selected, `=` runs.

    Where another program is under way, it is named instead of a mark.
    """
    if isinstance(panel.question, ProgramChoice):
        return _program_choice(panel.question)
    program = panel.teaching.program
    other = [line] if (line := other_line(panel)) else []
    if program is None:
        return "\n".join(["no program is open; n opens one", *other])
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
        return "\n".join([head, *other, "empty; 1 records where the robot stands"])
    return "\n".join([head, *other, _dry_run(panel.teaching), *rows])


def _program_choice(choice: ProgramChoice) -> str:
    """Return the offers round the selected one, with their whole names."""
    head = f"open which program? {choice.text}_"
    if choice.names is None:
        return f"{head}\nasking for the list"
    if not choice.offers:
        return f"{head}\nthere are no programs; type the name of a new one"
    offers = [f"{name}  new" if name == choice.new else name for name in choice.offers]
    first = max(0, min(choice.selected - _SHOWN_LINES // 2, len(offers) - _SHOWN_LINES))
    shown = list(enumerate(offers))[first : first + _SHOWN_LINES]
    rows = [f"{'>' if index == choice.selected else ' '} {name}" for index, name in shown]
    return "\n".join([head, *rows, "type a part of its name, ↑ ↓, Enter"])


def _reach(refusal: str | None) -> str:
    """Return what a dry run found about a statement, to stand behind it."""
    if refusal is None:
        return ""
    return "  reachable" if refusal == REACHABLE else f"  REFUSED: {refusal}"


def _dry_run(teaching: Teaching) -> str:
    """Return how the open program's dry run stands."""
    if teaching.is_walking:
        return "dry run under way"
    found = teaching.dry_run
    return "no dry run of this revision; . makes one" if found is None else found.summary


def message_list(panel: Panel, rows: int, columns: int) -> str:
    """Return the newest messages, the newest last, as rows that fit: its end is always seen."""
    newest = panel.messages.lines[-rows:]
    wrapped = [row for text in newest for row in textwrap.wrap(text, columns) or [""]]
    return "\n".join(wrapped[-rows:])
