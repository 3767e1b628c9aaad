"""Frame history: transforms between any two frames, now or at a time in the past.

Owns the time-stamped samples of moving frames, how long they are kept, and the interpolation
between them. Each tree is kept with the time since which it holds, so a transform of the past uses
the frames and the tool of that time. Memory is bounded by a span and a number of samples. Knows no
clock: times are integer nanoseconds of one clock, given by the caller, never going back.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Mapping
from itertools import islice
from typing import Generic, TypeVar

from ..errors import BadArgument, NotInHistory
from ..pose import Pose
from .frame_tree import BASE, FrameTree

SPAN = 10_000_000_000
"""Default span of the history [ns]."""

MOST_SAMPLES = 4096
"""Default number of samples of one frame that are kept."""

_Value = TypeVar("_Value")


class _Samples(Generic[_Value]):
    """Values with their times [ns], oldest first.

    Of the samples older than the span the newest is kept, so that the span is covered to its end.
    """

    def __init__(self, span: int, most: int) -> None:
        self.span = span
        self._kept: deque[tuple[int, _Value]] = deque(maxlen=most)

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def oldest(self) -> int | None:
        return self._kept[0][0] if self._kept else None

    @property
    def newest(self) -> int | None:
        return self._kept[-1][0] if self._kept else None

    @property
    def last(self) -> _Value | None:
        return self._kept[-1][1] if self._kept else None

    def append(self, time: int, value: _Value) -> None:
        self._kept.append((time, value))
        while len(self._kept) > 1 and self._kept[1][0] <= time - self.span:
            self._kept.popleft()

    def around(self, time: int) -> list[tuple[int, _Value]]:
        """Return the sample at or before a time and the one after; [] before the oldest."""
        after = bisect_right(self._kept, time, key=lambda sample: sample[0])
        return list(islice(self._kept, after - 1, after + 1)) if after else []


class FrameHistory:
    """Frame tree over time, for one thread at a time.

    Moving frames have a straight path and an even rotation between two samples (linear position,
    slerp). A gap in the samples is interpolated in the same way, however long it is.

    Raises:
        FrameUnknown: in every method, for a frame that there is not, or was not at the time.
    """

    def __init__(
        self, tree: FrameTree, time: int = 0, *, span: int = SPAN, most_samples: int = MOST_SAMPLES
    ) -> None:
        """Start with a tree.

        Args:
            tree: the frames; it also holds for any earlier time.
            time: time of the tree [ns].
            span: span of a frame's history before its newest sample [ns].
            most_samples: of one frame; the oldest are dropped first, and the history is then
                shorter.

        Raises:
            BadArgument: the span or the number of samples is less than 1 or 2.
        """
        if span < 1:
            raise BadArgument("span", span, "1 ns or more")
        if most_samples < 2:
            raise BadArgument("most_samples", most_samples, "2 or more")
        self._span, self._most = span, most_samples
        self._places: dict[str, _Samples[Pose]] = {}
        self._trees: _Samples[FrameTree] = _Samples(span, most_samples)
        self._trees.append(time, tree)
        self._first = tree

    @property
    def tree(self) -> FrameTree:
        """Frames as they are now."""
        return self._trees.last or self._first

    def define(self, time: int, tree: FrameTree) -> None:
        """Make another tree hold from a time on; drop samples of frames that it does not have.

        Raises:
            BadArgument: the time is before that of the tree now.
        """
        self._check_order("time", time, self._trees.newest)
        self._trees.append(time, tree)
        self._places = {
            name: samples
            for name, samples in self._places.items()
            if name in tree.frames and tree[name].moving
        }

    def record(self, time: int, places: Mapping[str, Pose]) -> None:
        """Record the poses of moving frames; all of them or, if refused, none.

        Args:
            time: [ns], later than the last of each of these frames.
            places: each frame in its parent.

        Raises:
            BadArgument: a frame does not move, or the time is not later.
        """
        for name in places:
            if not self.tree[name].moving:
                raise BadArgument("places", name, "frames that move")
            if (samples := self._places.get(name)) and samples.newest is not None:
                self._check_order(f"time of {name!r}", time, samples.newest + 1)
        for name, pose in places.items():
            samples = self._places.setdefault(name, _Samples(self._span, self._most))
            samples.append(time, pose)

    def transform(self, source: str, target: str, time: int | None = None) -> Pose:
        """Return the pose of the frame `source` in the frame `target`, now or at a time.

        Args:
            time: [ns]; None for the newest pose of every frame.

        Raises:
            NotInHistory: a frame between the two moves, and the time is not in its history.
        """
        tree = self.tree if time is None else self._tree_at(time)
        places = {name: self._place(name, time) for name in tree.moving_between(source, target)}
        return tree.transform(source, target, places)

    def transform_between_times(
        self, source: str, source_time: int, target: str, target_time: int, still: str = BASE
    ) -> Pose:
        """Return the pose of `source` at one time in the `target` of another time.

        Args:
            source_time: [ns].
            target_time: [ns].
            still: the frame that is assumed not to have moved between the two times.

        Raises:
            NotInHistory: a time is not in the history of a frame that moves.
        """
        was = self.transform(source, still, source_time)
        return self.transform(target, still, target_time).inverse().compose(was)

    def covered(self, name: str) -> tuple[int, int] | None:
        """Return the times [ns] of a moving frame's oldest and newest sample, or None."""
        samples = self._places.get(self.tree[name].name)
        if samples is None or samples.oldest is None or samples.newest is None:
            return None
        return samples.oldest, samples.newest

    def _tree_at(self, time: int) -> FrameTree:
        held = self._trees.around(time)
        return held[0][1] if held else self._first

    def _place(self, name: str, time: int | None) -> Pose:
        samples = self._places.get(name)
        if samples is None or samples.newest is None or samples.last is None:
            raise NotInHistory(name, time or 0, None, None)
        if time is None:
            return samples.last
        around = samples.around(time)
        if not around or time > samples.newest:
            raise NotInHistory(name, time, samples.oldest, samples.newest)
        (before, pose), *rest = around
        if time == before or not rest:
            return pose
        ((after, next_pose),) = rest
        return pose.interpolate(next_pose, (time - before) / (after - before))

    @staticmethod
    def _check_order(what: str, time: int, least: int | None) -> None:
        if least is not None and time < least:
            raise BadArgument(what, time, f"{least} ns or later")
