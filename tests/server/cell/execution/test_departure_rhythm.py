from __future__ import annotations

import bisect
import random
from collections import Counter
from heapq import heappop, heappush

from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.cells.server_rig import LIMITS
from rigs.data.example_counts import examples

from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.point_stream import PointStream
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import (
    HeaderOnly,
    JointFeedback,
    MsgType,
    Status,
    ValidField,
    joint_array,
)

MS = 1_000_000
TICK = 10 * MS
TRAJECTORY = plan_joint_move((0.0, 0.0), (1.8, -1.8), LIMITS)
TIMES = TRAJECTORY.times.tolist()
DONE = HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL)

BEGUN, ENDING = 20, 36
"""Ticks until the robot moves fast enough to be found on its way; and those at the end, in 25 of
which all has left ahead."""

SETTLING = 2
"""Ticks with no set-point or with two, where the rhythm happens to begin at its edge."""


def position_at(time: float) -> tuple[float, float]:
    """Return where a robot is that follows the trajectory exactly [rad]."""
    place = min(max(bisect.bisect_left(TIMES, time), 1), len(TIMES) - 1)
    share = min(max((time - TIMES[place - 1]) / (TIMES[place] - TIMES[place - 1]), 0.0), 1.0)
    before, after = TRAJECTORY.position[place - 1], TRAJECTORY.position[place]
    first, second = (before + share * (after - before)).tolist()
    return first, second


class Way:
    """A motion through links that take their time; events in the order of their times.

    Attributes:
        sent_in: how many set-points left from each tick until the next one.
    """

    def __init__(self, chance: random.Random, answered_after: int, seen_at: int) -> None:
        """Begin; the first tick and the first report come when chance has it.

        Args:
            chance: decides by how much less than 1 ms answers and reports are irregular.
            answered_after: so long after a set-point its answer comes [ns].
            seen_at: where between two samples a report sees the robot [ns].
        """
        link = ControllerLink()
        self.sent_in = Counter[int]()
        self._feedback = Feedback(2, link)
        self._uplink = GenericUplink(link, LIMITS.velocity)
        self._execution = PointStream(StoredRows(TRAJECTORY, LIMITS), LIMITS, self._uplink, link, 0)
        self._chance, self._answered_after, self._seen_at = chance, answered_after, seen_at
        self._events: list[tuple[int, str]] = []
        self._ticks = self._reports = 0
        self._report(0)
        self._send(0)
        heappush(self._events, (chance.randrange(1, TICK), "tick"))
        heappush(self._events, (seen_at + chance.randrange(TICK), "report"))

    def run(self, until: int) -> None:
        """Go on until a time [ns]."""
        while self._events[0][0] < until:
            now, what = heappop(self._events)
            match what:
                case "tick":
                    self._ticks += 1
                    assert self._execution.advance(self._feedback, now) is None
                    self._send(now)
                    heappush(self._events, (now + TICK, "tick"))
                case "answer":
                    self._uplink.answer(DONE, 0)
                    self._send(now)
                case _:
                    self._report(now + self._chance.randrange(MS))
                    heappush(self._events, (now + TICK, "report"))

    def _send(self, now: int) -> None:
        if self._execution.next_point(now) is not None:
            self.sent_in[self._ticks] += 1
            after = self._answered_after + self._chance.randrange(MS)
            heappush(self._events, (now + after, "answer"))

    def _report(self, now: int) -> None:
        at = position_at((self._reports * TICK + self._seen_at) / 1e9)
        self._reports += 1
        fields, speed = ValidField.POSITION | ValidField.VELOCITY, joint_array((1.0, 1.0))
        report = JointFeedback(0, fields, 0.0, joint_array(at), speed, joint_array(()))
        self._feedback.take(report, now)
        self._feedback.take(Status(1, 0, 0, 0, 1, 2, 1), now)


@settings(max_examples=examples(10, in_soak=5_000))
@given(
    chance=st.randoms(use_true_random=False),
    answered_after=st.integers(0, 4 * MS),
    seen_at=st.integers(0, 4 * MS) | st.integers(6 * MS, TICK),
)
def test_each_tick_sends_one_set_point(
    chance: random.Random, answered_after: int, seen_at: int
) -> None:
    """Seen midway between two samples a robot may count as at either, which may cost a tick."""
    way = Way(chance, answered_after, seen_at)
    way.run(round(TIMES[-1] * 1e9))
    sent = [way.sent_in[tick] for tick in range(BEGUN, len(TIMES) - ENDING)]
    held_up = [tick for tick, count in enumerate(sent, BEGUN) if count != 1]
    assert len(held_up) <= SETTLING, held_up
