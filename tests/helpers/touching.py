"""A strip in contact, and the rows of its law in the system."""

import numpy as np
import pytest
from ahead import without
from pathing import take
from slender import bent, leaves

import raymortar
from raymortar.solvers.correcting import correcting
from raymortar.solvers.rows_of_nodes import RowsOfNodes


def require_few_iterations_of_leaves(method, rel):
    """With statuses ahead at most five a step, fewer than without, and the same end."""
    with without():
        plain = take(one := leaves(2, 1.0, 2, method=method))
    found = take(other := leaves(2, 1.0, 2, method=method))
    assert found.arrived and found.iterations <= 5 * 2 < plain.iterations
    assert other.result() == pytest.approx(one.result(), rel=rel)


class Touching:
    """A strip that a circle has pressed: rows of its law, at a state or near it."""

    def __init__(self, mu, method):
        self.path = bent(20, mu, cells=(20, 2), method=method)
        self.problem = self.path.problem
        solver = raymortar.NewtonSolver(self.problem)
        self.path.apply(0.1)
        with correcting(solver):
            solver.solve()
        self.path.apply(0.2)
        self.A, self.b = self.problem.create_matrix(), self.problem.create_vector()
        self.x = self.problem.start()
        self.problem.form(self.x)
        (self.part,) = self.problem.contact.parts
        (self.zone,) = self.part.zones
        first = self.part.layout.multiplier_rows[self.zone.multiplier_nodes]
        self.components = self.part.layout.components
        rows = first[:, None] + np.arange(self.components)
        system = self.problem.contact.system
        self.A.zeroEntries()
        system.add_tangent(self.A, self.problem.bcs)
        self.A.assemble()
        self.rows = RowsOfNodes([rows], self.A)

    def matrix(self):
        self.A.zeroEntries()
        self.problem.contact.system.add_tangent(self.A, self.problem.bcs)
        self.A.assemble()
        return self.rows.matrix(self.rows.entries(self.A))

    def residual(self):
        self.b.set(0.0)
        self.problem.contact.system.add_residual(self.b, self.problem.bcs)
        return self.b.array_r[self.rows.local].copy()

    def linear(self, step):
        """The residual's rows, where the linear ones lead."""
        return self.residual() + self.matrix() @ self.rows.in_columns(step)
