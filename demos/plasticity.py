"""Elastoplastic material of sheets: what internal variables need beside contact.

Von Mises plasticity with linear hardening in Green and Lagrange's strain E, which is split
into a sum of an elastic and a plastic part: for small strains and rotations of any size,
as in sheets that bend. The plastic strain is a field like any other: the form has the
return to the yield surface in closed form, UFL differentiates it, and after each accepted
step `accept` stores what was found (``LoadSteps(on_accept=...)``).

[1] J. C. Simo, T. J. R. Hughes, Computational Inelasticity, Springer 1998, section 3.3.
"""

import numpy as np
import ufl
from dolfinx import fem

from raymortar import tools
from raymortar.core import compat

# Under the root of the equivalent stress, of the yield stress squared: a slope at zero
ROUND = 1e-12


class ElastoPlastic:
    """Saint Venant and Kirchhoff's law with von Mises' yield stress; plane strain.

    Parameters
    ----------
    u
        Displacement in 2D.
    E, nu
        Young's modulus and Poisson's ratio.
    yield_stress, hardening
        Of a tension test: stress at which it yields, and slope over the plastic strain.
    """

    def __init__(self, u, E, nu, yield_stress, hardening):
        self.u, self.yield_stress, self.hardening = u, yield_stress, hardening
        self.mu = E / (2 * (1 + nu))
        self.bulk = E / (3 * (1 - 2 * nu))
        # Components xx, yy, xy of the plastic strain, and the equivalent one, which grows
        V = compat.space(u.function_space.mesh, "DQ", 1, (4,))
        self.history = fem.Function(V, name="plastic_strain")
        self._next = fem.Function(V)
        points = V.element.interpolation_points
        self._found = fem.Expression(
            self._returned()[1], points() if callable(points) else points
        )

    def _strain(self):
        """Green and Lagrange's strain, 3 x 3."""
        H = ufl.grad(self.u)
        e = (H + H.T + H.T * H) / 2
        return ufl.as_tensor([[e[0, 0], e[0, 1], 0], [e[1, 0], e[1, 1], 0], [0, 0, 0]])

    def _returned(self):
        """Second stress of Piola and Kirchhoff, 3 x 3, and the new history."""
        xx, yy, xy, equivalent = (self.history[i] for i in range(4))
        plastic = ufl.as_tensor([[xx, xy, 0], [xy, yy, 0], [0, 0, -xx - yy]])
        strain = self._strain()
        trial = 2 * self.mu * (ufl.dev(strain) - plastic)
        norm = ufl.inner(trial, trial) + ROUND * self.yield_stress**2
        mises = ufl.sqrt(1.5 * norm)
        excess = mises - self.yield_stress - self.hardening * equivalent
        flow = ufl.conditional(ufl.gt(excess, 0), excess, 0)
        flow = flow / (3 * self.mu + self.hardening)
        step = 1.5 * flow / mises * trial
        stress = self.bulk * ufl.tr(strain) * ufl.Identity(3) + trial
        stress = stress - 2 * self.mu * step
        new = (xx + step[0, 0], yy + step[1, 1], xy + step[0, 1], equivalent + flow)
        return stress, ufl.as_vector(new)

    def residual(self, quadrature_degree: int):
        """Virtual work of the stresses: linear form in the test function."""
        v = ufl.TestFunction(self.u.function_space)
        F = ufl.Identity(2) + ufl.grad(self.u)
        S, _ = self._returned()
        S = ufl.as_tensor([[S[0, 0], S[0, 1]], [S[1, 0], S[1, 1]]])
        dx = ufl.dx(metadata={"quadrature_degree": quadrature_degree})
        return ufl.inner(F * S, ufl.grad(v)) * dx

    def accept(self):
        """Store the plastic strain of the present displacement. Collective."""
        self._next.interpolate(self._found)
        self.history.x.array[:] = self._next.x.array

    def mises(self):
        """Von Mises stress at the nodes. Collective."""
        stress, _ = self._returned()
        mesh = self.u.function_space.mesh
        return tools.nodal_field(tools.von_mises(stress), mesh, "mises", 1, 2)


def moment(curvature, thickness, E, nu, yield_stress, hardening, layers=400, steps=200):
    """Bending moment of a sheet in plane strain under a curvature that has grown from
    zero: the same law, layer by layer, with no stress across the sheet.

    Returns
    -------
    Moment per width. Force.
    """
    mu, bulk = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
    z = (np.arange(layers) + 0.5) / layers * 0.5 * thickness
    plastic, equivalent = np.zeros((3, layers)), np.zeros(layers)
    across, along = np.zeros(layers), np.zeros(layers)
    for share in np.arange(1, steps + 1) / steps:
        strain = np.zeros((3, layers))  # along, across, out of the plane
        strain[0] = share * curvature * z
        for _ in range(60):
            strain[1] = across
            volume = strain.sum(axis=0)
            trial = 2 * mu * (strain - volume / 3 - plastic)
            mises = np.sqrt(1.5 * (trial**2).sum(axis=0)) + 1e-300
            excess = mises - yield_stress - hardening * equivalent
            flow = np.maximum(excess, 0.0) / (3 * mu + hardening)
            stress = bulk * volume + trial * (1 - 3 * mu * flow / mises)
            across = across - stress[1] / (bulk + 4 * mu / 3)
        plastic = plastic + 1.5 * flow / mises * trial
        equivalent, along = equivalent + flow, stress[0]
    return 2.0 * float((along * z).sum()) * 0.5 * thickness / layers
