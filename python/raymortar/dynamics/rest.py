"""Static balance of values that have no mass."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from ..compat import Array, Indices, Mask
from ..problem import CoupledProblem


class Rest:
    """Finds where the forms hold values without mass, by one Newton iteration.

    Of linear bodies it is exact. Collective.

    Parameters
    ----------
    problem
        Problem whose matrices have room for the tangent.
    volume
        Forms of the problem without inertia.
    """

    def __init__(self, problem: CoupledProblem, volume: Any) -> None:
        self._problem, self._volume = problem, volume
        # Making room may pair surfaces anew, at the present unknowns
        self._K = problem.create_matrix()
        self._ksp: Any = None
        self._chosen: Mask = np.zeros(0, dtype=bool)

    def change(self, chosen: Mask) -> Array:
        """Change of the owned unknowns, (n,), with which the forms are in balance at
        chosen ones."""
        begin, comm = self._problem.contact.layout.begin, self._problem.comm
        found, rows = np.zeros(len(chosen)), np.flatnonzero(chosen)
        if comm.allreduce(len(rows)) == 0:
            return found
        forces = self._volume.forces(self._problem.bcs)
        ksp = self._factors(chosen, rows + begin)
        x, b = ksp.getOperators()[0].createVecs()
        b.array[:] = -forces[rows]
        ksp.solve(b, x)
        if ksp.getConvergedReason() > 0:  # else the forms have no balance near here
            found[rows] = x.array_r
        for thing in (x, b):
            thing.destroy()
        return found

    def _factors(self, chosen: Mask, rows: Indices) -> Any:
        """Factors of the tangent between chosen unknowns, kept where it is linear."""
        comm = self._problem.comm
        anew = self._ksp is None or not np.array_equal(chosen, self._chosen)
        if not comm.allreduce(int(anew)) and self._volume.is_linear:
            return self._ksp
        self._K.zeroEntries()
        self._volume.add_tangent(self._K, self._problem.bcs)
        self._K.assemble()
        own = PETSc.IS().createGeneral(rows.astype(PETSc.IntType), comm=comm)
        part = self._K.createSubMatrix(own, own)
        own.destroy()
        if self._ksp is not None:
            self._ksp.destroy()
        self._chosen, self._ksp = chosen.copy(), PETSc.KSP().create(comm)
        self._ksp.setOperators(part)
        self._ksp.setType("cg")
        self._ksp.getPC().setType("jacobi")
        self._ksp.setTolerances(rtol=1e-14, max_it=10000)
        part.destroy()  # the solver keeps it
        return self._ksp
