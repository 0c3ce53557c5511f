"""An annulus turned against a flat surface (R6): torque of friction at any step.

Everything is prescribed, the pressure p is uniform: M = (2/3) mu p pi (b^3 - a^3),
and no friction acts along the radius.
"""

from __future__ import annotations

import gathered
import numpy as np
import pytest
from spinning import DEPTH, GAMMA, INNER, MU, OUTER, Scene


@pytest.mark.mpi(where=lambda cell, step, **_: cell == "hexahedron" and step == 0.5)
@pytest.mark.parametrize("step", [0.01, 0.1, 0.5, 1.5])
@pytest.mark.parametrize("share", [0.0, 1.0, 0.4])  # of the turn that the ring makes
@pytest.mark.parametrize("master", ["plane", "plate"])
@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_torque_is_that_of_the_whole_path(cell, master, share, step, record_property):
    scene = Scene(cell, master)
    scene.turn(share * step, (share - 1.0) * step)
    p = gathered.points(scene.contact)
    x, t, area = p["x"][:, :2], p["traction"][:, :2], p["weight"]
    r = np.linalg.norm(x, axis=1)
    torque = -area @ (x[:, 0] * t[:, 1] - x[:, 1] * t[:, 0])
    bound = MU * GAMMA * DEPTH
    # Of the facets there are, whose inner and outer rims are polygons
    assert torque == pytest.approx(bound * area @ r, rel=1e-9)
    radial = np.abs(np.einsum("qi,qi->q", x, t)) / r
    record_property("radial", radial.max() / bound)
    assert radial.max() <= 1e-9 * bound
    whole = 2.0 / 3.0 * np.pi * (OUTER**3 - INNER**3)
    polygon = abs(area @ r / whole - 1.0)
    assert abs(torque / (bound * whole) - 1.0) <= 1e-3 + polygon


@pytest.mark.parametrize("step", [0.5, 1.5])
def test_turning_together_is_no_slip(step):
    scene = Scene("hexahedron", "plate")
    scene.turn(step, step)
    assert np.abs(gathered.points(scene.contact)["slip"]).max() <= 1e-13
