"""The rounding errors of another machine, for tests that must not depend on them."""

import numpy as np
from problems import COMM

from raymortar.problem import CoupledProblem

SIZE = 16 * np.finfo(float).eps


def disturb_tangents(seed):
    """Let all tangents from now on be off by some units of rounding: their rows by a
    factor and, against these, their diagonals by another."""
    random = np.random.default_rng([seed, COMM.rank])
    exact = CoupledProblem.J

    def factors(size):
        return 1.0 + SIZE * random.uniform(-1.0, 1.0, size)

    def disturbed(problem, x, A):
        renewed = exact(problem, x, A)
        rows, diagonal = A.createVecLeft(), A.getDiagonal()
        rows.array[:] = factors(rows.local_size)
        A.diagonalScale(rows, None)
        diagonal.array[:] *= factors(diagonal.local_size)
        A.setDiagonal(diagonal)
        rows.destroy()
        diagonal.destroy()
        return renewed

    CoupledProblem.J = disturbed
