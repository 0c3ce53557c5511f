"""Tractions of dual multipliers, as one looks at them: what nodes have, in between."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
from condensing import DUAL
from problems import COMM, DIMENSION, worst
from rigid_scenes import press, solved
from written import arrays

import raymortar
from raymortar import rigid
from raymortar.core.discretization.facets import interpolate

pytestmark = pytest.mark.mpi
R, DEPTH = 0.8, 0.05


def pressed(cell, degree, n=5):
    """A ball in a block, in contact with few facets."""
    ball = rigid.Circle if DIMENSION[cell] == 2 else rigid.Sphere
    centre = (0.47, 0.53)[: DIMENSION[cell] - 1] + (1.0 + R,)
    found = press(cell, ball(centre, R), n, degree, method=DUAL)
    found.body.move((*[0.0] * (DIMENSION[cell] - 1), -DEPTH))
    solved(found)
    return found


def nodal_peak(contact):
    """Largest pressure of the nodes; none pulls."""
    p = contact.pressure().x.array
    peak = worst(p)
    assert gathered.everywhere(p.min() >= -1e-9 * peak)
    assert peak > 0.0
    return peak


@pytest.mark.parametrize("degree", [1, 2])
def test_points_have_no_tension_and_the_forces_of_the_integrals(cell, degree):
    contact = pressed(cell, degree).contact
    peak, points = nodal_peak(contact), gathered.points(contact)
    p, closed = points["pressure"], points["status"] > 1
    assert p.min() >= -1e-9 * peak and 0.4 * peak < p.max() <= peak
    # Those of the dual functions jump
    (zone,) = contact.zones
    jumps = gathered.dictionary(zone.points())
    assert -jumps["pressure"].min() > 0.05 * peak
    assert jumps["pressure"].max() > 1.01 * p.max()
    force = contact.resultant().force
    sums = points["weight"] @ points["traction"]
    np.testing.assert_allclose(sums, force, atol=1e-12 * np.linalg.norm(force))
    normal = np.einsum("qi,qi->q", points["traction"], points["contact_normal"])
    np.testing.assert_allclose(normal[closed], -p[closed], atol=1e-12 * peak)


@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("hexahedron", 2)])
def test_points_have_the_values_of_the_multiplier_as_a_function(cell, degree):
    contact = pressed(cell, degree).contact
    (zone,), points, lam = contact.zones, contact.points(), contact.multiplier
    nodal = lam.x.array.reshape(-1, DIMENSION[cell])[zone.multiplier_table]
    shape = zone.facets.slave_surface.shape
    expected = interpolate(shape, 1, nodal[points["slave"]], points["xi"])
    expected[points["status"] == 0] = 0.0
    peak = worst(lam.x.array)
    assert worst(points["traction"] - expected) <= 1e-12 * peak


@pytest.mark.parametrize(
    "cell, degree", [("quadrilateral", 1), ("triangle", 2), ("tetrahedron", 1)]
)
def test_peaks_pictures_and_files(cell, degree, folder):
    found = pressed(cell, degree)
    contact = found.contact
    peak = nodal_peak(contact)
    history = raymortar.History(found.problem, patches=True)
    history.record(1.0)
    for value in (
        contact.statistics.max_pressure,
        history["max_pressure"][-1],
        history["max_pressure_0"][-1],
    ):
        assert value == pytest.approx(peak, rel=1e-9)
    figure = raymortar.plot(contact, folder / "dual.png")
    contact.results.write_segments(folder / "dual.vtu")
    if COMM.rank > 0:
        return
    if DIMENSION[cell] == 2:
        (line,) = figure.axes[1].lines
        drawn = line.get_ydata()
        assert drawn.min() >= -1e-9 * peak and 0.4 * peak < drawn.max() <= peak
    if COMM.size == 1:
        for name in ("dual.vtu", "dual_points.vtu"):
            p = arrays(folder / name)["pressure"]
            p = p[np.isfinite(p)]
            assert p.min() >= -1e-9 * peak and 0.0 < p.max() <= peak
