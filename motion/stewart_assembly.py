"""Forward kinematics of a Stewart platform: where six leg lengths hold it.

Owns the search and the reason why its answer is the right one. Six lengths fit up to 40 poses
(Raghavan 1993; Merlet, Parallel Robots, chapter 4); only one of them is where the machine is.

Why there is one inside the workspace. Let y be the pose as fractions of the workspace bounds, so
that the workspace is the set S with sum |y_i| ≤ 1, which is convex; l(y) the leg lengths, l' their
Jacobian, and G its inverse at home. If |G l'(y) - 1| ≤ c < 1 throughout S, then y ↦ y - G l(y)
brings two poses of S closer together by the factor c (mean value theorem along the chord, which
lies in S), so no two of them have the same lengths. An answer that closes the legs and lies in S is
therefore the one connected with home, whatever the search did. `uniqueness` measures c.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .errors import NoAssembly
from .orientation import rotation_of_vector
from .pose import Array, Pose
from .stewart_legs import Legs

CLOSURE = 1e-11
"""Greatest leg error of an answer [m]."""

_ITERATIONS = 40
_SETTLED = 1e-14  # m: no leg is off by more than rounding
_LONGEST_STEP = 0.5  # of a turn [rad], or of the size [m]: farther the linearisation means nothing


class Assembly(NamedTuple):
    """A platform placement that closes the legs.

    Attributes:
        rotation: (3, 3).
        position: (3,) [m].
        jacobian: (6, 6) leg Jacobian there, twist to leg rates.
        residual: greatest leg error [m].
        iterations: that the search took.
    """

    rotation: Array
    position: Array
    jacobian: Array
    residual: float
    iterations: int


def assemble(legs: Legs, lengths: Array, start: Pose) -> Assembly:
    """Find a platform placement with given leg lengths, by Newton's method.

    Args:
        legs: the anchors.
        lengths: (6,) [m], finite.
        start: where the search starts.

    Raises:
        NoAssembly: the search met a singular placement, or did not close the legs.
    """
    rotation, position = start.rotation, start.position
    size = float(np.abs(legs.platform).max())
    before = math.inf
    for iteration in range(_ITERATIONS + 1):
        found, jacobian = legs.linearise(rotation, position)
        errors = lengths - found
        residual = float(np.abs(errors).max())
        # Once inside the tolerance, an error that no longer shrinks is rounding.
        if residual <= _SETTLED or (residual <= CLOSURE and residual >= before):
            return Assembly(rotation, position, jacobian, residual, iteration)
        before = residual
        try:
            step = np.asarray(np.linalg.solve(jacobian, errors), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise _refused(lengths, residual, "the search met a singular placement") from None
        longest = max(
            math.sqrt(float(step[:3] @ step[:3])) / size, math.sqrt(float(step[3:] @ step[3:]))
        )
        if longest > _LONGEST_STEP:
            step *= _LONGEST_STEP / longest
        position = position + step[:3]
        rotation = rotation_of_vector(step[3:]) @ rotation
    reason = f"the nearest found in {_ITERATIONS} iterations leaves a leg {residual:.3g} m off"
    raise _refused(lengths, residual, reason)


def uniqueness(legs: Legs, bounds: Array, samples: int = 2000, random_seed: int = 0) -> float:
    """Measure c of the module's text over sampled poses; below 1 the workspace has no second pose.

    Args:
        legs: the anchors.
        bounds: (6,) of x, y, z [m], roll, pitch, yaw [rad] about home.
        samples: poses, half of them on the workspace's border; its 12 corners are added.
        random_seed: the same number gives the same answer.
    """
    at_home = np.linalg.inv(legs.rpy_jacobian(legs.home) * bounds)
    random = np.random.default_rng(random_seed)
    shares = random.dirichlet(np.full(6, 0.5), samples) * random.choice((-1.0, 1.0), (samples, 6))
    shares[::2] *= random.uniform(0.0, 1.0, (len(shares[::2]), 1))
    worst = 0.0
    for share in np.concatenate((np.eye(6), -np.eye(6), shares)):
        x = share * bounds
        pose = Pose.from_rpy(legs.home.position + x[:3], x[3:])
        change = at_home @ (legs.rpy_jacobian(pose) * bounds) - np.eye(6)
        worst = max(worst, float(np.linalg.norm(change, 2)))
    return worst


def _refused(lengths: Array, residual: float, reason: str) -> NoAssembly:
    return NoAssembly(tuple(lengths.tolist()), residual, reason)
