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
    ProgramState,
    State,
    StateField,
    StopChanged,
    StopKind,
)

from ..snapshot import JointFacts, Snapshot

STALE_NS = 300_000_000
"""A state that came longer ago is called stale, and nothing is jogged on it."""


@dataclass(slots=True)
class CellView:
    """One cell, as far as it is known.

    Attributes:
        is_connected: whether the connection to the pendant server stands.
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

    def connected(self, hello: HelloReply, snapshot: Snapshot) -> None:
        """Begin with a new connection: nothing of the last one counts any more."""
        self.is_connected, self.absence = True, ""
        self.robot, self.cell, self.session = hello.robot, hello.cell, hello.session
        self.joints = tuple(snapshot["joints"])
        named = (name for name in snapshot["frames"] if name not in ("base", "tool"))
        self.frames = ("base", "tool", *named)
        self.state = None
        owner, stop = snapshot["owner"], snapshot["stop"]
        self.owner = "" if owner is None else owner["client"]
        self.stopped_by = "" if stop is None else stop["client"]
        self.stop_reason = "" if stop is None else stop["reason"]

    def lost(self, reason: str) -> None:
        """The connection ended, or none came about; the last values stay, and are stale."""
        self.is_connected, self.absence = False, reason

    def take_state(self, state: State, now: int) -> None:
        """Take a state message that came [ns]."""
        self.state, self._heard = state, now

    def authority_changed(self, change: AuthorityChanged) -> None:
        """Take the news of who is in control now."""
        self.owner = change.client if change.holder else ""

    def stop_changed(self, change: StopChanged) -> None:
        """Take the news of a stop."""
        self.stopped_by, self.stop_reason = change.client, change.reason

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
