"""Uniform states of two bodies: exact stresses and multipliers, to rounding.

Errors are the largest over all cells, at points inside and at vertices, and over all
multiplier unknowns.
"""

import numpy as np
from problems import build, fix, worst

from raymortar import AugmentedLagrangian

E, NU, PRESSURE = 2000.0, 0.3, 25.0
TOLERANCE = 1e-9
MAX_ITERATIONS = 3
# What remains of the solver's residual is not to count as the method's error
ROUNDING = 1e-13
NORMAL = AugmentedLagrangian(condition="points")
VECTOR = AugmentedLagrangian(multiplier="vector")
METHODS = {
    "normal": NORMAL,
    "vector": VECTOR,
    "nodes": AugmentedLagrangian(condition="nodes"),
    "nodes-vector": AugmentedLagrangian(multiplier="vector", condition="nodes"),
    "dual": AugmentedLagrangian(multiplier="dual", condition="nodes"),
}


def errors(problem, stress, normal):
    """Relative errors of the stress, and of the multiplier where there is one.

    `normal` is the slave's in the reference configuration, `stress` what the
    multiplier is the traction of.
    """
    scale = np.linalg.norm(stress @ normal)
    found = {"stress": worst(problem.stress() - stress) / scale}
    if problem.contact.multiplier is not None:
        lam = problem.slave_multiplier()
        vector = lam.shape[1] > 1
        exact = stress @ normal if vector else normal @ stress @ normal
        found["multiplier"] = worst(lam - exact) / scale
    return found


def check(problem, stress, normal, tolerance=TOLERANCE):
    """Stress and multiplier are exact; no slave dof is forgotten."""
    found = errors(problem, stress, normal)
    print({name: f"{value:.1e}" for name, value in found.items()})
    assert max(found.values()) <= tolerance, found


def hydrostatic(dim):
    """Stress, and the strain in all directions."""
    strain = -PRESSURE * (1 - 2 * NU) / E * ((1 + NU) if dim == 2 else 1.0)
    return -PRESSURE * np.eye(dim), strain


def check_hydrostatic(scene, normal, degree=1, method=VECTOR, **options):
    """All outer sides are under pressure but one of each body, which is guided."""
    dim = scene.mesh.geometry.dim
    stress, strain = hydrostatic(dim)
    guided = ["bottom", "upper_left"]
    loaded = [n for n in scene.tags if n not in ("slave", "master", *guided)]
    problem = build(
        scene,
        degree,
        method=method,
        bcs=lambda V, _: [fix(V, scene, guided, value=lambda x: strain * x)],
        loaded=loaded,
        load=stress,
        **options,
    )
    assert problem.solve(rtol=ROUNDING) <= MAX_ITERATIONS, problem.history
    check(problem, stress, normal)
