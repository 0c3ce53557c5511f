"""Materials: first Piola-Kirchhoff stress from the displacement gradient H.

In UFL and in NumPy, H being (..., d, d) and the moduli of matching shape.
"""

import numpy as np
import ufl


def lame(E, nu):
    """Lame's constants mu, lambda."""
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def _linear_ufl(H, mu, lmbda):
    strain = ufl.sym(H)
    return 2 * mu * strain + lmbda * ufl.tr(strain) * ufl.Identity(H.ufl_shape[0])


def _neo_hookean_ufl(H, mu, lmbda):
    F = ufl.variable(ufl.Identity(H.ufl_shape[0]) + H)
    return ufl.diff(neo_hookean_energy(F, mu, lmbda), F)


def _saint_venant_kirchhoff_ufl(H, mu, lmbda):
    F = ufl.Identity(H.ufl_shape[0]) + H
    strain = (F.T * F - ufl.Identity(H.ufl_shape[0])) / 2
    return F * _linear_ufl(strain, mu, lmbda)


def neo_hookean_energy(F, mu, lmbda):
    """mu/2 (tr C - d - 2 ln J) + lambda/2 (ln J)^2, UFL."""
    log = ufl.ln(ufl.det(F))
    return mu / 2 * (ufl.tr(F.T * F) - F.ufl_shape[0] - 2 * log) + lmbda / 2 * log**2


def _linear(H, mu, lmbda):
    strain = (H + H.swapaxes(-1, -2)) / 2
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return 2 * mu * strain + lmbda * trace * np.eye(H.shape[-1])


def _neo_hookean(H, mu, lmbda):
    F = np.eye(H.shape[-1]) + H
    inverse = np.linalg.inv(F).swapaxes(-1, -2)
    log = np.log(np.linalg.det(F))[..., None, None]
    return mu * (F - inverse) + lmbda * log * inverse


def _saint_venant_kirchhoff(H, mu, lmbda):
    F = np.eye(H.shape[-1]) + H
    strain = (F.swapaxes(-1, -2) @ F - np.eye(H.shape[-1])) / 2
    return F @ _linear(strain, mu, lmbda)


MATERIALS = {
    "linear": (_linear_ufl, _linear),
    "neo-hookean": (_neo_hookean_ufl, _neo_hookean),
    "svk": (_saint_venant_kirchhoff_ufl, _saint_venant_kirchhoff),
}
