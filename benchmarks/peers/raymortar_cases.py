"""A case in raymortar."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from peer_case import Case, Effort, Failed, Found

import raymortar
from raymortar import AugmentedLagrangian, tools

LAWS = {
    "default": None,
    "points": {"condition": "points"},
    "dual": {"condition": "nodes", "multiplier": "dual"},
}


def stress(case: Case, u, E):
    """First Piola-Kirchhoff stress of the case's law, or Hooke's."""
    d, nu = case.dim, case.nu
    mu, la = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    H = ufl.grad(u)
    if case.law == "linear":
        return la * ufl.tr(H) * ufl.Identity(d) + 2.0 * mu * ufl.sym(H)
    F, K = ufl.Identity(d) + H, la + 2.0 / 3.0 * mu
    J, inverse = ufl.det(F), ufl.inv(F).T
    # Plane strain: the third stretch is 1
    trace = ufl.inner(F, F) + (3 - d)
    isochoric = mu * J ** (-2.0 / 3.0) * (F - trace / 3.0 * inverse)
    return isochoric + K * (J - 1.0) * J * inverse


class Ours:
    """raymortar's problem; forms are laws of contact."""

    FORMS = tuple(LAWS)

    def __init__(self, case: Case, form: str, alike: bool):
        self.case, self.alike, scene, V = case, alike, case.scene, case.space
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        E = tools.by_body(scene.mesh, scene.cell_tags, case.moduli, scene.bodies)
        dx = ufl.dx(metadata={"quadrature_degree": 2 * case.degree})
        form_of = ufl.inner(stress(case, self.u, E), ufl.grad(v)) * dx
        bcs = [tools.prescribe(V, scene.find(n), component=i) for n, i in case.held]
        # Of the components that are led
        self.moved = {
            i: fem.Constant(scene.mesh, 0.0)
            for i, value in enumerate(case.way(0.0))
            if value is not None
        }
        bcs += [
            tools.prescribe(V, scene.find(case.led), value, i)
            for i, value in self.moved.items()
        ]
        given = LAWS[form]
        self.contact = raymortar.Contact(
            self.u,
            scene.facet_tags,
            [(scene.tags[case.slave], scene.tags[case.master])],
            None if given is None else AugmentedLagrangian(**given),
            friction=raymortar.Coulomb(case.friction) if case.friction else None,
        )
        problem = raymortar.NonlinearProblem(form_of, self.contact, bcs)
        options = raymortar.solvers.direct() if alike else None
        self.solver = raymortar.SNESSolver(problem, options)

    @property
    def unknowns(self) -> int:
        """Displacements and multipliers."""
        return int(self.contact.layout.size_global)

    def _apply(self, t: float) -> None:
        way = self.case.way(t)
        for i, constant in self.moved.items():
            constant.value = way[i]

    def solve(self) -> Effort:
        """Follow the path, leg by leg."""
        begin, steps, self._rows = 0.0, [], []
        plain = {"extrapolate": False} if self.alike else {}
        try:
            for end, count in self.case.legs:
                path = (begin, end)
                load = raymortar.LoadSteps(
                    self.solver, self._apply, count, path=path, **plain
                )
                for step in load:
                    steps.append(step)
                    force = self.contact.resultant().force[: self.case.dim]
                    self._rows.append((step.factor, *np.abs(force)))
                begin = end
        except (raymortar.ContactError, RuntimeError) as error:
            raise Failed(str(error)[:200]) from error
        return Effort(
            sum(step.iterations for step in steps),
            len(steps),
            steps[-1].halvings,
        )

    def found(self) -> Found:
        """Forces on the slave, pressure at its nodes."""
        rows = np.array(self._rows)
        p, case = self.contact.pressure(), self.case
        V, facets = p.function_space, case.scene.find(case.slave)
        dofs = fem.locate_dofs_topological(V, case.dim - 1, facets)
        x = V.tabulate_dof_coordinates()[dofs, : case.dim]
        return Found(rows[:, 0], rows[:, 1:], *case.pressures(x, p.x.array[dofs]))
