"""Control of a robot: motion authority, mode of operation, enabling device and speeds.

Owns granting, beats, expiry and release of the authority (`MotionAuthority`): who may move the
robot, one holder at a time, for as long as it is alive.

Owns what each mode allows, when an enabling device (training) counts as held, and the caps of the
speed (`OperatingModes`). The modes are ours on an emulated controller; a real controller's own
selector is mirrored and never set (`selector = "controller"`), and enabling is then its business
too. No safety device: the words are those of ISO 10218-1 because pendants have taught them to
their users.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.pendant import AuthorityReason, EnablingPosition, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode

from .refusal import Refusal
from .settings.cell_settings import Modes


@dataclass(frozen=True, slots=True)
class Holder:
    """The holder of the motion authority."""

    session: int
    client: str

    @property
    def name(self) -> str:
        """The client's name, or its number where it gave none."""
        return self.client or f"session {self.session}"


@dataclass(frozen=True, slots=True)
class AuthorityChange:
    """The authority changed hands."""

    holder: Holder | None
    reason: AuthorityReason


class MotionAuthority:
    """A lease with one holder."""

    def __init__(self, timeout_ns: int) -> None:
        """Make a free lease that expires `timeout_ns` after its holder's last beat."""
        self.holder: Holder | None = None
        self._timeout_ns = timeout_ns
        self._deadline: int | None = None

    def is_held_by(self, session: int) -> bool:
        """Return True if a connection holds the authority."""
        return self.holder is not None and self.holder.session == session

    def request(self, holder: Holder, now: int, *, beats: bool) -> AuthorityChange | None:
        """Take the authority if it is free.

        Args:
            beats: whether the lease expires without beats; a ROS-Industrial link sends none.

        Returns:
            The change; None where somebody has it already, the asker included.
        """
        if self.holder is not None:
            return None
        self.holder = holder
        self._deadline = now + self._timeout_ns if beats else None
        return AuthorityChange(holder, AuthorityReason.GRANTED)

    def beat(self, session: int, now: int) -> None:
        """Prolong the lease; a beat of anybody but the holder, or one too late, does nothing."""
        holder = self.holder
        if holder is None or holder.session != session:
            return
        if self._deadline is not None and now < self._deadline:
            self._deadline = now + self._timeout_ns

    def is_overdue(self, now: int) -> bool:
        """Return True if the holder has been silent for too long."""
        return self._deadline is not None and now >= self._deadline

    def release(self, session: int, reason: AuthorityReason) -> AuthorityChange | None:
        """Give the authority back; None where the connection does not hold it."""
        if not self.is_held_by(session):
            return None
        self.holder = None
        self._deadline = None
        return AuthorityChange(None, reason)

    def expire(self, now: int) -> AuthorityChange | None:
        """End a lease whose holder has been silent for too long."""
        if self.holder is None or not self.is_overdue(now):
            return None
        return self.release(self.holder.session, AuthorityReason.EXPIRED)


REDUCED_SPEED = 0.25
"""Largest speed of tool and elbow in manual reduced speed [m/s] (ISO 10218-1)."""

RECOVERY_SPEED = 0.1
"""Largest speed of tool and elbow while a joint is led back inside its limits [m/s]."""

LEAST_OVERRIDE = 0.001
"""Least speed override above 0: a slower motion looks like none, and would hardly ever end."""

_GREATEST_CAPS: dict[OperatingMode, float | None] = {
    OperatingMode.MANUAL_REDUCED: REDUCED_SPEED,
    OperatingMode.MANUAL_HIGH: math.inf,
    OperatingMode.RECOVERY: RECOVERY_SPEED,
    OperatingMode.AUTOMATIC: None,
}
"""What a cap of the tool speed is held to [m/s]; None where the mode sets none."""

# Asked for each tick of each robot, and members of an enumeration are slow to look up.
_HELD, _RELEASED = EnablingPosition.HELD, EnablingPosition.RELEASED
_PANIC = EnablingPosition.PANIC
_POSITIONS = {position.value: position for position in EnablingPosition}

_MIRRORED = {
    ControllerMode.MANUAL: OperatingMode.MANUAL_REDUCED,
    ControllerMode.AUTO: OperatingMode.AUTOMATIC,
    # Nobody knows whether somebody stands inside the safeguard, so it is taken that one does.
    ControllerMode.UNKNOWN: OperatingMode.MANUAL_REDUCED,
}


class MotionKind(Enum):
    """The purpose of a motion; each mode allows some of them."""

    JOG = "a jog"
    MOVE = "a single motion"
    PROGRAM = "a program"
    ROS = "a ROS-Industrial trajectory"


def speed_fault(speed: float) -> Refusal | None:
    """Return why a speed is no fraction of the limits; None where it is one."""
    if 0 < speed <= 1:
        return None
    if not math.isfinite(speed):
        return Refusal(VerdictCode.NOT_FINITE, "the speed is not a finite number")
    text = f"speed {speed:g}; accepted: above 0, up to 1"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=speed, limit=1.0)


HeldPress = Callable[[int], int]
"""Returns the deadline of the press that a session holds [ns]; 0 where it holds none."""


def _no_press(session: int) -> int:
    return 0


@dataclass(slots=True)
class _Device:
    """The enabling device (training) of one connection.

    Attributes:
        heard: when [ns].
        armed: it was let go since the last stop, panic, silence or change of mode.
    """

    position: EnablingPosition = EnablingPosition.RELEASED
    heard: int = 0
    armed: bool = True


class OperatingModes:
    """The mode of one cell and what belongs to it.

    Attributes:
        override: fraction of the planned speed at which motions run: 0, at which nothing moves, or
            `LEAST_OVERRIDE` to 1.
    """

    def __init__(
        self, settings: Modes, tick_rate: int = 100, held_press: HeldPress = _no_press
    ) -> None:
        """Start in the configured mode, with nothing enabled.

        Args:
            tick_rate: of the server [Hz].
        """
        self.override = 1.0
        self._is_ours = settings.selector == "server"
        self._mode = OperatingMode[settings.initial.upper()]
        self._deadline_ns = round(settings.enabling_deadline * 1e9)
        self._declared: dict[int, int] = {}
        self._tick_ns = round(1e9 / tick_rate)
        self._held_press = held_press
        self._cap = REDUCED_SPEED
        self._devices: dict[int, _Device] = {}

    @property
    def is_ours(self) -> bool:
        """Whether the mode is set here; else the controller's own selector is mirrored."""
        return self._is_ours

    def mode(self, controller: ControllerMode) -> OperatingMode:
        """Return the mode of operation; the controller's own where its selector rules."""
        if self._is_ours:
            return self._mode
        return _MIRRORED.get(controller, OperatingMode.AUTOMATIC)

    def tool_speed_cap(self, controller: ControllerMode) -> float | None:
        """Return the largest speed of tool and elbow [m/s]; None where the mode sets none."""
        greatest = _GREATEST_CAPS[self.mode(controller)]
        return None if greatest is None else min(self._cap, greatest)

    def set_mode(self, mode: int) -> Refusal | OperatingMode:
        """Turn the selector; whoever enabled must let go and press again.

        To set the mode that is set already changes nothing, caps and enabling included.
        """
        if not self._is_ours:
            return Refusal(VerdictCode.MODE_NOT_OURS)
        try:
            wanted = OperatingMode(mode)
        except ValueError:
            accepted = ", ".join(f"{known.value} {known.name.lower()}" for known in OperatingMode)
            return Refusal(VerdictCode.BAD_ARGUMENT, f"mode {mode}; accepted: {accepted}")
        if wanted is not self._mode:
            self._mode = wanted
            # T2 begins at the reduced speed at each entry; raising it is a deliberate act.
            self._cap = REDUCED_SPEED
            self.disarm()
        return wanted

    def set_speed(
        self, override: float, tool_speed: float, controller: ControllerMode
    ) -> Refusal | None:
        """Set the override and, unless 0, the cap of the tool speed [m/s].

        Automatic takes no cap: what runs there may have been planned without one, or by somebody
        else (ROS-Industrial), so that nobody could hold it.

        Returns:
            Why a value is refused; then nothing was set.
        """
        if not (override == 0.0 or LEAST_OVERRIDE <= override <= 1.0):
            text = f"override {override:g}; accepted: 0, or {LEAST_OVERRIDE:g} to 1"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=override, limit=1.0)
        mode = self.mode(controller)
        if tool_speed > 0.0 and mode is OperatingMode.AUTOMATIC:
            text = (
                f"automatic knows no cap of the tool speed, not {tool_speed:g} m/s; accepted: 0, "
                "and a lower override, or plans with a tool_speed of their own"
            )
            return Refusal(VerdictCode.MODE_FORBIDS, text, value=tool_speed, limit=0.0)
        largest = 10.0 if mode is OperatingMode.MANUAL_HIGH else REDUCED_SPEED
        if not 0.0 <= tool_speed <= largest:
            text = f"tool speed {tool_speed:g} m/s; accepted in this mode: 0 to {largest:g}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=tool_speed, limit=largest)
        self.override = override
        if tool_speed:
            self._cap = tool_speed
        return None

    def override_fault(self) -> Refusal | None:
        """Return why nothing moves at this override; None above 0."""
        if self.override:
            return None
        text = f"the speed override is 0; accepted: {LEAST_OVERRIDE:g} to 1"
        return Refusal(VerdictCode.OVERRIDE_ZERO, text, value=0.0, limit=1.0)

    # Enabling (training).

    def enable(self, session: int, position: int, now: int) -> None:
        """Take note of the position of a connection's enabling device."""
        device = self._devices.get(session)
        if device is None:
            device = self._devices[session] = _Device()
        # A position that nobody knows enables nothing either.
        told = _POSITIONS.get(position, _PANIC)
        if told is _RELEASED:
            device.armed = True
        elif told is _PANIC:
            device.armed = False
        elif device.position is not _RELEASED and self._is_silent(session, device, now):
            # Silence while it was pressed was a release that nobody saw; a beat after it is no new
            # press.
            device.armed = False
        device.position = told
        device.heard = now

    def disarm(self) -> None:
        """Demand that enabling devices are let go and pressed again before the next motion."""
        for device in self._devices.values():
            device.armed = device.position is EnablingPosition.RELEASED

    def forget(self, session: int) -> None:
        """Release the device of a connection that ended."""
        self._devices.pop(session, None)
        self._declared.pop(session, None)

    def declare(self, session: int, deadline: float) -> None:
        """Let a connection's device count as let go after another silence [s]; 0 for the cell's."""
        if deadline:
            self._declared[session] = round(deadline * 1e9)
        else:
            self._declared.pop(session, None)

    def enabling_deadline(self, session: int) -> float:
        """Return after how long a silence a connection's device counts as let go [s]."""
        return self._silence_ns(session) / 1e9

    def _silence_ns(self, session: int) -> int:
        return self._declared.get(session, self._deadline_ns)

    def _is_silent(self, session: int, device: _Device, now: int) -> bool:
        deadline = self._silence_ns(session)
        press = self._held_press(session)
        if press:
            # Where key and device fall silent together, the press must end first: a ramp, no STOP.
            deadline = max(deadline, press) + self._tick_ns
        return now - device.heard >= deadline

    def enabling(self, session: int, now: int) -> EnablingPosition:
        """Return the position that a connection's device counts as; silence is a release."""
        device = self._devices.get(session)
        if device is None or self._is_silent(session, device, now):
            return _RELEASED
        return device.position

    def is_enabled(self, session: int, now: int) -> bool:
        """Return True if a connection holds its device half pressed, pressed anew since a stop."""
        device = self._devices.get(session)
        if device is None or not device.armed or device.position is not _HELD:
            return False
        return not self._is_silent(session, device, now)

    # What may move.

    def needs_enabling(self) -> bool:
        """Return True if the mode lets nothing move without an enabling device of ours."""
        return self._is_ours and self._mode is not OperatingMode.AUTOMATIC

    def forbids(self, kind: MotionKind, controller: ControllerMode) -> Refusal | None:
        """Return why the mode does not allow a kind of motion."""
        mode = self.mode(controller)
        if mode is OperatingMode.AUTOMATIC:
            # A controller that stands in automatic is jogged remotely, and its users are told so.
            barred = kind is MotionKind.JOG and self._is_ours
        elif mode is OperatingMode.RECOVERY:
            barred = kind is not MotionKind.JOG
        else:
            barred = kind is MotionKind.ROS and self._is_ours
        if not barred:
            return None
        return Refusal(
            VerdictCode.MODE_FORBIDS,
            f"{kind.value} is not allowed in {mode.name.lower().replace('_', ' ')}",
        )

    def not_enabled(self, session: int, now: int) -> Refusal | None:
        """Return why a connection's enabling device does not enable, where the mode asks for it."""
        if not self.needs_enabling() or self.is_enabled(session, now):
            return None
        where = self.enabling(session, now)
        again = "" if where is EnablingPosition.RELEASED else ", let it go first"
        text = f"the enabling device (training) is {where.name.lower()}{again}"
        return Refusal(VerdictCode.NOT_ENABLED, text)

    def unready(
        self, kind: MotionKind, session: int, controller: ControllerMode, now: int
    ) -> Refusal | None:
        """Return why a connection may not go on with a kind of motion, as far as the mode goes."""
        return (
            self.forbids(kind, controller)
            or self.not_enabled(session, now)
            or self.override_fault()
        )
