"""Plasticity by a return mapping in NumPy: what internal variables need beside contact.

Von Mises' yield stress, linear hardening, small strains [1]. Strains and stresses are
vectors (xx, yy, zz, sqrt(2) xy), whose products are those of tensors.

[1] J. C. Simo, T. J. R. Hughes, Computational Inelasticity, Springer 1998, section 3.3.
"""

import numpy as np
import ufl
from dolfinx import fem

import raymortar
from raymortar import tools

# Any consistent units
E, NU, YIELD, HARDENING = 1000.0, 0.3, 4.0, 40.0
MU, BULK = E / (2.0 * (1.0 + NU)), E / (3.0 * (1.0 - 2.0 * NU))
ONE = np.array([1.0, 1.0, 1.0, 0.0])
RULE = 2  # degree of the rule
# Plastic strain of a step, above which `update` asks for a smaller one
MOST = 0.02
DEVIATOR = np.eye(4) - np.outer(ONE, ONE) / 3.0


def return_mapping(strain, plastic, equivalent):
    """Stress, tangent, plastic strain and equivalent plastic strain, at all points."""
    trial = 2.0 * MU * (strain @ DEVIATOR - plastic)
    size = np.maximum(np.linalg.norm(trial, axis=-1), 1e-300)
    excess = size - np.sqrt(2.0 / 3.0) * (YIELD + HARDENING * equivalent)
    slope = 2.0 * MU + 2.0 / 3.0 * HARDENING
    flow = np.maximum(excess, 0.0) / slope
    n = trial / size[..., None]
    volume = BULK * strain[..., :3].sum(-1)[..., None] * ONE
    stress = volume + trial - 2.0 * MU * flow[..., None] * n
    shrinks = 1.0 - 2.0 * MU * flow / size
    turns = np.where(excess > 0.0, 2.0 * MU / slope, 0.0) - (1.0 - shrinks)
    tangent = BULK * np.outer(ONE, ONE) + 2.0 * MU * (
        shrinks[..., None, None] * DEVIATOR
        - turns[..., None, None] * n[..., :, None] * n[..., None, :]
    )
    plastic = plastic + flow[..., None] * n
    return stress, tangent, plastic, equivalent + np.sqrt(2.0 / 3.0) * flow


def confined(strain):
    """Pressure of a block between walls, compressed by a strain for the first time."""
    plastic = max(2.0 * MU * strain - YIELD, 0.0) / (3.0 * MU + HARDENING)
    elastic = (BULK + 4.0 / 3.0 * MU) * strain
    return elastic - 2.0 * MU * plastic


def strain_of(u):
    """Small strain as a vector."""
    e = ufl.sym(ufl.grad(u))
    return ufl.as_vector([e[0, 0], e[1, 1], 0.0, np.sqrt(2.0) * e[0, 1]])


class Material:
    """Stress and tangent at the points, and what is plastic since the last step."""

    def __init__(self, u):
        mesh = u.function_space.mesh
        self.u, self.rejected = u, 0
        shapes = {"stress": (4,), "tangent": (4, 4), "plastic": (5,)}
        self.stress, self.tangent, self.plastic = (
            fem.Function(tools.quadrature_space(mesh, RULE, shape), name=name)
            for name, shape in shapes.items()
        )
        self._strain = tools.AtQuadraturePoints(strain_of(u), mesh, RULE)
        shape = self._strain().shape
        self._accepted = np.zeros(shape), np.zeros(shape[:2])
        self._now = self._accepted

    def update(self):
        """Set stress and tangent for the present displacement."""
        stress, tangent, *now = return_mapping(self._strain(), *self._accepted)
        if np.max(now[1] - self._accepted[1], initial=0.0) > MOST:
            raise raymortar.ConvergenceError("a step flows too far")
        self._now = tuple(now)
        tools.set_at_quadrature_points(self.stress, stress)
        tools.set_at_quadrature_points(self.tangent, tangent)

    def accept(self):
        """Take over the plastic strain of the step."""
        self._accepted = self._now
        plastic, equivalent = self._accepted
        values = np.concatenate([plastic, equivalent[..., None]], axis=-1)
        tools.set_at_quadrature_points(self.plastic, values)

    def go_back(self):
        """Drop the plastic strain of a step that has failed."""
        self._now = self._accepted
        self.rejected += 1

    def forms(self):
        """Virtual work of the stresses, and its derivative."""
        V = self.u.function_space
        v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
        rule = {"quadrature_degree": RULE, "quadrature_scheme": "default"}
        dx = ufl.dx(metadata=rule)
        F = ufl.inner(self.stress, strain_of(v)) * dx
        return F, ufl.inner(ufl.dot(self.tangent, strain_of(du)), strain_of(v)) * dx
