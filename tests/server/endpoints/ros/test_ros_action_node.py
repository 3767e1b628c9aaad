from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import worked_out
from rigs.peers.scripted_action_node import Goal, ScriptedActionNode
from rigs.peers.server_clients import RosClient

from openpendant.server.events.effects import Effect, LogLine
from openpendant.server.events.events import Port
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.verdicts import VerdictCode as V

JOINTS = 6
WAY = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Where the first joint goes on its way, from where it stood [rad]."""


class LoggedCell(EmulatedCell):
    def __init__(self) -> None:
        self.lines: list[str] = []
        super().__init__()

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        outgoing = worked_out(outgoing)
        self.lines += [item.text for item in outgoing if isinstance(item, LogLine)]
        return super().perform(outgoing)


class Stack:
    def __init__(self) -> None:
        self.cell = LoggedCell()
        self.motion: RosClient = self.cell.ros()
        self.state = self.cell.ros(port=Port.ROS_STATE)
        self.node = ScriptedActionNode(self.motion.stop)
        self._heard = 0
        self.run(100)
        self.start = self.cell.position

    def run(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.cell.wait(10)
            for message in self.state.got[self._heard :]:
                self.node.hear(message, self.cell.now)
            self._heard = len(self.state.got)
            self.node.tick(self.cell.now)

    def send_goal(self, *, duration: float = 0.5, offsets: tuple[float, ...] = WAY) -> None:
        points = [(self.start[0] + offset, *self.start[1:]) for offset in offsets]
        last = points[-1]
        assert self.node.send_goal(last, duration * len(points), self.cell.now)
        for number, point in enumerate(points):
            self.motion.point(number, *point, duration=duration, velocity=0.5)
            self.run(10)

    def goal_ends_within(self, milliseconds: int) -> Goal | None:
        for _ in range(0, milliseconds, 50):
            self.run(50)
            if self.node.goal is not Goal.ACTIVE:
                break
        return self.node.goal


@pytest.fixture
def stack() -> Stack:
    return Stack()


def test_a_goal_that_is_reached_succeeds(stack: Stack) -> None:
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED
    assert stack.cell.lines == []


def stop_by_a_pendant(stack: Stack) -> None:
    stack.cell.pendant().stop()


def lose_the_controller(stack: Stack) -> None:
    stack.cell.disconnect(ControllerPath.MOTION)
    stack.cell.connect(ControllerPath.MOTION)


def lose_the_link(stack: Stack) -> None:
    stack.motion.close()


def send_a_late_point(stack: Stack) -> None:
    stack.motion.point(len(WAY), *stack.start)


@pytest.mark.parametrize(
    ("happens", "code"),
    [
        (stop_by_a_pendant, V.STOPPED),
        (lose_the_controller, V.CONTROLLER_LOST),
        (lose_the_link, V.AUTHORITY_LOST),
        (send_a_late_point, V.SEQUENCE),
    ],
)
def test_a_goal_that_is_broken_off_is_aborted_within_1_1_s(
    stack: Stack, happens: Callable[[Stack], None], code: V
) -> None:
    stack.send_goal()
    stack.run(1_200)
    happens(stack)
    assert stack.goal_ends_within(1_100) is Goal.ABORTED
    (line,) = stack.cell.lines
    assert f"broken off, 3 of 5 points done: {code.name} ({code:d})" in line


def test_a_goal_that_is_refused_is_aborted(stack: Stack) -> None:
    stack.send_goal(offsets=(0.0, 9.0))
    assert stack.goal_ends_within(1_100) is Goal.ABORTED
    assert len(stack.cell.lines) == 1


def test_the_next_goal_is_taken_once_positions_come_again(stack: Stack) -> None:
    stack.send_goal(offsets=(0.0, 9.0))
    assert stack.goal_ends_within(1_600) is Goal.ABORTED
    stack.run(600)
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED


def test_a_goal_that_takes_the_place_of_a_refused_one_at_once_is_seen_to_its_end(
    stack: Stack,
) -> None:
    stack.send_goal(offsets=(0.0, 9.0))
    stack.run(300)
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED
