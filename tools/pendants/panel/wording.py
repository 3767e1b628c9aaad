"""Wording of states, refusals and remedies, with angles in degrees and lengths in millimetres.

Owns the words that the small display and the full screen share, the conversion from SI for the
screen, and which refused connections must not be tried again. Each lamp is readable without its
colour, by a word and a shape. The catalogue's remedies are written for every pendant; the few here
name the keys of a terminal.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal, TypeAlias

from openpendant.simplemsg.pendant import (
    Activity,
    JogReason,
    LinkState,
    OperatingMode,
    ProgramState,
    StopKind,
)
from openpendant.simplemsg.pendant.management.cell import JointFacts, WayOut
from openpendant.simplemsg.pendant.management.plans import MadePlan
from openpendant.simplemsg.verdicts import VerdictCode

from ..client import Hold, Refused
from .cell_view import CellView
from .keyboard import axis_keys

_NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"

# `1.5 rad`, `-6.28 to 6.28 rad`, `3 rad/s²`, `0.25 m`; no more than a unit itself follows.
_QUANTITY = re.compile(
    rf"(?<![\w.])(?P<first>{_NUMBER})(?P<to> to (?P<second>{_NUMBER}))?"
    r" (?P<unit>rad|m)(?P<per>/s²?)?(?![\w/²])"
)

# A number with more decimals than anybody reads, in whatever unit.
_LONG = re.compile(r"(?<![\w.:])-?\d+\.\d{5,}(?:e[+-]?\d+)?(?![\w.])")


def joint_value(value: float, unit: Literal["rad", "m"], per: str = "") -> str:
    """Return a value of a joint in screen units, such as `-45.00°` or `120.0 mm/s`.

    Args:
        value: in the unit [rad, m], or per second of it.
        per: what follows the unit: nothing, `/s` or `/s²`.
    """
    return f"{_number(value, unit)}{_sign(unit)}{per}"


def in_screen_units(sentence: str) -> str:
    """Return a sentence with its angles in degrees and its lengths in millimetres.

    Numbers with another unit, or none, keep four decimals at most.

    Args:
        sentence: of the server, which names the unit of each quantity: `1.57 rad`, `0.25 m`.
    """
    return _LONG.sub(_shortened, _QUANTITY.sub(_converted, sentence))


def _shortened(found: re.Match[str]) -> str:
    value = float(found[0])
    return f"{value:.4f}" if value == 0.0 or abs(value) >= 0.001 else f"{value:.2g}"


def _converted(found: re.Match[str]) -> str:
    unit: Literal["rad", "m"] = "rad" if found["unit"] == "rad" else "m"
    numbers = [found["first"], *([found["second"]] if found["to"] else [])]
    shown = " to ".join(_number(float(number), unit) for number in numbers)
    return f"{shown}{_sign(unit)}{found['per'] or ''}"


def _number(value: float, unit: Literal["rad", "m"]) -> str:
    """Return a number without its unit: hundredths of a degree, tenths of a millimetre."""
    return f"{math.degrees(value):.2f}" if unit == "rad" else f"{1000 * value:.1f}"


def _sign(unit: Literal["rad", "m"]) -> str:
    return "°" if unit == "rad" else " mm"


MODES = {
    OperatingMode.MANUAL_REDUCED: ("T1", "manual reduced speed"),
    OperatingMode.MANUAL_HIGH: ("T2", "manual high speed"),
    OperatingMode.AUTOMATIC: ("AUTO", "automatic"),
    OperatingMode.RECOVERY: ("REC", "recovery"),
}
"""The short and the long name of each mode."""


class Light(Enum):
    """State of a lamp; the value is its shape."""

    GOOD = "●"
    DOUBTFUL = "◐"
    BAD = "○"
    UNKNOWN = "?"


@dataclass(frozen=True, slots=True)
class Lamp:
    """One of the three lamps."""

    name: str
    light: Light
    word: str

    def __str__(self) -> str:
        return f"{self.light.value} {self.name}: {self.word}"


def lamps(cell: CellView, now: int) -> tuple[Lamp, Lamp, Lamp]:
    """Return the lamps of pendant to server, server to controller, controller to drives."""
    return _server_lamp(cell, now), _controller_lamp(cell, now), _drives_lamp(cell, now)


def _server_lamp(cell: CellView, now: int) -> Lamp:
    name = "pendant–server"
    if cell.is_greeted and not cell.is_connected:
        return Lamp(name, Light.DOUBTFUL, "no login")
    if not cell.is_connected:
        return Lamp(name, Light.BAD, "down")
    age = cell.message_age(now)
    if age is None:
        return Lamp(name, Light.DOUBTFUL, "no state yet")
    if cell.is_silent(now):
        return Lamp(name, Light.DOUBTFUL, f"silent for {age:.1f} s")
    return Lamp(name, Light.GOOD, "up")


def _controller_lamp(cell: CellView, now: int) -> Lamp:
    name = "server–controller"
    # What a server said that is silent now may have changed since.
    if cell.state is None or cell.is_silent(now):
        return Lamp(name, Light.UNKNOWN, "unknown")
    match cell.state.link:
        case LinkState.UP:
            return Lamp(name, Light.GOOD, "up")
        case LinkState.STALE:
            return Lamp(name, Light.DOUBTFUL, "stale")
    return Lamp(name, Light.BAD, "down")


def _drives_lamp(cell: CellView, now: int) -> Lamp:
    name = "controller–drives"
    state = cell.state
    if state is None or cell.is_silent(now) or state.link == LinkState.DOWN:
        return Lamp(name, Light.UNKNOWN, "unknown")
    if state.e_stopped == 1:
        return Lamp(name, Light.BAD, "emergency stop at the controller")
    if state.in_error == 1:
        return Lamp(name, Light.BAD, f"error {state.error_code}")
    match state.drives_powered:
        case 1:
            return Lamp(name, Light.GOOD, "on")
        case 0:
            return Lamp(name, Light.BAD, "off")
    return Lamp(name, Light.UNKNOWN, "unknown")


def mode_name(cell: CellView) -> str:
    """Return the short name of the mode."""
    return "?" if cell.mode is None else MODES[cell.mode][0]


def owner(cell: CellView) -> str:
    """Return the name of the pendant in control."""
    if cell.in_control:
        return "you"
    if cell.state is None:
        return "unknown"
    return (cell.owner or "another") if cell.state.holder else "nobody"


def stop(cell: CellView) -> str:
    """Return the latched stop in a sentence; empty where there is none."""
    if cell.state is None or not cell.is_stopped:
        return ""
    kind = "protective" if cell.state.stop == StopKind.PROTECTIVE else "software"
    by = f" by {cell.stopped_by}" if cell.stopped_by else ""
    why = f": {cell.stop_reason}" if cell.stop_reason else ""
    return f"{kind} stop{by}{why}"


def activity(cell: CellView) -> str:
    """Return the activity of the cell in a word."""
    if cell.state is None:
        return "unknown"
    known = cell.state.activity in set(Activity)
    return Activity(cell.state.activity).name.lower() if known else "unknown"


def program_state(cell: CellView) -> str:
    """Return the state of the program in a word; empty for none."""
    state = ProgramState.NONE if cell.state is None else cell.state.program_state
    if state == ProgramState.NONE or state not in set(ProgramState):
        return ""
    return ProgramState(state).name.lower().replace("_", " ")


def slowed(cell: CellView) -> str:
    """Return why a jog is slower than requested; empty if it is not."""
    state = cell.state
    if state is None or state.jog_reason not in set(JogReason) or not state.jog_reason:
        return ""
    reason = JogReason(state.jog_reason).name.lower().replace("_", " ")
    joint = f" of joint {state.jog_joint + 1}" if state.jog_joint >= 0 else ""
    return f"jog at {100 * state.jog_scale:.0f} %: {reason}{joint}"


def staleness(cell: CellView, now: int) -> str:
    """Return why the shown values may differ from the robot's present state."""
    age = cell.age(now)
    if age is None:
        return "no state yet"
    if cell.state is not None and cell.state.link != LinkState.UP and not cell.is_silent(now):
        return f"{_controller_lamp(cell, now)}"
    return f"the values are {age:.1f} s old"


def banner(cell: CellView, now: int) -> str:
    """Return the most important sentence, with its remedy; empty if nothing is wrong."""
    if cell.is_greeted and not cell.is_connected:
        return f"NO LOGIN: {cell.absence}; the space bar or F8 stops the robot all the same"
    if not cell.is_connected:
        return f"NO LINK: {cell.absence}; to stop the robot, use the hardware button"
    if cell.is_stopped:
        return f"STOPPED, {stop(cell)}; x resets, which moves nothing"
    if cell.is_stale(now):
        return f"STALE: {staleness(cell, now)}"
    state = cell.state
    if state is not None and (state.e_stopped == 1 or state.in_error == 1):
        return f"The controller cannot move: {_drives_lamp(cell, now).word}; clear it there"
    if not cell.in_control:
        return f"Observing: {owner(cell)} has control; c asks for it"
    return slowed(cell)


KEYBOARD_REMEDIES: Mapping[VerdictCode, str] = {
    VerdictCode.NOT_ENABLED: "Press v, which holds it for some seconds; then try again.",
    VerdictCode.ENABLING_LOST: "Press v, which holds it anew; then ask for the motion again.",
    VerdictCode.MODE_CHANGED: "Press v in a manual mode, then ask for the motion again.",
    VerdictCode.NOT_IN_CONTROL: "Press c, which asks for control.",
    VerdictCode.HELD_BY_OTHER: "Wait until it is given back; C takes it over, by role.",
    VerdictCode.AUTHORITY_LOST: "Press c, which asks for control; nothing resumes by itself.",
    VerdictCode.STOP_LATCHED: "Press x in control, which resets it and moves nothing.",
    VerdictCode.STOPPED: "Press x in control to reset the stop; then ask for the motion again.",
    VerdictCode.PROTECTIVE_STOP: "Remove the reason, then press x, which resets the stop.",
    VerdictCode.PAUSED: "Press 8 to resume it, or 9 to end it.",
    VerdictCode.PRESS_DEAD: "Strike the key again.",
    VerdictCode.PRESS_STALE: "Strike the key again once the values are fresh.",
    VerdictCode.OVERRIDE_ZERO: "Press +, then ask for the motion again.",
    VerdictCode.OUTSIDE_LIMITS: "Jog the joint back inside; where m sets the mode, press m and 4"
    " first, recovery.",
    VerdictCode.REVISION_CONFLICT: "It was loaded anew: look at it, then ask again.",
    VerdictCode.PROGRAM_UNKNOWN: "Press n, which lists the programs.",
    VerdictCode.PROGRAM_RUNNING: "Press 9 to end it; to step it or run it on, 8 pauses it.",
}


Remedies: TypeAlias = Mapping[VerdictCode, str]
"""Remedies that name the keys of a pendant, in the place of the catalogue's."""


def remedy(code: VerdictCode | int, otherwise: str, remedies: Remedies = KEYBOARD_REMEDIES) -> str:
    """Return the remedy of a refusal."""
    return remedies.get(VerdictCode(code), otherwise) if code in set(VerdictCode) else otherwise


_HOPELESS = frozenset(
    {
        VerdictCode.VERSION,
        VerdictCode.UNKNOWN_CELL,
        VerdictCode.ADDRESS_NOT_ALLOWED,
        VerdictCode.BAD_ARGUMENT,
        VerdictCode.LOGIN_NEEDED,
        VerdictCode.LOGIN_FAILED,
        VerdictCode.ROLE_TOO_LOW,
        VerdictCode.PAIRING_WRONG,
        VerdictCode.BAD_ACCOUNT_NAME,
    }
)


def is_hopeless(refused: Refused) -> bool:
    """Return True if each further attempt to connect would be refused likewise.

    The request must change: another cell, another password, another version.
    """
    return refused.code in _HOPELESS


def refusal_line(
    refused: Refused,
    joints: Sequence[JointFacts] = (),
    remedies: Remedies = KEYBOARD_REMEDIES,
) -> str:
    """Return a refusal in one line."""
    helps = remedy(refused.code, refused.remedy, remedies)  # nothing for a code of a newer server
    return f"{_name(refused)}: {_sentence(refused, joints)}{f' -> {helps}' if helps else ''}"


def connection_refused(refused: Refused) -> str:
    """Return why the server refuses this pendant, and how to start it instead."""
    if refused.code == VerdictCode.UNKNOWN_CELL:
        return f"{refused.text or refused.cause}; choose one: --cell NAME"
    return refusal_line(refused)


def _name(refused: Refused) -> str:
    return refused.code.name if isinstance(refused.code, VerdictCode) else str(refused.code)


def _called(joint: JointFacts) -> str:
    """Return a joint's display name, and in brackets its name in the robot file."""
    name = joint["name"]
    shown = joint.get("display_name") or name
    return name if shown == name else f"{shown} ({name})"


def _sentence(refused: Refused, joints: Sequence[JointFacts]) -> str:
    if not 0 <= refused.joint < len(joints):
        return in_screen_units(refused.text or refused.cause)
    joint = joints[refused.joint]
    who, unit = f"joint {refused.joint + 1}, {_called(joint)},", joint["unit"]
    match refused.code:
        case VerdictCode.OUT_OF_RANGE | VerdictCode.OUTSIDE_LIMITS:
            lower, upper = joint_value(joint["lower"], unit), joint_value(joint["upper"], unit)
            return (
                f"{who} at {joint_value(refused.value, unit)} is beyond its limit"
                f" {joint_value(refused.limit, unit)}; accepted: {lower} to {upper}"
            )
        case VerdictCode.TOO_FAST:
            value, limit = (joint_value(v, unit, "/s") for v in (refused.value, refused.limit))
            return f"{who} at {value} is faster than its limit {limit}"
        case VerdictCode.TOO_SHARP:
            value, limit = (joint_value(v, unit, "/s²") for v in (refused.value, refused.limit))
            return f"{who} accelerating at {value} exceeds its limit {limit}"
    return in_screen_units(refused.text or refused.cause)


def plan_line(label: str, made: MadePlan) -> str:
    """Return what is to know of a plan before it is executed, in one line."""
    line = f"plan {made['plan']} {label}: {made['duration']:.2f} s, {made['samples']} samples"
    near = made["clearance"]
    if near is not None:
        line += f", {1000 * near['distance']:.0f} mm from {near['first']} to {near['second']}"
    why = made["why"]
    return line if why is None else f"{line}; not executed now: {in_screen_units(why['text'])}"


def why_request(mode: OperatingMode | None) -> dict[str, str]:
    """Return the request why a jog is impossible, or in automatic mode, why a program run is."""
    kind = "program" if mode is OperatingMode.AUTOMATIC else "jog"
    return {"op": "why", "kind": kind, "whose": "mine"}


KeysOf: TypeAlias = Callable[[Sequence[float], str], tuple[str, ...]]
"""Names the keys of a pendant that jog along some axes of a frame, which is empty for joints."""


def _typed_keys(values: Sequence[float], frame: str) -> tuple[str, ...]:
    return axis_keys(values)


def why_lines(
    answer: dict[str, Any],
    holds: Sequence[Hold] = (),
    remedies: Remedies = KEYBOARD_REMEDIES,
    keys_of: KeysOf = _typed_keys,
) -> tuple[str, ...]:
    """Return the answer line by line."""
    conditions: list[dict[str, Any]] = answer["conditions"]
    broken = next((each for each in conditions if not each["holds"]), None)
    chain = [f"{'ok' if each['holds'] else 'NO'} {each['meaning']}" for each in conditions]
    chain += [in_screen_units(remark) for remark in answer.get("remarks", ())]
    kind = answer["kind"]
    if broken is None:
        ready = f"A {kind} may start: all conditions hold."
        out = _way_out(holds, keys_of)
        return (ready, *_end(answer.get("ended"), remedies), *out, *chain)
    told = _told(broken, remedies)
    return (f"No {kind}:", *told, *_way_out(holds, keys_of), *chain)


def _end(ended: dict[str, Any] | None, remedies: Remedies) -> list[str]:
    if ended is None:
        return []
    return ["The last motion ended before its goal:", *_told(ended, remedies)]


def _told(broken: dict[str, Any], remedies: Remedies) -> list[str]:
    """Return what is broken, why, and what helps, each once."""
    helps = remedy(int(broken.get("code", 0)), str(broken["remedy"]), remedies)
    return list(dict.fromkeys((in_screen_units(broken["text"]), broken["cause"], f"-> {helps}")))


def _keys(way: WayOut, keys_of: KeysOf) -> str:
    """Return the keys of an escape direction on this pendant."""
    keys = keys_of(way["values"], way["frame"])
    key = f"keys {' '.join(keys)} together" if len(keys) > 1 else f"key {' '.join(keys)}"
    return f"{key}, frame {way['frame']}" if way["frame"] else key


def _way_out(holds: Sequence[Hold], keys_of: KeysOf) -> list[str]:
    lines: list[str] = []
    for hold in holds:
        lines.append(f"{in_screen_units(hold['text'])}:")
        if not hold["ways"]:
            lines.append("-> no key leads out")
        for index, way in enumerate(hold["ways"]):
            lines.append(f"{'or' if index else '->'} {way['press']}: {_keys(way, keys_of)}")
    return lines
