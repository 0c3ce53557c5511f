"""Two blocks under a large uniform compression, with the closed form (problem A3)."""

import numpy as np
from materials import MATERIALS, lame
from problems import build, fix, symmetry


def homogeneous(dim, material="neo-hookean", share=0.2, E=2000.0, nu=0.3):
    """Deformation gradient of a block compressed by a share of its height.

    The lateral faces are free: the scalar equation P_11 = 0 by bisection.
    """
    law, moduli = MATERIALS[material][1], lame(E, nu)

    def gradient_at(alpha):
        return np.diag([alpha] * (dim - 1) + [1.0 - share])

    def lateral(alpha):
        return law(gradient_at(alpha) - np.eye(dim), *moduli)[0, 0]

    low, high = 1.0, 1.5
    while low < (low + high) / 2 < high:
        middle = (low + high) / 2
        low, high = (middle, high) if lateral(middle) < 0.0 else (low, middle)
    return gradient_at(low)


def squeezed(V, scene, share=0.2):
    """Top pushed down by a share of the height, sides free but for symmetry."""
    dim = scene.mesh.geometry.dim
    top = fix(V, scene, "top", dim - 1, lambda x: -share * x[:, -1])
    return [*symmetry(V, scene), fix(V, scene, "bottom", dim - 1), top]


def squeeze(scene, degree=1, method=None, material="neo-hookean", **options):
    """A3, its exact deformation gradient and nominal stress, not yet solved."""
    problem = build(scene, degree, material, method, bcs=squeezed, **options)
    F = homogeneous(problem.dim, material)
    return problem, F, MATERIALS[material][1](F - np.eye(problem.dim), *lame(2000, 0.3))
