"""What the terminal pendant knows of its cell, from the messages that came.

Owns freshness by its own clock, whose authority it is, and who stopped the robot. Decides nothing
and knows no screen.
"""

from __future__ import annotations

from dataclasses import dataclass, field

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

from ..snapshot import JointFacts, Snapshot

STALE_NS = 300_000_000
"""A state that came longer ago is called stale, and nothing is jogged on it."""


@dataclass(frozen=True, slots=True)
class ProgramPlace:
    """Where the run of a program is.

    Attributes:
        name: of the program, or of the one that it calls right now.
        revision: the one of that program that runs.
        line: its line in that program's text, from 1; 0 before the first statement.
    """

    name: str
    revision: int
    line: int


@dataclass(slots=True)
class CellView:
    """One cell, as far as it is known.

    Attributes:
        is_greeted: whether a server has answered our hello, and so takes a stop.
        is_connected: whether it has also let us in.
        absence: why it does not, and what happens next.
        robot: name of the robot.
        cell: name of the cell.
        session: number of our connection.
        joints: the driven joints, base to tip.
        frames: names of the frames to jog in, beside the joints.
        state: the newest state; None before the first.
        owner: name of the pendant in control; empty for nobody, or where it is not known.
        stopped_by: name of the pendant that stopped the robot last.
        stop_reason: why.
    """

    is_greeted: bool = False
    is_connected: bool = False
    absence: str = "connecting"
    robot: str = ""
    cell: str = ""
    session: int = 0
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
        """Take note that a server has answered hello; it has not let us in yet."""
        self.is_greeted, self.absence = True, "logging in"
        self._is_told = False

    def turned_away(self, reason: str) -> None:
        """Take note that the server does not let us in, or no longer; it still takes a stop."""
        self.is_connected, self.absence = False, reason

    def connected(self, hello: HelloReply, snapshot: Snapshot) -> None:
        """Begin with a new connection: nothing of the last one counts any more."""
        self.is_greeted = self.is_connected = True
        self.absence = ""
        self.robot, self.cell, self.session = hello.robot, hello.cell, hello.session
        self.joints = tuple(snapshot["joints"])
        named = (name for name in snapshot["frames"] if name not in ("base", "tool"))
        self.frames = ("base", "tool", *named)
        self.state = None
        owner, stop = snapshot["owner"], snapshot["stop"]
        self.owner = "" if owner is None else owner["client"]
        self.stopped_by = "" if stop is None else stop["client"]
        self.stop_reason = "" if stop is None else stop["reason"]
        run = snapshot["program"]
        if not self._is_told:  # a report may overtake the snapshot, and is never older
            place = None if run is None else ProgramPlace(run["name"], run["revision"], run["line"])
            self._place = place

    def lost(self, reason: str) -> None:
        """The connection ended, or none came about; the last values stay, and are stale."""
        self.is_greeted = self.is_connected = False
        self.absence = reason

    def take_state(self, state: State, now: int) -> None:
        """Take a state message that came [ns]."""
        self.state, self._heard = state, now

    def authority_changed(self, change: AuthorityChanged) -> None:
        """Take the news of who is in control now."""
        self.owner = change.client if change.holder else ""

    def stop_changed(self, change: StopChanged) -> None:
        """Take the news of a stop."""
        self.stopped_by, self.stop_reason = change.client, change.reason

    def program_moved(self, report: ProgramReport) -> None:
        """Take the news of where the run of a program is."""
        ended = report.state == ProgramState.NONE
        place = ProgramPlace(report.program, report.revision, report.line)
        self._place, self._is_told = None if ended else place, True

    def message_age(self, now: int) -> float | None:
        """Return how long ago the newest state message came [s]; None before the first."""
        return None if self.state is None else (now - self._heard) / 1e9

    def age(self, now: int) -> float | None:
        """Return the age of what is shown [s]: of the message, and of the report in it."""
        age = self.message_age(now)
        return None if age is None or self.state is None else age + max(self.state.age, 0.0)

    def is_silent(self, now: int) -> bool:
        """Tell whether the server has said nothing of late."""
        return self.state is None or not self.is_connected or now - self._heard > STALE_NS

    def is_stale(self, now: int) -> bool:
        """Tell whether what is shown may not be how the robot stands."""
        state = self.state
        if state is None or self.is_silent(now) or state.link != LinkState.UP:
            return True
        return not 0.0 <= state.age <= STALE_NS / 1e9

    @property
    def dof(self) -> int:
        """Driven joints."""
        return len(self.joints)

    @property
    def in_control(self) -> bool:
        """Whether we hold the motion authority."""
        return self.is_connected and self.state is not None and self.state.holder == self.session

    @property
    def is_stopped(self) -> bool:
        """Whether a stop is latched."""
        return self.state is not None and self.state.stop != StopKind.NONE

    @property
    def is_paused(self) -> bool:
        """Whether a motion or a program stands that `Resume` would let go on."""
        if self.state is None:
            return False
        program = (ProgramState.PAUSED, ProgramState.AT_BREAKPOINT, ProgramState.STEPPED)
        paused = (Activity.PAUSED, Activity.PAUSING)
        return self.state.activity in paused or self.state.program_state in program

    @property
    def program_place(self) -> ProgramPlace | None:
        """Where the run of a program is; None where none is under way, or it is not known."""
        if self.state is None or self.state.program_state == ProgramState.NONE:
            return None
        return self._place

    @property
    def positions(self) -> tuple[float, ...] | None:
        """The joint positions [rad, m]; None where they are not known."""
        if self.state is None or not self.state.valid_fields & StateField.POSITION:
            return None
        return self.state.positions[: self.dof]

    @property
    def knows_tool(self) -> bool:
        """Whether the tool's pose is known."""
        return self.state is not None and bool(self.state.valid_fields & StateField.TOOL)

    @property
    def mode(self) -> OperatingMode | None:
        """The mode of operation; None where it is not known."""
        known = self.state is not None and self.state.operating_mode in set(OperatingMode)
        return OperatingMode(self.state.operating_mode) if self.state and known else None
