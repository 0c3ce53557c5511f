"""A quarter of a rubber cord, squeezed between two smooth plates in plane strain."""

from __future__ import annotations

from petsc4py import PETSc

import hosts
import numpy as np
import ufl
from dolfinx import fem
from hosts import MU
from problems import COMM, fix

import raymortar
from meshes import scenes
from raymortar import LoadSteps
from raymortar.core import compat

DIAMETER = 1.0
MODULUS = 4.0 * MU  # of plane strain, without change of volume
MIXED = {"u": ("Lagrange", 2, (2,)), "p": ("Lagrange", 1, ())}


def cord(facets_across=10, cell="triangle"):
    """A quarter of the cross-section on a plate, which touch at the origin."""
    return scenes.cylinder_on_block(
        COMM,
        cell,
        2,
        radius=0.5 * DIAMETER,
        block_size=(1.6, 0.5),
        contact_half_width=0.2,
        facets_across=facets_across,
        growth=1.2,
        slave_angle=0.5 * np.pi,
        pattern="alternate" if cell == "triangle" else "right",
    )


def conditions(V, scene, push):
    """Symmetry, and the plate moved as a rigid body."""
    still = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    plate = scene.cell_tags.indices[scene.cell_tags.values == scene.bodies["lower"]]
    bcs = [fix(V, scene, "top", 1), fix(V, scene, "symmetry_x", 0)]
    for i, value in enumerate((still, push)):
        dofs = fem.locate_dofs_topological(V.sub(i), 2, plate)
        bcs.append(fem.dirichletbc(value, dofs, V.sub(i)))
    return bcs


class Ring:
    """The cord, to be squeezed.

    Parameters
    ----------
    kappa
        Bulk modulus over the shear modulus.
    mixed
        Displacement of degree 2 and pressure of degree 1, or the displacement alone.
    options
        Of `cord`.
    """

    def __init__(self, kappa=2000.0, mixed=True, **options):
        self.scene = scene = cord(**options)
        self.push = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
        build = self._mixed if mixed else self._alone
        self.contact, self.problem, self.pressure = build(kappa * MU)

    def _mixed(self, kappa):
        dx = ufl.dx(self.scene.mesh, metadata={"quadrature_degree": 4})

        def residual(unknowns, tests):
            (u, p), (v, q) = unknowns, tests
            stress, constraint = hosts.neo_hookean(u, p, kappa)
            return [ufl.inner(stress, ufl.grad(v)) * dx, constraint * q * dx]

        found = hosts.hosted(
            "mixed",
            self.scene,
            MIXED,
            residual,
            lambda spaces: conditions(spaces[0], self.scene, self.push),
            measure="current",
        )
        return found.contact, found.problem, ufl.split(found.functions[0])[1]

    def _alone(self, kappa):
        scene = self.scene
        dx = ufl.dx(scene.mesh, metadata={"quadrature_degree": 4})
        u = fem.Function(compat.space(scene.mesh, *MIXED["u"]))
        V, pairs = u.function_space, [(scene.tags["slave"], scene.tags["master"])]
        pressure = kappa * (ufl.det(ufl.Identity(2) + ufl.grad(u)) - 1.0)
        stress, _ = hosts.neo_hookean(u, pressure, kappa)
        F = ufl.inner(stress, ufl.grad(ufl.TestFunction(V))) * dx
        contact = raymortar.Contact(u, scene.facet_tags, pairs, measure="current")
        bcs = conditions(V, scene, self.push)
        return contact, raymortar.NonlinearProblem(F, contact, bcs), pressure

    def squeeze(self, end, steps, solver=raymortar.SNESSolver, **options):
        """Load steps up to a share of the diameter."""

        def apply(share):
            self.push.value = 0.5 * DIAMETER * share

        path = (0.0, end)
        return LoadSteps(
            solver(self.problem), apply, steps, path=path, progress=False, **options
        )

    def force(self):
        """Of the whole cord, over plane-strain modulus and diameter."""
        return 2.0 * self.contact.resultant(0).force[1] / (MODULUS * DIAMETER)

    def width(self):
        """Of the whole contact."""
        points = self.contact.points(0)
        closed = points["x"][points["status"] >= 2, 0]
        return 2.0 * max(COMM.allgather(closed.max(initial=0.0)))

    def peak(self):
        """Largest Cauchy pressure."""
        return max(COMM.allgather(self.contact.points(0)["pressure"].max(initial=0.0)))

    def roughness(self):
        """Mean jump of the pressure's means between cells of the cord, over their
        range."""
        mesh = self.scene.mesh
        v = ufl.TestFunction(compat.space(mesh, "DG", 0))
        dx = ufl.dx(mesh, metadata={"quadrature_degree": 4})
        means = fem.Function(compat.space(mesh, "DG", 0))
        sums = np.zeros((2, len(means.x.array)))
        for row, form in zip(sums, (self.pressure * v * dx, v * dx)):
            compat.assemble_residual(row, compat.form(form))
        upper = self.scene.cell_tags.values == self.scene.bodies["upper"]
        cells = self.scene.cell_tags.indices[upper]
        mean = np.full(len(sums[0]), np.nan)
        mean[cells] = (sums[0] / sums[1])[cells]
        links = compat.connectivity(mesh, 1, 2)
        inner = np.flatnonzero(np.diff(links.offsets) == 2)
        pairs = np.array([links.links(f) for f in inner])
        jumps = np.abs(np.diff(mean[pairs], axis=1))
        return float(np.nanmean(jumps) / np.ptp(mean[cells]))
