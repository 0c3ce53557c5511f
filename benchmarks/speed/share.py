"""Contact's share of a Newton iteration with MUMPS."""

from __future__ import annotations

from scene import Blocks
from stages import clock

import raymortar
from raymortar.core import compat
from raymortar.core.solvers.newton import SNESSolver

# Options of `Blocks` by what the contact is
KINDS = {
    "frictionless": {},
    "friction": {"friction": raymortar.Coulomb(0.3)},
    "friction, on a plane": {"friction": raymortar.Coulomb(0.3), "on_plane": True},
}


def row(cell, degree, n, kind, repeats=5):
    """CPU seconds of the parts of one Newton iteration on two cubes, or on one.

    Contact includes pairing, its residual and its tangent (through moving segments).
    """
    blocks = Blocks(cell, degree, n, height=n, **KINDS[kind])
    contact, problem = blocks.contact, blocks.problem
    solver = SNESSolver(problem, raymortar.solvers.direct())
    A, b = solver.A, solver.b
    x = problem.start()
    problem.F(x, b)
    problem.J(x, A)
    V = blocks.u.function_space
    r = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)

    def pair():
        blocks.move()
        contact.update()

    def volume_tangent():
        A.zeroEntries()
        compat.assemble_jacobian(A, problem.a, problem.bcs)
        A.assemble()

    def tangent():
        contact.assemble_matrix(A, problem.bcs)
        A.assemble()

    def residual():
        contact.assemble_vector(b, problem.bcs)
        b.assemble()

    def volume_residual():
        r.array[:] = 0.0
        compat.assemble_residual(r.array, problem.L)

    seconds = {
        "pairing": clock(pair, repeats),
        "residual": clock(residual, repeats),
        "tangent": clock(tangent, repeats),
        "volume_residual": clock(volume_residual, repeats),
        "volume_tangent": clock(volume_tangent, repeats),
    }
    # What is factorised is a real tangent
    problem.J(x, A)
    dx = problem.create_vector()

    def solve():
        A.setValue(0, 0, A.getValue(0, 0))
        A.assemble()
        solver.krylov_solver.setOperators(A)
        solver.krylov_solver.solve(b, dx)

    with solver.options:  # of MUMPS, which a solver has in PETSc's table as it solves
        seconds["mumps"] = clock(solve, max(repeats // 2, 1))
    own = seconds["pairing"] + seconds["residual"] + seconds["tangent"]
    volume = seconds["volume_residual"] + seconds["volume_tangent"]
    total = own + volume + seconds["mumps"]
    counts = contact.statistics
    line = {"cell": cell, "degree": degree, "contact": kind}
    line["facets"] = counts.slave_facets
    line["unknowns"] = contact.layout.size_global
    line |= {f"s_{name}": value for name, value in seconds.items()}
    return line | {"share": own / total, "to_volume": own / volume}
