"""View of the cell: the state of the cell as the terminal pendant received it.

Owns the age of the values by the pendant's own clock, the owner of the authority, and who stopped
the robot. Decides nothing and knows no screen.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.simplemsg import JOINT_SLOTS
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityChanged,
    HelloReply,
    LinkState,
    OperatingMode,
    ProgramReport,
    ProgramState,
    State,
    StateField,
    StopChanged,
    StopKind,
)
from openpendant.simplemsg.pendant.management.cell import JointFacts, ProgramUnderWay, Snapshot

from ..connection_errors import NotUnderstood

STALE_NS = 300_000_000
"""A state that came longer ago is called stale, and nothing is jogged on it."""


@dataclass(frozen=True, slots=True)
class ProgramPlace:
    """The present line of a program's run.

    Attributes:
        name: of the program, or of the called program that runs now.
        revision: the running revision of that program.
        line: its line in that program's text, from 1; 0 before the first statement.
    """

    name: str
    revision: int
    line: int


def _joint(told: JointFacts) -> JointFacts:
    """Return a joint of a snapshot whose names and limits are such."""
    if told["unit"] not in ("rad", "m"):
        raise ValueError(told["unit"])
    lower, upper = float(told["lower"]), float(told["upper"])
    name = str(told["name"])
    shown = str(told.get("display_name") or name)
    return {**told, "name": name, "display_name": shown, "lower": lower, "upper": upper}


def _place(told: ProgramUnderWay) -> ProgramPlace:
    return ProgramPlace(str(told["name"]), int(told["revision"]), int(told["line"]))


@dataclass(slots=True)
class CellView:
    """One cell as the received messages describe it.

    Attributes:
        is_greeted: a server has answered our hello, and so accepts a stop.
        is_connected: the login has succeeded, too.
        absence: why there is no connection, and what happens next.
        names_as_in_file: joints are called as in the robot file, not as people call them.
        joints: the driven joints, base to tip.
        frames: names of the frames to jog in, beside the joints.
        state: the newest state; None before the first.
        owner: name of the pendant in control; empty for nobody, or if it is not known.
    """

    is_greeted: bool = False
    is_connected: bool = False
    absence: str = "connecting"
    robot: str = ""
    cell: str = ""
    session: int = 0
    names_as_in_file: bool = False
    joints: tuple[JointFacts, ...] = ()
    frames: tuple[str, ...] = ("base", "tool")
    state: State | None = None
    owner: str = ""
    stopped_by: str = ""
    stop_reason: str = ""
    _heard: int = field(default=0)
    _place: ProgramPlace | None = field(default=None)
    _is_told: bool = field(default=False)

    def greeted(self) -> None:
        """Take the hello reply of a server; the login is still pending."""
        self.is_greeted, self.absence = True, "logging in"
        self._is_told = False

    def turned_away(self, reason: str) -> None:
        """Take a refused or ended login; the server still accepts a stop."""
        self.is_connected, self.absence = False, reason

    def connected(self, hello: HelloReply, snapshot: Snapshot) -> None:
        """Start with a new connection: discard everything of the last one.

        Raises:
            NotUnderstood: the snapshot lacks something, or has something else in its place.
        """
        try:
            self._read(snapshot)
        except (KeyError, TypeError, ValueError) as error:
            text = f"the server's snapshot cannot be read ({error!r}); is it another version?"
            raise NotUnderstood(text) from None
        self.is_greeted = self.is_connected = True
        self.absence = ""
        self.robot, self.cell, self.session = hello.robot, hello.cell, hello.session
        self.state = None

    def _read(self, snapshot: Snapshot) -> None:
        joints = tuple(map(_joint, snapshot["joints"]))
        if len(joints) > JOINT_SLOTS:
            raise ValueError(f"{len(joints)} joints")
        named = (str(name) for name in snapshot["frames"] if name not in ("base", "tool"))
        frames = ("base", "tool", *named)
        owner, stop, run = snapshot["owner"], snapshot["stop"], snapshot["program"]
        place = None if run is None else _place(run)
        holder = "" if owner is None else str(owner["client"])
        by, why = ("", "") if stop is None else (str(stop["client"]), str(stop["reason"]))
        self.joints, self.frames, self.owner = joints, frames, holder
        self.stopped_by, self.stop_reason = by, why
        if not self._is_told:  # a report may overtake the snapshot, and is never older
            self._place = place

    def lost(self, reason: str) -> None:
        """Take the end of the connection or a failed attempt; the last values stay, stale."""
        self.is_greeted = self.is_connected = False
        self.absence = reason

    def name_of(self, joint: JointFacts) -> str:
        """Return what a joint is called on this pendant."""
        if self.names_as_in_file:
            return joint["name"]
        return joint.get("display_name", joint["name"])

    def take_state(self, state: State, now: int) -> None:
        """Take a state message received at `now` [ns]."""
        self.state, self._heard = state, now

    def authority_changed(self, change: AuthorityChanged) -> None:
        """Take the event that another pendant is in control."""
        self.owner = change.client if change.holder else ""

    def stop_changed(self, change: StopChanged) -> None:
        """Take the event of a stop."""
        self.stopped_by, self.stop_reason = change.client, change.reason

    def program_moved(self, report: ProgramReport) -> None:
        """Take the report of a program's present line."""
        ended = report.state == ProgramState.NONE
        place = ProgramPlace(report.program, report.revision, report.line)
        self._place, self._is_told = None if ended else place, True

    def message_age(self, now: int) -> float | None:
        """Return the age of the newest state message [s]; None before the first."""
        return None if self.state is None else (now - self._heard) / 1e9

    def age(self, now: int) -> float | None:
        """Return the age of the shown values [s]: of the message plus the report in it."""
        age = self.message_age(now)
        return None if age is None or self.state is None else age + max(self.state.age, 0.0)

    def is_silent(self, now: int) -> bool:
        """Return True if no message of the server arrived recently."""
        return self.state is None or not self.is_connected or now - self._heard > STALE_NS

    def is_stale(self, now: int) -> bool:
        """Return True if the shown values may differ from the robot's present state."""
        state = self.state
        if state is None or self.is_silent(now) or state.link != LinkState.UP:
            return True
        return not 0.0 <= state.age <= STALE_NS / 1e9

    @property
    def dof(self) -> int:
        """Number of driven joints."""
        return len(self.joints)

    @property
    def in_control(self) -> bool:
        """True while this pendant holds the motion authority."""
        return self.is_connected and self.state is not None and self.state.holder == self.session

    @property
    def is_stopped(self) -> bool:
        """True while a stop is latched."""
        return self.state is not None and self.state.stop != StopKind.NONE

    @property
    def is_paused(self) -> bool:
        """True while a motion or a program is paused that `ResumeRobot` would continue."""
        if self.state is None:
            return False
        program = (ProgramState.PAUSED, ProgramState.AT_BREAKPOINT, ProgramState.STEPPED)
        paused = (Activity.PAUSED, Activity.PAUSING)
        return self.state.activity in paused or self.state.program_state in program

    @property
    def program_place(self) -> ProgramPlace | None:
        """The present line of the running program; None if none runs, or it is not known."""
        if self.state is None or self.state.program_state == ProgramState.NONE:
            return None
        return self._place

    @property
    def positions(self) -> tuple[float, ...] | None:
        """The joint positions [rad, m]; None if they are not known."""
        if self.state is None or not self.state.valid_fields & StateField.POSITION:
            return None
        # A state may come before the snapshot that names the joints.
        return self.state.positions[: self.dof] or None

    @property
    def knows_tool(self) -> bool:
        """True while the tool's pose is known."""
        return self.state is not None and bool(self.state.valid_fields & StateField.TOOL)

    @property
    def mode(self) -> OperatingMode | None:
        """The mode of operation; None if it is not known."""
        known = self.state is not None and self.state.operating_mode in set(OperatingMode)
        return OperatingMode(self.state.operating_mode) if self.state and known else None
