"""How fast a tool jog may be where a tick ends, by what is known of the way ahead.

Owns the reading of the places' reaches: in a cell the greatest square of dσ/dt is on the line
between those of its ends. Knows no joints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from .targets import LONGEST_STEP
from .way_node import WayNode

_SLACK = 1.0 - 1e-7


class Here(NamedTuple):
    """Where a motion is.

    Attributes:
        sigma: path parameter.
        speed: dσ/dt.
        cell: index of the cell that it is in.
    """

    sigma: float
    speed: float
    cell: int


Found = tuple[float, WayNode, bool]
"""A speed, the cell that sets it, and whether only the end of what is known so far does."""


def within_reach(nodes: Sequence[WayNode], here: Here, dt: float, asked: float) -> Found:
    """Return the greatest speed whose square is within reach where the tick ends.

    And half a tick of that speed farther, too: a tick in which the tool comes to rest takes
    s dt/2, more than s² over twice the deceleration, the way of a stop that ends within it.

    Args:
        nodes: the places of the way.
        here: where the tick begins.
        dt: its length [s].
        asked: the greatest speed that is wanted.
    """
    half = 0.5 * dt
    start = here.sigma + here.speed * half
    near = _after(nodes, here.cell, start, half, asked)
    far = _after(nodes, here.cell, start, half + 0.5 * LONGEST_STEP, asked)
    found = far if far[0] < near[0] else near
    passing = _passing(nodes, here, dt, found[0])
    return found if passing is None else passing


def _passing(nodes: Sequence[WayNode], here: Here, dt: float, speed: float) -> Found | None:
    """Return the speed that passes places within the tick no faster than allowed there.

    Asked about a speed at its end; None if that does. The square of the speed grows evenly with σ
    within a tick.
    """
    end = here.sigma + 0.5 * (here.speed + speed) * dt
    square = here.speed * here.speed
    found = None
    for index in range(here.cell + 1, len(nodes)):
        node = nodes[index]
        if node.sigma >= end:
            break
        if node.sigma <= here.sigma:
            continue
        gain = (node.reach - square) / (2.0 * (node.sigma - here.sigma))
        if here.speed + gain * dt < speed:
            speed = max(0.0, here.speed + gain * dt)
            found = speed, node, node.open
    return found


def _after(nodes: Sequence[WayNode], index: int, start: float, gain: float, asked: float) -> Found:
    """Return the greatest speed s with s² within reach at `start` + s gain.

    In a cell the reach is a line k + g σ, so s is the positive root of a quadratic.
    """
    best, node = 0.0, nodes[index]
    for at in range(index + 1, len(nodes)):
        after = nodes[at]
        slope = (after.reach - node.reach) / node.length
        linear = 0.5 * slope * gain
        root = linear * linear + node.reach + slope * (start - node.sigma)
        speed = linear + math.sqrt(root) if root > 0.0 else 0.0
        speed = 0.0 if speed < 0.0 else asked if speed > asked else speed
        end = start + speed * gain
        if end <= after.sigma:
            unknown = node.open or after.open
            return (speed if end >= node.sigma else best), node, unknown
        # It can be in the next cell: at the border at least.
        best = min(max(0.0, (after.sigma - start) / gain), asked)
        node = after
    return best, nodes[-2], nodes[-1].open


def steady_until(nodes: Sequence[WayNode], index: int, speed: float) -> float:
    """Return up to which σ a motion at a constant speed keeps to everything, from a cell on.

    To the reach at every place on the way, and to what the joints allow by `WayNode.steady`. So
    `within_reach` gives that speed for every tick whose end, and half a longest tick farther, is
    not beyond; and the bounds of `tick_bounds` hold between any two set-points up to there.
    """
    node, square = nodes[index], speed * speed
    until = node.sigma
    if node.reach < square:
        return until
    for at in range(index + 1, len(nodes)):
        if node.steady < square:
            break
        after = nodes[at]
        if after.reach < square:
            share = (node.reach - square) / (node.reach - after.reach)
            return node.sigma + _SLACK * share * node.length
        until, node = after.sigma, after
    return until
