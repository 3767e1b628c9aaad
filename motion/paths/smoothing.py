"""Smoothing of manual recordings: a smooth path with few knots, within a tolerance.

Owns the cleaning of recorded times, the least-squares curve through the samples, the choice of its
knots, and the rules for playback at another speed. Knows no timing: the path and the rules are
inputs of `parameterization.time_path`. Joint vectors are controller-side driven joints in file
order.

The curve is a cubic B-spline over the time of recording (de Boor, "A Practical Guide to Splines",
1978), fitted to all samples by least squares, which averages noise out over each span between
knots. It starts with few knots; a span is halved while a sample in it lies further from the path
than the tolerance. The path is the joint spline through the curve's places at the knots, and the
deviation reported is measured from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..description.limits import JointLimits
from ..errors import BadArgument, NoMotion, NotFinite, WrongJointCount
from ..pose import Array
from ..trajectory.joint_curves import Indices, JointSpline
from ..trajectory.trajectory import MAX_DURATION
from .segments import SegmentRule

SLOWEST, FASTEST = 0.1, 4.0
"""Playback speeds, relative to the recording."""

_FIRST_SPAN = 1.0  # s between knots at first
_MOST_ROUNDS = 30
_DENSITY = 8  # places on each piece of the path compared with a sample
_ORDER = 4  # of the B-splines: cubic


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedRecording:
    """Recording as a path.

    Attributes:
        path: the joint spline; its waypoints are the curve's places at the knots.
        knot_times: (w,) time at which the recording passed each waypoint, from its first sample
            [s].
        deviation: greatest distance of a sample from the path, in any joint [rad or m].
        samples: number of samples used.
        dropped: number of samples left out, because their time did not advance.
    """

    path: JointSpline
    knot_times: Array
    deviation: float
    samples: int
    dropped: int

    def segment_rules(self, playback: float = 1.0) -> list[SegmentRule]:
        """Return the rules of a playback that is as fast as the limits allow but no faster.

        Args:
            playback: speed relative to the recording, 0.1 to 4.

        Raises:
            BadArgument: the playback speed.
        """
        if not SLOWEST <= playback <= FASTEST:
            raise BadArgument("playback", playback, f"{SLOWEST:g} to {FASTEST:g}")
        spans: list[float] = np.diff(self.knot_times).tolist()
        return [SegmentRule(min_duration=span / playback) for span in spans]


def smooth(
    times: Sequence[float] | Array,
    positions: Sequence[Sequence[float]] | Array,
    tolerance: float,
    limits: JointLimits | None = None,
) -> SmoothedRecording:
    """Return a recording as a path.

    Args:
        times: (m,) time of each sample [s]; a sample whose time does not advance is dropped.
        positions: (m, n) the samples [rad or m].
        tolerance: greatest distance of a sample from the path in any joint [rad or m]. To remove
            noise it must exceed the noise; three times its deviation is a good choice.
        limits: ranges that the path must obey. Samples that noise puts outside are put on the
            bound.

    Raises:
        BadArgument: the tolerance, the number of times, or a recording longer than an hour.
        NotFinite: a time or a sample holds an infinity or a NaN.
        WrongJointCount: a sample does not have one value per joint.
        NoMotion: all samples are one place.
        OutOfRange: a sample is outside a joint's range by more than the tolerance, or the path
            leaves it between its knots.
    """
    if not (math.isfinite(tolerance) and tolerance >= 1e-5):
        raise BadArgument("tolerance", tolerance, "0.00001 rad or m, or more")
    clock, samples, dropped = _cleaned(times, positions)
    if limits is not None:
        _check_samples(samples, tolerance, limits)
    if np.ptp(samples, axis=0).max() <= tolerance:
        raise NoMotion
    spans = max(math.ceil(clock[-1] / _FIRST_SPAN), 1)
    knots = np.unique(np.searchsorted(clock, np.linspace(0.0, clock[-1], spans + 1)))
    for _ in range(_MOST_ROUNDS):
        path, deviations = _fitted(clock, samples, knots, limits)
        rough = _rough_spans(knots, deviations > tolerance)
        added = (knots[:-1] + knots[1:])[rough] // 2
        more = np.union1d(knots, added)
        if len(more) == len(knots):
            break
        knots = more
    deviation = float(deviations.max())
    if not deviation <= tolerance:
        raise BadArgument("tolerance", tolerance, f"{deviation:.3g} or more for this recording")
    return SmoothedRecording(path, clock[knots], deviation, len(clock), dropped)


def _cleaned(
    times: Sequence[float] | Array, positions: Sequence[Sequence[float]] | Array
) -> tuple[Array, Array, int]:
    """Return (m,) increasing times from 0, the (m, n) samples there, and how many were dropped."""
    if len(times) != len(positions) or len(times) < 2:
        raise BadArgument(
            "times", len(times), f"one for each of {len(positions)} samples, 2 or more"
        )
    for row in positions:
        if len(row) != len(positions[0]):
            raise WrongJointCount(len(row), len(positions[0]))
    clock, samples = np.array(times, dtype=np.float64), np.array(positions, dtype=np.float64)
    for values, what in ((clock, "the times"), (samples, "the recorded positions")):
        finite = np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if not finite.all():
            raise NotFinite(what, int(np.argmin(finite)))
    latest = np.maximum.accumulate(clock)
    kept = np.append(True, clock[1:] > latest[:-1])
    dropped = int(len(clock) - kept.sum())
    clock, samples = clock[kept] - clock[0], samples[kept]
    if len(clock) < 2 or clock[-1] > MAX_DURATION:
        raise BadArgument("times", float(clock[-1]), f"more than 0 and up to {MAX_DURATION:g} s")
    return clock, samples, dropped


def _check_samples(samples: Array, tolerance: float, limits: JointLimits) -> None:
    if samples.shape[1] != limits.dof:
        raise WrongJointCount(samples.shape[1], limits.dof)
    inside = np.clip(samples, limits.lower, limits.upper)
    outside = np.abs(samples - inside).max(axis=1) > tolerance
    if outside.any():
        limits.check_position(samples[int(np.argmax(outside))].tolist())


def _fitted(
    clock: Array, samples: Array, knots: Indices, limits: JointLimits | None
) -> tuple[JointSpline, Array]:
    """Return the path with given knots, and the (m,) distances of the samples from it."""
    points = _curve_at_knots(clock, samples, clock[knots])
    if limits is not None:
        points = np.clip(points, limits.lower, limits.upper)
    path = JointSpline(points, limits)
    deviations = _deviations(path, knots, samples)
    # Distance from the path is not enough at its ends: a path that overshoots the place where the
    # recording stood still passes near every sample.
    for end in (0, -1):
        beyond = float(np.abs(points[end] - samples[end]).max())
        deviations[end] = max(float(deviations[end]), beyond)
    return path, deviations


def _curve_at_knots(clock: Array, samples: Array, knots: Array) -> Array:
    """Return the (k, n) places at the knots of the least-squares cubic through the samples."""
    first, basis = _basis(knots, clock)
    count = len(knots) + _ORDER - 2
    normal = np.zeros((count, _ORDER))
    right = np.zeros((count, samples.shape[1]))
    for i in range(_ORDER):
        np.add.at(right, first + i, basis[:, i, np.newaxis] * samples)
        for j in range(i, _ORDER):
            np.add.at(normal[:, j - i], first + i, basis[:, i] * basis[:, j])
    # Where there are fewer samples than splines, the smoothest of the solutions.
    normal[:, 0] += 1e-9 * normal[:, 0].max()
    control = _solve_banded(normal, right)
    first, basis = _basis(knots, knots)
    columns = first[:, np.newaxis] + np.arange(_ORDER)
    points: Array = np.einsum("mi,min->mn", basis, control[columns])
    return points


def _basis(knots: Array, at: Array) -> tuple[Indices, Array]:
    """Return the B-splines at each time by Cox and de Boor: (m,) first index, (m, 4) values."""
    padded = np.concatenate((knots[:1].repeat(_ORDER - 1), knots, knots[-1:].repeat(_ORDER - 1)))
    first = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    values = np.zeros((len(at), _ORDER))
    values[:, 0] = 1.0
    for order in range(1, _ORDER):
        carried = np.zeros(len(at))
        for i in range(order):
            right = padded[first + _ORDER + i]
            left = padded[first + _ORDER + i - order]
            share = values[:, i] / (right - left)
            values[:, i] = carried + (right - at) * share
            carried = (at - left) * share
        values[:, order] = carried
    return first, values


def _solve_banded(normal: Array, right: Array) -> Array:
    """Solve a symmetric positive definite system of half bandwidth 3, by Cholesky's L D Lᵀ.

    Row i of `normal`, (k, 4), holds the elements (i, i) to (i, i + 3).
    """
    rows = normal.tolist()
    solution = right.copy()
    count = len(rows)
    for i in range(count):
        pivot = rows[i][0]
        for j in range(1, min(_ORDER, count - i)):
            factor = rows[i][j] / pivot
            for k in range(j, min(_ORDER, count - i)):
                rows[i + j][k - j] -= factor * rows[i][k]
            solution[i + j] -= factor * solution[i]
    for i in reversed(range(count)):
        for j in range(1, min(_ORDER, count - i)):
            solution[i] -= rows[i][j] * solution[i + j]
        solution[i] /= rows[i][0]
    return solution


def _deviations(path: JointSpline, knots: Indices, samples: Array) -> Array:
    """Return for each sample the distance to the path near it, the greatest over the joints.

    A sample is compared with the pieces of its own span and of the neighbouring spans.
    """
    density = _DENSITY * np.arange(len(path.knots) - 1)
    s = path.knots[:-1, np.newaxis] + np.diff(path.knots)[:, np.newaxis] * (
        np.arange(_DENSITY) / _DENSITY
    )
    places = path.evaluate(np.append(s.ravel(), path.length))
    span = np.clip(np.searchsorted(knots, np.arange(len(samples)), side="right") - 1, 0, None)
    piece = np.minimum(path.waypoint_knots[np.minimum(span, len(knots) - 2)], len(density) - 1)
    nearest = np.full(len(samples), math.inf)
    for offset in range(-_DENSITY, 2 * _DENSITY):
        begin = np.clip(density[piece] + offset, 0, len(places) - 2)
        way = places[begin + 1] - places[begin]
        from_begin = samples - places[begin]
        along = np.einsum("mn,mn->m", from_begin, way) / np.maximum(
            np.einsum("mn,mn->m", way, way), 1e-300
        )
        beside = np.abs(from_begin - np.clip(along, 0.0, 1.0)[:, np.newaxis] * way).max(axis=1)
        nearest = np.minimum(nearest, beside)
    return nearest


def _rough_spans(knots: Indices, beyond: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each span between knots True if one of its samples is beyond the tolerance."""
    counts = np.concatenate(([0], np.cumsum(beyond)))
    rough: NDArray[np.bool_] = counts[knots[1:] + 1] > counts[knots[:-1]]
    return rough
