"""A quarter of a shaft in a quarter of a hub, meshed to touch: the interference is an
offset. Scene and Lame's solution are those of the demo."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from problems import COMM, build, fix, worst

sys.path.insert(0, str(Path(__file__).parents[2] / "demos"))

import press_fit_lame  # noqa: E402
from press_fit_lame import plane_strain_equivalent, pressure  # noqa: E402

__all__ = [
    "mean_pressure",
    "plane_strain_equivalent",
    "press_fit",
    "pressure",
    "rms_error",
    "scene_of",
]


def scene_of(around=8, hub_around=10, cell="quadrilateral", geometry_degree=2):
    """Quarters with so many facets on the arcs of shaft and hub. Collective."""
    return press_fit_lame.quarters(COMM, around, hub_around, cell, geometry_degree)


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
