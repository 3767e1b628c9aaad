"""A terminal pendant's core with a cell that a test sets up, and keys that a test strikes."""

from dataclasses import replace
from typing import Any

from rigs.peers.scripted_pendant_server import SESSION, state

from openpendant.simplemsg.pendant import HelloReply, ProgramReport, ProgramState
from openpendant.simplemsg.pendant.management.cell import JointFacts, Snapshot
from openpendant.tools.pendants.panel.commands import Command
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.panel.taught_program import DryRunFindings, TaughtProgram

MS = 1_000_000
S = 1_000 * MS

PROGRAM = TaughtProgram(
    "pick",
    3,
    ("move PTP home", "wait 2 s", "move LIN P1"),
    ("home", "", "P1"),
    ("home", "P1"),
    first_line=9,
)


DRY_RUN: dict[str, Any] = {
    "program": "pick",
    "revision": 3,
    "duration": 4.25,
    "endless": False,
    "complete": True,
    "refused": 0,
    "moves": [
        {"program": "pick", "line": 9, "point": "home", "zone_used": False, "reachable": True},
        {"program": "pick", "line": 11, "point": "P1", "zone_used": False, "reachable": True},
    ],
    "scene": [],
    "statements": [],
    "unchecked": [],
    "points": [{"point": "home", "reachable": True}, {"point": "P1", "reachable": True}],
    "not_walked": [],
    "path": [],
}
"""The server's answer about `PROGRAM`."""


def joint(name: str, unit: Any = "rad") -> JointFacts:
    return JointFacts(name=name, unit=unit, lower=-2.0, upper=2.0, velocity=1.0, acceleration=1.0)


def snapshot(dof: int = 6, **changes: Any) -> Snapshot:
    shot = Snapshot(
        cell="cell",
        robot="ur5",
        joints=[joint(f"joint {number}") for number in range(1, dof + 1)],
        frames=["base", "root", "table"],
        activity="idle",
        link="up",
        mode="auto",
        operating_mode="automatic",
        speed={"override": 1.0, "tool_speed_cap": None},
        tool=None,
        signals={"offered": False, "inputs": [], "outputs": []},
        recording=None,
        recording_problem="",
        program=None,
        owner=None,
        stop=None,
        obstacle="",
    )
    shot.update(changes)  # type: ignore[typeddict-item]
    return shot


HELLO = HelloReply(
    protocol_version=2,
    session=SESSION,
    capabilities=1023,
    max_frame=65_532,
    dof=6,
    tick_rate=100.0,
    max_state_rate=125.0,
    authority_timeout=3.0,
    cell="cell",
    robot="ur5",
    server="test",
)


class PanelRig:
    """A panel and its clock; the state is always fresh unless a test lets time pass alone."""

    def __init__(self, *, dof: int = 6, connected: bool = True) -> None:
        self.panel = Panel()
        self.now = 100 * S
        self._sequence = 0
        if connected:
            self.panel.cell.connected(HELLO, snapshot(dof))
            self.panel.connected()
            self.state()

    def state(self, **changes: Any) -> None:
        """Let a state come that differs from that of an idle cell in our control."""
        self._sequence += 1
        values = {"holder": SESSION, **changes}
        self.panel.cell.take_state(replace(state(self._sequence), **values), self.now)

    def runs(self, name: str, line: int, revision: int = 3, **changes: Any) -> None:
        """Let news of a program come, and a state that goes with it."""
        told = {"program_state": ProgramState.RUNNING, "program_line": line, **changes}
        report = ProgramReport(told["program_state"], line, 1, revision, name, "")
        self.panel.program_moved(report)
        self.state(**told)

    def open(self, program: TaughtProgram = PROGRAM) -> None:
        self.panel.opened(program)

    def walk(self, **changes: Any) -> None:
        """Let a dry run of the open program end; it refuses nothing unless a change says so."""
        program = self.panel.teaching.program
        assert program is not None
        answer = {**DRY_RUN, **changes}
        self.panel.teaching.walked(DryRunFindings.read(program.name, program.revision, answer))

    def strike(self, *keys: str) -> list[Command]:
        """Strike keys at one moment, and let a step leave that they make."""
        asked = [command for key in keys for command in self.panel.key(key, self.now)]
        return [*asked, *self.wait(100)]

    def wait(self, milliseconds: int, *, fresh: bool = True) -> list[Command]:
        """Let time pass in ticks of 20 ms, with a state in each of them."""
        asked: list[Command] = []
        for _ in range(0, milliseconds, 20):
            self.now += 20 * MS
            if fresh and self.panel.cell.state is not None:
                self.panel.cell.take_state(self.panel.cell.state, self.now)
            asked += self.panel.tick(self.now)
        return asked

    @property
    def said(self) -> str:
        return self.panel.messages.newest
