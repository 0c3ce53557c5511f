"""Several hyperelastic bodies in one mesh: what the larger demos share."""

from __future__ import annotations

import numpy as np
import ufl

from raymortar import tools


class NeoHookean:
    """psi = mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2; plane strain in 2D.

    Parameters
    ----------
    E
        Young's modulus, a number or a field.
    nu
        Poisson's ratio.
    """

    def __init__(self, E, nu: float) -> None:
        self.mu = E / (2 * (1 + nu))
        self.lmbda = E * nu / ((1 + nu) * (1 - 2 * nu))

    def energy(self, u, quadrature_degree: int):
        """Stored energy of all bodies, a UFL functional."""
        density = self.density(ufl.Identity(len(u)) + ufl.grad(u))
        return density * ufl.dx(metadata={"quadrature_degree": quadrature_degree})

    def density(self, F):
        """Stored energy per volume of a deformation gradient, 2 x 2 or 3 x 3."""
        log_J = ufl.ln(ufl.det(F))
        density = self.mu / 2 * (ufl.inner(F, F) - F.ufl_shape[0] - 2 * log_J)
        return density + self.lmbda / 2 * log_J**2

    def residual(self, u, quadrature_degree: int):
        """Virtual work of the stresses: linear form in the test function."""
        v = ufl.TestFunction(u.function_space)
        F = ufl.Identity(len(u)) + ufl.grad(u)
        inverse, J = ufl.inv(F).T, ufl.det(F)
        P = self.mu * (F - inverse) + self.lmbda * ufl.ln(J) * inverse
        dx = ufl.dx(metadata={"quadrature_degree": quadrature_degree})
        return ufl.inner(P, ufl.grad(v)) * dx

    def turned_residual(self, u, quadrature_degree: int):
        """Virtual work over a full turn of a section in (r, z): hoops stretch by
        u_r / r, and 2 pi r is a weight."""
        r, H = ufl.SpatialCoordinate(u.function_space.mesh)[0], ufl.grad(u)
        F = ufl.Identity(3) + ufl.as_tensor(
            [[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, u[0] / r]]
        )
        dx = ufl.dx(metadata={"quadrature_degree": quadrature_degree})
        energy = self.density(F) * 2 * ufl.pi * r * dx
        return ufl.derivative(energy, u, ufl.TestFunction(u.function_space))

    def cauchy(self, u):
        """Cauchy stress as a 3 x 3 tensor."""
        H = ufl.grad(u)
        if len(u) == 2:
            H = ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
        F = ufl.Identity(3) + H
        J, identity = ufl.det(F), ufl.Identity(3)
        return (
            self.mu / J * (F * F.T - identity) + self.lmbda * ufl.ln(J) / J * identity
        )

    def mises(self, u, degree: int = 1, quadrature_degree: int = 2):
        """Von Mises stress at the nodes. Collective."""
        stress, mesh = tools.von_mises(self.cauchy(u)), u.function_space.mesh
        return tools.nodal_field(stress, mesh, "mises", degree, quadrature_degree)


def small_strain(u):
    """Linear strain as a 3 x 3 tensor; plane strain in 2D."""
    e = ufl.sym(ufl.grad(u))
    if len(u) == 2:
        e = ufl.as_tensor([[e[0, 0], e[0, 1], 0], [e[1, 0], e[1, 1], 0], [0, 0, 0]])
    return e


def hooke(u, E, nu: float):
    """Stress of linear elasticity, 3 x 3; E a number or a field."""
    mu, lmbda = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    e = small_strain(u)
    return 2 * mu * e + lmbda * ufl.tr(e) * ufl.Identity(3)


def sliding(contact, axis: int, zone: int = 0) -> np.ndarray:
    """Where the slave slides along an axis: forces along it. Collective.

    Returns
    -------
    What friction would carry with a coefficient of 1, its pull being along the surface
    and against the slide at every point, and what it carries.
    """
    points = contact.points(zone)
    t, n, w = (points[name] for name in ("traction", "normal", "weight"))
    along = t[:, axis] - np.einsum("qi,qi->q", t, n) * n[:, axis]
    tilt = np.sqrt(1.0 - n[:, axis] ** 2)
    comm = contact.u.function_space.mesh.comm
    return comm.allreduce(
        np.array([w @ (np.abs(points["pressure"]) * tilt), w @ along])
    )
