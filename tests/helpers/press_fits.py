"""A quarter of a shaft in a quarter of a hub, meshed to touch: the interference is an
offset. With Lame's solution."""

from __future__ import annotations

import numpy as np
from problems import COMM, build, fix, worst

from meshes.shaft import HUB, SHAFT, quarters

__all__ = [
    "SHAFT",
    "mean_pressure",
    "plane_strain_equivalent",
    "press_fit",
    "pressure",
    "rms_error",
    "scene_of",
]


def scene_of(around=8, hub_around=10, cell="quadrilateral", geometry_degree=2):
    """Quarters with so many facets on the arcs of shaft and hub. Collective."""
    return quarters(COMM, around, hub_around, cell, geometry_degree)


def plane_strain_equivalent(E, nu):
    """Moduli that make plane strain of plane stress."""
    return E * (1.0 + 2.0 * nu) / (1.0 + nu) ** 2, nu / (1.0 + nu)


def pressure(interference, E_shaft, E_hub, nu_shaft, nu_hub):
    """Lame's pressure in plane stress, per radial interference. Stress."""
    hub = (HUB**2 + SHAFT**2) / (HUB**2 - SHAFT**2) + nu_hub
    return interference / SHAFT / ((1.0 - nu_shaft) / E_shaft + hub / E_hub)


def press_fit(scene, E, nu, interference, degree=2, **options):
    """Problem with the interference as an offset, not yet solved. Collective."""

    def symmetric(V, scene):
        return [fix(V, scene, "bottom", 1), fix(V, scene, "left", 0)]

    return build(
        scene, degree, E=E, nu=nu, bcs=symmetric, offset=-interference, **options
    )


def mean_pressure(contact):
    """Normal traction over the slave surface, and its largest deviation. Collective."""
    points = contact.points()
    p = -np.einsum("qi,qi->q", points["traction"], points["normal"])
    sums = np.array([points["weight"] @ p, points["weight"].sum()])
    mean = float(np.divide(*COMM.allreduce(sums)))
    return mean, worst(p - mean)


def rms_error(contact, exact):
    """Root mean square of the normal traction's error over the slave surface, relative.
    Collective."""
    points = contact.points()
    p = -np.einsum("qi,qi->q", points["traction"], points["normal"])
    weight = points["weight"]
    sums = np.array([weight @ (p / exact - 1.0) ** 2, weight.sum()])
    return float(np.sqrt(np.divide(*COMM.allreduce(sums))))
