"""Pages of the keypad's display: four rows of twenty printable ASCII characters, in every state.

Owns what is shown before what: a stop that is not confirmed, too many keys, keys to be let go,
control, an alarm, the menu, the selected page. The rows of values are those of every display.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import OperatingMode

from ..panel import lcd, wording
from ..panel.commands import JOINTS
from ..panel.jog_pad import JogKind
from ..panel.keyboard import Page
from ..panel.lcd import COLUMNS
from .keypad import Keypad
from .keys import MENU_KEYS
from .line import LineState
from .menu import Menu, MenuView

_SHOWN = 3
"""Entries of a list on one page."""


def page(keypad: Keypad, now: int) -> tuple[str, str, str, str]:
    """Return the page that is shown [ns]."""
    rows = _page(keypad, now)
    if keypad.stop_key.doubt(now):
        rows = ["STOP NOT CONFIRMED", *rows[1:]]
    return lcd.screen(rows)


def _page(keypad: Keypad, now: int) -> list[str]:
    if keypad.line.too_many:
        return ["TOO MANY KEYS", "two at most", "let go of all"]
    if keypad.is_stop_page and keypad.control_key is None:
        return _stop_page(keypad)
    if _must_let_go(keypad):
        return ["LET GO OF ALL KEYS", "then press again"]
    if keypad.control_key is not None:
        asked = "YOURS" if keypad.cell.in_control else "ASKED"
        return [f"CONTROL: {asked}", "let go of the key,", "then press it again"]
    if keypad.alarm is not None:
        first, *others = keypad.alarm.rows
        return [first, *lcd.wrapped(others, 0)]
    if now < keypad.speed_shown_until and not keypad.is_jogging:
        return [head(keypad, now), *lcd.speed_rows(keypad)]
    if keypad.menu.view not in (None, MenuView.PAGE):
        return _menu_page(keypad)
    return _chosen_page(keypad, now)


def head(keypad: Keypad, now: int) -> str:
    """Return the first row of most pages: what is wrong, else mode, frame, control, enabling."""
    cell = keypad.cell
    if not cell.is_connected:
        return "NO LOGIN" if cell.is_greeted else "NO LINK"
    if cell.is_stopped:
        return f"STOP {cell.stopped_by}"
    if cell.is_stale(now):
        return lcd.stale(cell, now)
    mode = "MENU" if keypad.menu.is_open else wording.mode_name(cell)
    recording = "R" if keypad.menu.under_way else " "
    control = "*" if cell.in_control else "o"
    enabling = "EN  " if _is_enabled(keypad) else "en--"
    return f"{f'{mode} {_frame(keypad)}':<12.12}{recording} {control} {enabling}"


def _is_enabled(keypad: Keypad) -> bool:
    state = keypad.cell.state
    return keypad.cell.in_control and state is not None and state.enabling == 1


def _frame(keypad: Keypad) -> str:
    if keypad.jog.frame != JOINTS:
        return keypad.jog.frame.upper()
    return f"JOINT{keypad.first_axis + 1}-" if keypad.first_axis else "JOINT"


def _chosen_page(keypad: Keypad, now: int) -> list[str]:
    first = head(keypad, now)
    match keypad.page:
        case Page.JOINTS:
            return [first, *lcd.joint_rows(keypad)]
        case Page.POSE:
            return [first, *lcd.pose_rows(keypad)]
        case Page.SPEED:
            return [first, *lcd.speed_rows(keypad)]
        case Page.MODE:
            return [first, *_mode_rows(keypad)]
        case Page.PROGRAM:
            return lcd.program_rows(keypad, first)
        case Page.MESSAGES:
            return lcd.message_rows(keypad)
        case Page.WHY:
            return lcd.wrapped(keypad.why, keypad.scroll) or ["Why not moving?", "asking"]


def _mode_rows(keypad: Keypad) -> list[str]:
    kind = "hold"
    if keypad.jog.kind is JogKind.STEP:
        kind = f"{keypad.jog.step.degrees:g}deg {keypad.jog.step.millimetres:g}mm"
    return [
        f"Jog {_frame(keypad)} {kind}",
        f"Control: {wording.owner(keypad.cell)}",
        f"Enabling: {'held' if _is_enabled(keypad) else 'let go'}",
    ]


def _stop_page(keypad: Keypad) -> list[str]:
    cell = keypad.cell
    first = "let go of all keys" if _must_let_go(keypad) else ""
    control = "" if cell.in_control else "a jog key: control"
    return [f"STOP {cell.stopped_by}", cell.stop_reason, first or control, "MODE 2 s: reset"]


def _must_let_go(keypad: Keypad) -> bool:
    return keypad.line.state is LineState.LET_GO and keypad.line.mask != 0


def _menu_page(keypad: Keypad) -> list[str]:
    menu = keypad.menu
    match menu.view:
        case MenuView.RECORDINGS:
            return _recordings(menu)
        case MenuView.RECORD:
            return _record(menu)
        case MenuView.PROGRAMS:
            return _programs(menu)
        case MenuView.QUESTION if menu.question is not None:
            return list(menu.question.rows)
        case MenuView.MOTION if menu.motion is not None:
            return _motion(keypad)
    return _keys()


def _keys() -> list[str]:
    """Return the second meanings as the keys lie."""
    words = [MENU_KEYS[key].value for key in sorted(MENU_KEYS)]
    return ["".join(f"{word:<7}" for word in words[at : at + 3]) for at in range(0, len(words), 3)]


def clock(seconds: float) -> str:
    """Return a time as minutes, seconds and tenths."""
    tenths = round(10 * seconds)
    return f"{tenths // 600:02}:{tenths % 600 / 10:04.1f}"


def _listed(menu: Menu, entries: list[str]) -> list[str]:
    """Return the entries round the selected one, which is marked."""
    first = max(0, min(menu.selected - 1, len(entries) - _SHOWN))
    shown = list(enumerate(entries))[first : first + _SHOWN]
    rows = [f"{'>' if place == menu.selected else ' '}{text}" for place, text in shown]
    return [*rows, *[""] * (_SHOWN - len(rows))]


def _recordings(menu: Menu) -> list[str]:
    if menu.recordings is None:
        return ["asking"]
    if not menu.recordings:
        return ["no recordings", "", "", "REC: new"]
    room = COLUMNS - 1 - len(clock(0))
    entries = [
        f"{name[: room - 1]:<{room}}{clock(seconds)}" if seconds is not None else name
        for name, seconds in menu.recordings
    ]
    return [*_listed(menu, entries), "hold PLAY; REC: new"]


def _record(menu: Menu) -> list[str]:
    made = menu.under_way
    if made is None:
        return ["REC", "asking", "MODE: jog on"]
    length = f"REC {clock(made.duration)}"
    points = f"{made.samples} pts"
    return [lcd.spread(length, points), made.name, "MODE: jog on", "REC: end and keep"]


def _programs(menu: Menu) -> list[str]:
    if menu.programs is None:
        return ["asking"]
    if not menu.programs:
        return ["no programs", "", "", "TEACH: new"]
    return [*_listed(menu, list(menu.programs)), "RUN: open TEACH: new"]


def _motion(keypad: Keypad) -> list[str]:
    motion, state = keypad.menu.motion, keypad.cell.state
    assert motion is not None
    speed = "" if state is None else f"{100 * state.override:.0f} %"
    ends = "ended" if motion.is_over else "let go: stops"
    if keypad.cell.mode is OperatingMode.AUTOMATIC:
        ends = "STOP stops"
    if motion.duration is None:
        return [lcd.spread(motion.title, speed), ends]
    elapsed = min(motion.elapsed, motion.duration)
    times = f"{clock(elapsed)} of {clock(motion.duration)}"
    return [lcd.spread(motion.title, speed), times, ends]
