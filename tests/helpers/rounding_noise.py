"""The rounding errors of another machine, for tests that must not depend on them."""

import numpy as np
from problems import COMM

from raymortar.core.problem import CoupledProblem

SIZE = 16 * np.finfo(float).eps


def disturb_tangents(seed):
    """Let all tangents from now on be off by some units of rounding: their rows by a
    factor and, against these, their diagonals by another. Rows of the identity, by
    which values are prescribed, have no rounding errors. As on any machine, a run that
    is repeated has the same ones."""
    exact = CoupledProblem.J

    def disturbed(problem, x, A):
        random = np.random.default_rng([seed, COMM.rank])

        def factors(diagonal):
            noise = SIZE * random.uniform(-1.0, 1.0, diagonal.size)
            return np.where(diagonal == 1.0, 1.0, 1.0 + noise)

        renewed = exact(problem, x, A)
        rows, diagonal = A.createVecLeft(), A.getDiagonal()
        of_rows = factors(diagonal.array)
        rows.array[:] = of_rows
        A.diagonalScale(rows, None)
        diagonal.array[:] *= of_rows * factors(diagonal.array)
        A.setDiagonal(diagonal)
        rows.destroy()
        diagonal.destroy()
        return renewed

    CoupledProblem.J = disturbed
