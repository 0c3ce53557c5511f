"""A block pressed on another in space, and sheared with friction, by any solver."""

import numpy as np
from problems import COMM, build, fix, tolerate

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, SNESSolver

METHODS = {"augmented": AugmentedLagrangian, "penalty": lambda: Penalty(200.0)}
FRICTIONS = {"frictionless": None, "friction": Coulomb(0.3)}


def blocks(cell="tetrahedron", degree=2, n=1, comm=COMM, held=None, **options):
    """A block pressed on another, and sheared where there is friction."""
    scene = two_blocks(
        comm,
        3,
        cell,
        lower_divisions=(4 * n, 4 * n, 2 * n),
        upper_divisions=(3 * n, 3 * n, 2 * n),
        lower_size=(1.0, 1.0, 0.5),
        upper_size=(0.8, 0.8, 0.5),
    )
    push = (0.004 if options.get("friction") else 0.0, 0.0, -0.02)

    def clamped(V, scene):
        top = fix(V, scene, "top", value=lambda x: np.tile(push, (len(x), 1)))
        return [fix(V, scene, "bottom"), top]

    options.setdefault("E", 10.0)
    return build(scene, degree, "neo-hookean", bcs=held or clamped, **options)


def solved(problem, options, solver=SNESSolver):
    """The solver, after its solve, and the Krylov iterations of each of its systems."""
    one, steps = solver(problem.problem, options), []
    one.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
    tolerate(one, rtol=1e-11)
    one.solve()
    return one, [a for a, b in zip(steps, [*steps[1:], 0]) if b == 0]


def unknowns(problem):
    return problem.problem.start().array.copy()
