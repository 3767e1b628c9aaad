"""Subproblems of closed forms: small trigonometric problems in plain scalars.

Owns the solutions of three problems: rotating a point about an axis until it lies in a plane beside
that axis, placing the end of two links in a plane, and splitting a rotation into three angles. They
are the subproblems of Paden and Kahan (see Murray, Li, Sastry: A Mathematical Introduction to
Robotic Manipulation, 1994, section 3.3) in the coordinates of Brandstötter, Angerer and Hofbaur (An
Analytical Solution of the Inverse Kinematics Problem of Industrial Serial Manipulators with an
Ortho-parallel Basis and a Spherical Wrist, 2014). Knows no robot.

A problem without a solution returns the nearest miss and its distance, the gap. Scalars, since
numpy's fixed cost per call would be most of a solution's time.
"""

from __future__ import annotations

import math

FREE = 1e-9
"""Below this [m, or no unit for a sine], an angle is undetermined and its preferred value kept."""


def turn_into_plane(
    x: float, y: float, beside: float, preferred: float
) -> tuple[float, tuple[tuple[float, float], tuple[float, float]]]:
    """Return the rotations about z after which a plane's points (s, beside) cover a point.

    Solves Rz(angle) (s, beside) = (x, y) for the angle and s.

    Args:
        x: first coordinate of the point [m].
        y: second coordinate of the point [m].
        beside: distance of the plane from the axis [m], with its sign.
        preferred: the angle used where the point lies on the axis and every angle is a solution
            [rad].

    Returns:
        The gap [m], 0 unless the point is nearer to the axis than the plane; and the two (angle
        [rad], s [m]), the one with s not negative first.
    """
    squared = x * x + y * y
    rest = squared - beside * beside
    if squared < FREE * FREE:
        gap = abs(beside)
        return gap, ((preferred, 0.0), (preferred + math.pi, 0.0))
    bearing = math.atan2(y, x)
    if rest <= 0.0:
        side = math.atan2(beside, 0.0)
        return abs(beside) - math.sqrt(squared), ((bearing - side, 0.0), (bearing - side, 0.0))
    s = math.sqrt(rest)
    return 0.0, (
        (bearing - math.atan2(beside, s), s),
        (bearing - math.atan2(beside, -s), -s),
    )


def two_links(
    x: float, z: float, first: float, second: float
) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return the angles at which two links reach from the origin to a point of their plane.

    Angles count from z towards x, as a rotation about y does.

    Args:
        x: coordinate of the point [m].
        z: coordinate of the point [m].
        first: length of the first link [m].
        second: length of the second link [m].

    Returns:
        The gap [m], 0 where the point is in reach; and (angle of the first link [rad], angle from
        the first link to the second [rad]): two, the one with the positive bend first, or one where
        the links are straight or folded.
    """
    squared = x * x + z * z
    cosine = (squared - first * first - second * second) / (2.0 * first * second)
    direction = math.atan2(x, z)
    if cosine >= 1.0:
        return math.sqrt(squared) - first - second, ((direction, 0.0),)
    if cosine <= -1.0:
        gap = abs(first - second) - math.sqrt(squared)
        return gap, ((direction if first >= second else direction + math.pi, math.pi),)
    # The sine by both factors: 1 - cosine² would lose half the digits where the arm is straight.
    sine = math.sqrt((1.0 - cosine) * (1.0 + cosine))
    bend = math.atan2(sine, cosine)
    lead = math.atan2(second * sine, first + second * cosine)
    return 0.0, ((direction - lead, bend), (direction + lead, -bend))


def zyz_angles(
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    preferred: float,
) -> tuple[float, float, float]:
    """Return a rotation, by rows (a, b, c), (d, e, f), (g, h, i), as angles of Rz(α) Ry(β) Rz(γ).

    Where sin β vanishes only α ± γ is determined: α keeps its preferred value [rad]. The elements
    come one by one, as packing and unpacking rows would cost more than the arc tangents.

    Returns:
        (α, β, γ) [rad] with β from 0 to π. The other answer is (α + π, -β, γ + π).
    """
    sine = math.sqrt(c * c + f * f)
    if sine > _WELL_CONDITIONED:
        return math.atan2(f, c), math.atan2(sine, i), math.atan2(h, -g)
    # The sum α ± γ is well determined though each of them is not: γ is what α leaves.
    alpha = preferred if sine < FREE else math.atan2(f, c)
    cosine_alpha, sine_alpha = math.cos(alpha), math.sin(alpha)
    beta = math.atan2(cosine_alpha * c + sine_alpha * f, i)
    gamma = math.atan2(cosine_alpha * d - sine_alpha * a, cosine_alpha * e - sine_alpha * b)
    return alpha, beta, gamma


_WELL_CONDITIONED = 1e-4  # sine above which the direct formulas keep twelve digits
