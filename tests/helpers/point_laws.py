"""A material that NumPy evaluates at quadrature points, and the same one in UFL."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from problems import fix

from meshes.scenes import two_blocks
from raymortar import Contact, NonlinearProblem, versions
from raymortar.core import compat

DEGREE = 2  # of the rule
MU, LAMBDA, STIFFENING = 800.0, 1200.0, 1e5
ROOT = np.sqrt(2.0)


def strain(w):
    """Small strain in 2D as a vector whose products are those of the tensor."""
    e = ufl.sym(ufl.grad(w))
    return ufl.as_vector([e[0, 0], e[1, 1], ROOT * e[0, 1]])


class PointLaw:
    """Stress 2 mu e + lambda tr(e) 1 + c (e . e) e, whose c may be changed.

    Attributes
    ----------
    calls
        Displacements at which it was evaluated.
    fails
        Function without argument that is called first, to raise an error.
    """

    def __init__(self, u):
        self.u, self.calls, self.fails = u, [], lambda: None
        self.stiffening = STIFFENING
        mesh = u.function_space.mesh
        self.stress = fem.Function(versions.quadrature_space(mesh, DEGREE, (3,)))
        self.tangent = fem.Function(versions.quadrature_space(mesh, DEGREE, (3, 3)))
        self._strain = versions.AtQuadraturePoints(strain(u), mesh, DEGREE)

    def stress_at(self, e):
        """Stress of strains, (..., 3)."""
        return (
            2.0 * MU * e
            + LAMBDA * (e[..., :2].sum(-1)[..., None] * [1.0, 1.0, 0.0])
            + self.stiffening * (e**2).sum(-1)[..., None] * e
        )

    def update(self):
        self.fails()
        self.calls.append(self.u.x.array.copy())
        e = self._strain()
        m, c = np.array([1.0, 1.0, 0.0]), self.stiffening
        tangent = LAMBDA * np.outer(m, m) + np.zeros((*e.shape, 3))
        tangent += (2.0 * MU + c * (e**2).sum(-1))[..., None, None] * np.eye(3)
        tangent += 2.0 * c * e[..., :, None] * e[..., None, :]
        versions.set_at_quadrature_points(self.stress, self.stress_at(e))
        versions.set_at_quadrature_points(self.tangent, tangent)

    def is_up_to_date(self):
        """Whether the stress is that of the present displacement."""
        table = compat.dofmap_array(self.stress.function_space)
        here = self.stress.x.array.reshape(-1, 3)[table]
        return np.allclose(here, self.stress_at(self._strain()), rtol=1e-13, atol=1e-9)

    def forms(self):
        """Residual, tangent, and what of a problem keeps both up to date."""
        V, dx = self.u.function_space, measure()
        v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
        F = ufl.inner(self.stress, strain(v)) * dx
        J = ufl.inner(ufl.dot(self.tangent, strain(du)), strain(v)) * dx
        return F, J, self.update


def measure():
    """Of the rule in which both versions are integrated."""
    rule = {"quadrature_degree": DEGREE, "quadrature_scheme": "default"}
    return ufl.dx(metadata=rule)


def in_ufl(u):
    """The same residual, by a form alone."""
    e = strain(u)
    stress = (2.0 * MU + STIFFENING * ufl.inner(e, e)) * e
    stress += LAMBDA * (e[0] + e[1]) * ufl.as_vector([1.0, 1.0, 0.0])
    return ufl.inner(stress, strain(ufl.TestFunction(u.function_space))) * measure()


def pressed(comm, by_points, cell="quadrilateral", **options):
    """Two blocks that are pressed together, and what moves the top.

    Returns
    -------
    problem, law (None in UFL), function of the load factor.
    """
    scene = two_blocks(comm, 2, cell, 4, 3, upper_size=(0.7, 1.0))
    V = compat.vector_space(scene.mesh, 1)
    u, down = fem.Function(V), fem.Constant(scene.mesh, np.zeros(2))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, down)]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, pairs, **options)
    law = PointLaw(u) if by_points else None
    F, J, update = (in_ufl(u), None, None) if law is None else law.forms()
    problem = NonlinearProblem(F, contact, bcs, J, update=update)

    def apply(t):
        down.value[:] = (0.02 * t, -0.1 * t)

    return problem, law, apply
