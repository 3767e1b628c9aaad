"""Where the joints were in the last seconds, and where that put the flange.

Owns how far back it reaches. The flange is worked out when somebody asks, because nobody asks for
nearly all of the samples.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from itertools import islice

from openpendant.motion.frame_history import SPAN, FrameHistory
from openpendant.motion.frames import FLANGE, FrameTree
from openpendant.motion.pose import Pose

MOST_REPORTS = 2_500
"""Ten seconds at 250 Hz."""

JointVector = tuple[float, ...]


class JointHistory:
    """The joint positions of the last ten seconds, and the frames that held meanwhile."""

    def __init__(self, flange: Callable[[JointVector], Pose], tree: FrameTree) -> None:
        """Begin with no report.

        Args:
            flange: the flange in base at (n,) joints.
            tree: the frames; they also hold for any earlier time.
        """
        self._flange = flange
        self._reports: deque[tuple[int, JointVector]] = deque(maxlen=MOST_REPORTS)
        self._trees: deque[tuple[int, FrameTree]] = deque([(0, tree)])

    def reported(self, time: int, position: JointVector) -> None:
        """Take a report of the controller; one of the same time is taken once."""
        if self._reports and time <= self._reports[-1][0]:
            return
        self._reports.append((time, position))
        while self._reports[0][0] < time - SPAN:
            self._reports.popleft()

    def define(self, time: int, tree: FrameTree) -> None:
        """Let other frames hold from a time on."""
        self._trees.append((time, tree))
        while len(self._trees) > 1 and self._trees[1][0] <= time - SPAN:
            self._trees.popleft()

    def transform(self, source: str, target: str, time: int | None = None) -> Pose:
        """Return where the frame `source` is, or was, in the frame `target`.

        Args:
            source: the frame that something is given in.
            target: the frame that it is wanted in.
            time: [ns]; None for the last report, in the frames as they are now.

        Raises:
            FrameUnknown: there is, or was, no such frame.
            NotInHistory: a frame between the two moves, and the time is not in the history.
        """
        at = self._reports[-1][0] if time is None and self._reports else time
        history = FrameHistory(self._tree_at(time))
        for when, position in self._around(at):
            history.record(when, {FLANGE: self._flange(position)})
        return history.transform(source, target, at)

    def _tree_at(self, time: int | None) -> FrameTree:
        if time is None:
            return self._trees[-1][1]
        held = [tree for since, tree in self._trees if since <= time]
        return held[-1] if held else self._trees[0][1]

    def _around(self, time: int | None) -> list[tuple[int, JointVector]]:
        """Return the reports at or before and after a time; the ends where it is outside."""
        if time is None or not self._reports:
            return []
        after = bisect_right(self._reports, time, key=lambda report: report[0])
        first = min(max(after - 1, 0), len(self._reports) - 1)
        return list(islice(self._reports, first, first + 2))
