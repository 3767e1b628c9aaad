"""Small symmetric systems of equations, solved many thousand times.

Owns the door to Eigen's Cholesky decomposition, by eigenpy, which pinocchio's collision library
brings along. `numpy.linalg.solve` spends most of its time around LAPACK where there are seven
equations; this takes a third to a half of it.
"""

from __future__ import annotations

import eigenpy

from .kinematics import Array


def solve_positive_definite(matrix: Array, right: Array) -> Array:
    """Solve A x = b for a symmetric positive definite matrix, by A = L Lᵀ.

    Whether it is positive definite is not checked, and no error is raised. A damped normal matrix
    JᵀJ + λI is, as long as λ stays above the rounding noise of its trace: with λ = 1e-12 of a
    matrix of seven columns up to a trace of some thousands.

    Args:
        matrix: (n, n) A, of which only the lower triangle is read.
        right: (n,) b.

    Returns:
        The (n,) x.
    """
    solution: Array = eigenpy.LLT(matrix).solve(right)
    return solution
