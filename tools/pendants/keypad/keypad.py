"""Core of the keypad pendant, without input or output: frames, news and time in, commands out.

Owns what each key does in each state: hold-to-run with two keys, speed, frame, menu, and that STOP
does nothing but stop. A held key moves the robot only while frames of the keypad say that it is
held. The server decides if the robot may move; a refusal becomes the alarm page. Knows no port,
socket or clock: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from openpendant.simplemsg.pendant import Activity, ModeChanged, OperatingMode, StopChanged
from openpendant.simplemsg.serial_frames import HostFlag
from openpendant.simplemsg.verdicts import VerdictCode

from ..client import Hold, Refused
from ..motions import quaternion_of, roll_pitch_yaw
from ..panel import commands as do
from ..panel import wording
from ..panel.commands import JOINTS, CellList, Command
from ..panel.jog_pad import TOOL_AXES, JogKind, speed_asked
from ..panel.keyboard import AxisKey, Intent, Page
from ..panel.panel import Panel
from ..panel.taught_program import TaughtProgram
from .characters import CharacterReader
from .keys import (
    JOG_AXES,
    JOG_KEYS,
    MENU_KEYS,
    MODE,
    SPEED_DOWN,
    SPEED_UP,
    STOP,
    jog_keys_of,
)
from .line import (
    KeypadLine,
    KeypadLives,
    KeyPressed,
    KeyReleased,
    LineEvent,
    StopPressed,
)
from .menu import Menu, MenuView

LONG_NS = 800_000_000
"""MODE opens the menu where it is held for so long [ns]."""

RESET_NS = 2_000_000_000
"""MODE resets the latched stop on its page where it is held for so long [ns]."""

REPEAT_AFTER_NS = 500_000_000
REPEAT_NS = 250_000_000
"""A held SPEED key repeats after the first, and then every so often [ns]."""

ALARM_NS = 5_000_000_000
"""An alarm is shown for so long, or until a key [ns]."""

SPEED_SHOWN_NS = 1_500_000_000
"""The page of the speeds is shown so long after a SPEED key [ns]."""

STEP_ENABLED_NS = 2_000_000_000
"""Enabling (training) of an increment is let go after so long at the latest [ns]."""

PAGES = (Page.JOINTS, Page.POSE, Page.SPEED, Page.MODE, Page.PROGRAM, Page.MESSAGES, Page.WHY)
"""In the order in which PAGE goes round them."""

REMEDIES: wording.Remedies = {
    VerdictCode.NOT_ENABLED: "Let go of the key and press it again.",
    VerdictCode.ENABLING_LOST: "Let go of the key and press it again.",
    VerdictCode.MODE_CHANGED: "Let go of the key and press it again.",
    VerdictCode.NOT_IN_CONTROL: "Press a jog key, which asks for control.",
    VerdictCode.HELD_BY_OTHER: "Wait until it is given back.",
    VerdictCode.AUTHORITY_LOST: "Press a jog key, which asks for control.",
    VerdictCode.MODE_FORBIDS: "MODE long opens the menu; T1/T2 there sets T1.",
    VerdictCode.STOP_LATCHED: "Hold MODE for 2 s on the page of the stop.",
    VerdictCode.STOPPED: "Hold MODE for 2 s on the page of the stop.",
    VerdictCode.PROTECTIVE_STOP: "Remove the reason, then hold MODE for 2 s.",
    VerdictCode.PAUSED: "PAUSE in the menu resumes it.",
    VerdictCode.PRESS_DEAD: "Let go of the key and press it again.",
    VerdictCode.PRESS_STALE: "Let go of the key and press it again.",
    VerdictCode.OVERRIDE_ZERO: "SPEED + raises the speed.",
    VerdictCode.OUTSIDE_LIMITS: "Jog the joint back inside.",
    VerdictCode.REVISION_CONFLICT: "It was loaded anew: look at it, then ask again.",
    VerdictCode.PROGRAM_UNKNOWN: "RUN in the menu lists the programs.",
}

_WAYS_OUT = frozenset(
    {
        VerdictCode.OUT_OF_RANGE,
        VerdictCode.OUTSIDE_LIMITS,
        VerdictCode.UNREACHABLE,
        VerdictCode.START_IN_COLLISION,
        VerdictCode.PATH_IN_COLLISION,
        VerdictCode.GOAL_IN_COLLISION,
        VerdictCode.BRANCH_CHANGE,
    }
)
"""Refusals out of which keys may lead."""

_NO_ALARM = frozenset({VerdictCode.NOTHING_TO_CONTROL})
"""What a key that comes up is told where its motion has just ended by itself."""


class EnablingSource(StrEnum):
    """What holds the enabling device (training): the key itself, or a push button with it."""

    KEY = "key"
    BUTTON = "button"


@dataclass(slots=True)
class Alarm:
    """A refusal on the display.

    Attributes:
        rows: its four rows.
        key: jog key that was refused, which keeps it while it is down; None for none.
        since: when it was shown first [ns]; None until then.
    """

    rows: tuple[str, ...]
    key: int | None = None
    since: int | None = None


class Keypad(Panel):
    """One keypad pendant: its line, its keys, and what it knows of the cell.

    Attributes:
        enabling_source: what was set.
        is_emulated: the controller is known to be emulated.
        is_described: the server has said whether it is.
        button: the enabling button is held, by the last frame.
        alarm: the refusal that is shown.
        control_key: jog key that asked for control, while it is down; None for none.
        shows_stop: the page of a latched stop is shown.
        news: what happened on the line, for whoever prints it; taken by `line_news`.
    """

    remedies = REMEDIES
    gives_control = "CTRL in the menu gives it up"

    def __init__(
        self,
        line: KeypadLine,
        enabling_source: EnablingSource = EnablingSource.KEY,
        *,
        characters: bool = False,
    ) -> None:
        """Make a keypad that is not plugged in.

        Args:
            characters: it sends plain characters in place of frames: increments only.
        """
        super().__init__({})
        self.line = line
        self._characters = CharacterReader() if characters else None
        self.enabling_source = enabling_source
        self.is_emulated = self.is_described = False
        self.button = False
        self.menu = Menu(self.cell, self.jog, self.teaching, self.messages)
        self.alarm: Alarm | None = None
        self.control_key: int | None = None
        self.shows_stop = False
        self.speed_shown_until = 0
        self.first_axis = 0
        self.jog.kind = JogKind.STEP if line.is_slow or characters else JogKind.HOLD
        self._jogging: set[int] = set()
        self._is_pressing = False
        self._speed_key: tuple[int, int] | None = None
        self._mode_since: int | None = None
        self._step_until: int | None = None
        self._news: list[LineEvent] = []

    # What the line says.

    @property
    def needs_button(self) -> bool:
        """True where a motion in the manual modes wants the enabling button as well."""
        return self.enabling_source is EnablingSource.BUTTON or not self.is_emulated

    @property
    def is_jogging(self) -> bool:
        """True while a press is held, as far as is known here."""
        return self._is_pressing

    def line_news(self) -> list[LineEvent]:
        """Return what happened on the line since the last call."""
        news, self._news = self._news, []
        return news

    @property
    def sends_characters(self) -> bool:
        """True where the keypad sends plain characters."""
        return self._characters is not None

    def line_opened(self, now: int) -> None:
        """Take that the port is open [ns]."""
        if self._characters is None:
            self.line.opened(now)

    def line_closed(self) -> list[Command]:
        """Take that the port is closed; return what ends what was held."""
        asked = self._take_events(self.line.closed(), 0)
        return [*asked, *self._drop("the line is closed")]

    def receive(self, data: bytes, now: int) -> list[Command]:
        """Take bytes of the port [ns]."""
        if self._characters is not None:
            return self._take_characters(self._characters.receive(data, now), now)
        return self._gated(self._take_events(self.line.receive(data, now), now), now)

    def tick(self, now: int) -> list[Command]:
        """Advance the time [ns]: deadlines of the line, held keys, pages."""
        asked = self._take_events(self.line.tick(now), now)
        if self._characters is not None:
            asked += self._take_characters(self._characters.tick(now), now)
        asked += self._with_turned_angles(super().tick(now))
        asked += self.menu.tick(now, self.line.mask)
        asked += self._repeat_speed(now)
        asked += self._look_at_mode(now)
        asked += self._end_of_step(now)
        self._age_alarm(now)
        self._turn_pages()
        if self.control_key is not None and not self.line.mask >> self.control_key & 1:
            self.control_key = None
        self.line.host_flags = self._host_flags()
        return self._gated(asked, now)

    def _gated(self, asked: list[Command], now: int) -> list[Command]:
        """Return commands without those that would move the robot on values that may be old."""
        if not any(isinstance(each, do.BeginsMotion) for each in asked) or self.jog.is_fresh(now):
            return asked
        self.raise_alarm("STALE", "no motion on values that may be old")
        self.motion_over()
        self._is_pressing = False
        self._jogging.clear()
        return [each for each in asked if not isinstance(each, do.BeginsMotion)]

    def _take_events(self, events: Iterable[LineEvent], now: int) -> list[Command]:
        asked: list[Command] = []
        has_fewer = False
        for event in events:
            # Keys that come up together change the aim once: two that end leave none of them.
            if has_fewer and not isinstance(event, KeyReleased):
                asked += self._aim()
                has_fewer = False
            match event:
                case StopPressed():
                    asked += self._stop("STOP key", now)
                case KeyPressed(key=key):
                    asked += self._pressed(key, now)
                case KeyReleased(key=key) if key in self._jogging:
                    self._jogging.discard(key)
                    has_fewer = True
                case KeyReleased(key=key):
                    asked += self._released(key, now)
                case KeypadLives(enabling=held):
                    asked += self._lives(held)
                case _:
                    self._news.append(event)
        return [*asked, *self._aim()] if has_fewer else asked

    def _take_characters(self, keys: Iterable[int], now: int) -> list[Command]:
        """Take plain characters: increments, their size, the frame, and STOP."""
        asked: list[Command] = []
        for key in keys:
            if key == STOP:
                asked += self._stop("STOP key", now)
            elif key == MODE:
                self._next_frame()
            elif key in (SPEED_UP, SPEED_DOWN):
                asked += self._change_speed(key, now)
            elif self._may_step(now):
                asked += self._jog_pressed(key, now)
        return asked

    def _may_step(self, now: int) -> bool:
        """Return True if a character may move the robot; one that comes while it moves is lost."""
        state = self.cell.state
        if not self.jog.is_fresh(now) or state is None:
            return False
        if not self.cell.in_control:
            self.messages.add("no control: a character does not ask for it, --take-control does")
            return False
        return state.activity in (Activity.IDLE, Activity.PAUSED)

    def _with_turned_angles(self, asked: list[Command]) -> list[Command]:
        """Return commands in which A, B, C of base change roll, pitch, yaw, as characters do."""
        return [
            self._turned(each) if self.sends_characters and isinstance(each, do.StepJog) else each
            for each in asked
        ]

    def _turned(self, step: do.StepJog) -> Command:
        state, by = self.cell.state, dict(step.increments)
        if step.frame != "base" or state is None or not any(axis > 2 for axis in by):
            return step
        x, y, z = (here + by.get(axis, 0.0) for axis, here in enumerate(state.tool_position))
        angles = roll_pitch_yaw(state.tool_orientation)
        a, b, c = (here + by.get(axis, 0.0) for axis, here in enumerate(angles, 3))
        return do.MoveToPose((x, y, z), quaternion_of(a, b, c), "increment")

    def _lives(self, enabling: bool) -> list[Command]:
        """Take a sign of the keypad: what is held goes on."""
        was_held, self.button = self.button, enabling
        asked: list[Command] = []
        if was_held and not enabling and self.needs_button:
            asked = self._drop("the enabling button was let go")
        return [*asked, do.FeedBeat()]

    # News of the cell.

    def connected(self) -> list[Command]:
        """Take the event that the cell is connected; show a stop that is latched."""
        self.shows_stop = True
        return [*super().connected(), do.AskList(CellList.RECORDINGS)]

    def lost(self, reason: str) -> None:
        """Take the end of the connection: no key counts before it was up."""
        super().lost(reason)
        self.is_described = False
        self.menu.close()
        self._drop("no link")

    def controller_described(self, *, is_emulated: bool) -> None:
        """Take whether the controller is known to be emulated."""
        super().controller_described(is_emulated=is_emulated)
        self.is_emulated, self.is_described = is_emulated, True

    def stop_changed(self, change: StopChanged) -> list[Command]:
        """Take the event of a stop; show its page."""
        self.shows_stop = True
        return super().stop_changed(change)

    def mode_changed(self, change: ModeChanged) -> list[Command]:
        """Take the event of another mode."""
        asked = super().mode_changed(change)
        if self.menu.view is MenuView.QUESTION:
            self.menu.close()
        return asked

    def listed(self, names: Iterable[str]) -> None:
        """Take the names of all programs."""
        self.menu.programs_listed(names)

    def told_list(self, kind: CellList, answer: Mapping[str, Any]) -> None:
        """Take the list of recordings.

        Raises:
            KeyError, TypeError, ValueError: it is none.
        """
        if kind is CellList.RECORDINGS:
            self.menu.listed(answer)

    def not_there(self, name: str) -> None:
        """Take that a program does not exist any more."""
        self.messages.add(f"there is no program {name}")
        self.raise_alarm("NOT_FOUND", f"no program {name}")

    def opened(self, program: TaughtProgram) -> None:
        """Take a program that was loaded; show it where it was asked for."""
        super().opened(program)
        self.question = None

    def why_told(self, answer: dict[str, Any], holds: Sequence[Hold]) -> None:
        """Take the server's answer why the robot does not move."""
        self.why = wording.why_lines(answer, holds, self.remedies, jog_keys_of)[:200]

    def refused(self, refused: Refused) -> list[Command]:
        """Take a refusal, or an abort: show it, and ask for the keys that lead out."""
        self.step_over()
        if refused.code in _NO_ALARM or (self.cell.is_stopped and self.shows_stop):
            return []
        code = refused.code
        name = code.name if isinstance(code, VerdictCode) else f"{code}"
        self.alarm = Alarm(
            (_head_of(name, refused.joint), *self._numbers(refused)),
            next(iter(self._refused), None),
        )
        return [do.AskRetreat()] if code in _WAYS_OUT and self.cell.is_connected else []

    @property
    def _refused(self) -> set[int]:
        return {key for key in JOG_KEYS if self.line.mask >> key & 1}

    def _numbers(self, refused: Refused) -> tuple[str, ...]:
        """Return the rows of a refusal below its name: value and limit, else its remedy."""
        joints = self.cell.joints
        if 0 <= refused.joint < len(joints) and refused.code in (
            VerdictCode.OUT_OF_RANGE,
            VerdictCode.OUTSIDE_LIMITS,
        ):
            is_length = joints[refused.joint]["unit"] == "m"
            value, limit = (
                wording.joint_value(each, "m" if is_length else "rad")
                for each in (refused.value, refused.limit)
            )
            unit = "mm" if is_length else "deg"
            shown = [each.removesuffix("°").removesuffix(" mm") for each in (value, limit)]
            return (f"{shown[0]} of {shown[1]} {unit}",)
        helps = wording.remedy(refused.code, "", self.remedies)
        return (helps or wording.in_screen_units(refused.text or refused.cause),)

    def ways_out(self, holds: Sequence[Hold]) -> None:
        """Take what the robot stands at, and which keys lead out of it."""
        ways = [way for hold in holds for way in hold["ways"]]
        if self.alarm is None or not ways:
            return
        keys = " ".join(jog_keys_of(ways[0]["values"], ways[0]["frame"]))
        lead = "leads out" if " " not in keys else "lead out"
        self.alarm.rows = (*self.alarm.rows[:2], f"{keys} {lead}")

    def jog_over(self) -> None:
        """Take that the held jog is over, however it ended: its keys count no more."""
        if self._is_pressing:
            self._is_pressing = False
            self._jogging.clear()
            self.line.let_go_first()

    def motion_over(self) -> None:
        """Take that the motion of a held key is over."""
        self.menu.motion_over()

    def step_over(self) -> None:
        """Take that an increment is over, however it ended."""
        self._step_until = 0 if self._step_until is not None else None

    # Keys.

    def raise_alarm(self, name: str, text: str) -> None:
        """Show why a key did nothing."""
        self.alarm = Alarm((f"! {name}", text), next(iter(self._refused), None))

    def _drop(self, why: str) -> list[Command]:
        """Release everything that is held; its keys count no more before all were up."""
        self.line.let_go_first()
        asked: list[Command] = []
        if self._is_pressing:
            self._is_pressing = False
            asked.append(do.ReleaseJog())
        self._jogging.clear()
        self._speed_key = self._mode_since = None
        asked += self.menu.let_go()
        if self._step_until is not None:
            self._step_until = None
            asked.append(do.Enable(False))
        return asked

    def _let_go(self, why: str) -> list[Command]:
        return [*super()._let_go(why), *self._drop(why)]

    def _stop(self, by: str, now: int) -> list[Command]:
        self.shows_stop, self.alarm = True, None
        self.menu.close()
        return super()._stop(by, now)

    def _pressed(self, key: int, now: int) -> list[Command]:
        if self.alarm is not None:
            self.alarm = None
        if key == MODE:
            # Not while a jog key is down, nor does its release do anything then.
            self._mode_since = None if self._jogging else now
            return []
        if key in (SPEED_UP, SPEED_DOWN):
            self._speed_key = (key, now + REPEAT_AFTER_NS)
            return self._change_speed(key, now)
        if key == STOP or self._mode_since is not None:
            return []
        if not self.cell.is_connected:
            self.messages.add(f"no link: {self.cell.absence}")
            return []
        if self.menu.is_open:
            return self._menu_pressed(key, now)
        return self._jog_pressed(key, now)

    def _released(self, key: int, now: int) -> list[Command]:
        if self._speed_key is not None and key == self._speed_key[0]:
            self._speed_key = None
        if key == MODE:
            return self._mode_released(now)
        return self.menu.released(key)

    def _menu_pressed(self, key: int, now: int) -> list[Command]:
        meaning = MENU_KEYS[key]
        asked = self.menu.key(meaning, key, now)
        if any(isinstance(each, do.HoldMotion) for each in asked) and not self._may_enable():
            self.menu.let_go()
            return []
        self._turn_pages()
        if self.menu.view is MenuView.PAGE and self.page is Page.WHY and not self.why:
            asked = [*asked, do.AskWhy()]
        return asked

    def _turn_pages(self) -> None:
        """Carry out what the menu asked of the pages."""
        menu = self.menu
        if menu.turns_page:
            place = PAGES.index(self.page) if self.page in PAGES else 0
            self._show(PAGES[(place + menu.turns_page) % len(PAGES)])
            self.why = () if self.page is Page.WHY else self.why
        if menu.turns_row and self.page in (Page.MESSAGES, Page.WHY, Page.JOINTS):
            self.scroll = max(0, self.scroll + menu.turns_row)
        if menu.shows_program:
            self._show(Page.PROGRAM)
        menu.turns_page = menu.turns_row = 0
        menu.shows_program = False

    def _jog_pressed(self, key: int, now: int) -> list[Command]:
        pressed = JOG_KEYS[key]
        axis = AxisKey(
            pressed.axis + (self.first_axis if self.jog.frame == JOINTS else 0), pressed.sign
        )
        axes = self.cell.dof if self.jog.frame == JOINTS else len(TOOL_AXES)
        if not self.cell.in_control:
            self.control_key = key
            return [do.TakeControl()]
        if self.cell.is_stopped:
            self.shows_stop = True
            return []
        if axis.axis >= axes:
            self.raise_alarm("NO AXIS", f"no axis {axis.axis + 1}")
            self.messages.add(f"no axis {axis.axis + 1}; accepted: 1 to {axes}")
            return []
        if not self._may_enable():
            return []
        if self.jog.kind is JogKind.STEP:
            return self._step(axis, now)
        self._jogging.add(key)
        return self._aim(begins=True)

    def _may_enable(self) -> bool:
        """Return True if the enabling device may count as held; else say what is missing."""
        if self.cell.mode is OperatingMode.AUTOMATIC or not self.needs_button or self.button:
            return True
        self.messages.add("the controller may be a real one: hold the enabling button as well")
        self.raise_alarm("ENABLING BUTTON", "hold the button as well, then press again")
        return False

    def _axes(self) -> tuple[tuple[int, int], ...]:
        """Return the axes of the held jog keys; both keys of one axis cancel each other."""
        first = self.first_axis if self.jog.frame == JOINTS else 0
        sums: dict[int, int] = {}
        for key in self._jogging:
            axis = JOG_KEYS[key]
            sums[axis.axis + first] = sums.get(axis.axis + first, 0) + axis.sign
        return tuple((axis, sign) for axis, sign in sorted(sums.items()) if sign)

    def _aim(self, *, begins: bool = False) -> list[Command]:
        """Return what makes the robot follow the held jog keys; only a pressed key begins."""
        axes = self._axes()
        if not axes:
            # A key that comes up begins nothing: what is left of a pair counts no more.
            self._jogging.clear()
            was_pressing, self._is_pressing = self._is_pressing, False
            return [do.ReleaseJog()] if was_pressing else []
        if self._is_pressing:
            return [do.AimJog(self.jog.frame, axes)]
        if not begins:
            return []
        self._is_pressing = True
        return [do.PressJog(self.jog.frame, axes)]

    def _step(self, axis: AxisKey, now: int) -> list[Command]:
        """Collect a key for an increment; `tick` returns it."""
        asked = self.jog.key(axis, now)
        if self.cell.mode is not OperatingMode.AUTOMATIC and self._step_until is None:
            asked = [do.Enable(True), *asked]
        self._step_until = now + STEP_ENABLED_NS
        return asked

    def _end_of_step(self, now: int) -> list[Command]:
        if self._step_until is None or now < self._step_until:
            return []
        self._step_until = None
        return [do.Enable(False)]

    def _change_speed(self, key: int, now: int) -> list[Command]:
        faster = key == SPEED_UP
        if self.jog.kind is JogKind.STEP:
            self.jog.step = self.jog.step.changed(1 if faster else -1)
            return []
        state = self.cell.state
        if state is None or not self.cell.is_connected:
            return []
        self.speed_shown_until = now + SPEED_SHOWN_NS
        return [speed_asked(Intent.FASTER if faster else Intent.SLOWER, state)]

    def _repeat_speed(self, now: int) -> list[Command]:
        if self._speed_key is None or now < self._speed_key[1]:
            return []
        key = self._speed_key[0]
        self._speed_key = (key, now + REPEAT_NS)
        return self._change_speed(key, now)

    @property
    def is_stop_page(self) -> bool:
        """True while the page of a latched stop is shown."""
        return self.shows_stop and self.cell.is_connected and self.cell.is_stopped

    def _look_at_mode(self, now: int) -> list[Command]:
        """Return what MODE does while it is held."""
        if self._mode_since is None:
            return []
        held = now - self._mode_since
        if self.is_stop_page:
            if held < RESET_NS:
                return []
            self._mode_since = None
            return [do.UnlatchStop()]
        if held >= LONG_NS:
            self._mode_since = None
            self.menu.open(now)
        return []

    def _mode_released(self, now: int) -> list[Command]:
        """Take that MODE came up: a short press changes the frame, or closes what is shown."""
        since, self._mode_since = self._mode_since, None
        if since is None or now - since >= LONG_NS:
            return []
        if self.is_stop_page:
            self.shows_stop = False
        elif self.menu.is_open:
            asked = self.menu.let_go()
            self.menu.close()
            return asked
        else:
            self._next_frame()
        return []

    def _next_frame(self) -> None:
        """Go on to joints 7-, base, tool, the named frames, and the joints again."""
        if self.jog.frame == JOINTS and self.first_axis + JOG_AXES < self.cell.dof:
            self.first_axis += JOG_AXES
            self.scroll = self.first_axis // 2
        else:
            self.first_axis = self.scroll = 0
            self.jog.turn_frame(1)
        if self.page in (Page.JOINTS, Page.POSE):
            self.page = Page.JOINTS if self.jog.frame == JOINTS else Page.POSE

    def _age_alarm(self, now: int) -> None:
        alarm = self.alarm
        if alarm is None:
            return
        if alarm.since is None:
            alarm.since = now
        is_held = alarm.key is not None and self.line.mask >> alarm.key & 1
        if not is_held and now - alarm.since >= ALARM_NS:
            self.alarm = None

    def _host_flags(self) -> int:
        state = self.cell.state
        if state is None or not self.cell.is_connected:
            return 0
        flags = HostFlag(0)
        if self.cell.in_control:
            flags |= HostFlag.IN_CONTROL
        if state.activity not in (Activity.IDLE, Activity.PAUSED):
            flags |= HostFlag.MOVING
        if self.cell.is_stopped:
            flags |= HostFlag.STOP_LATCHED
        return int(flags)


def _head_of(name: str, joint: int) -> str:
    """Return the first row of a refusal: its name, and its joint at the right end."""
    number = f" {joint + 1}" if joint >= 0 else ""
    return f"{f'! {name}'[: 20 - len(number)]:<{20 - len(number)}}{number}"
