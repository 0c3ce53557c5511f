"""The one-call picture: what is drawn is all of the bodies and the exact pressure."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import ufl
from dolfinx import fem

import raymortar
from load_paths import blocks
from problems import COMM, squeeze
from raymortar import ContactError, Coulomb, compat
from sheared_blocks import Blocks, limit_of

pytest.importorskip("matplotlib")


def cells_of(mesh):
    return COMM.allreduce(mesh.topology.index_map(mesh.topology.dim).size_local)


def outside(mesh):
    return COMM.allreduce(len(compat.exterior_facets(mesh)))


@pytest.fixture
def squeezed_blocks(cell):
    """Uniform state: the problem, and the pressure of the closed form."""
    problem, F, P = squeeze(blocks(cell))
    problem.solve()
    return problem, -P[-1, -1]


@pytest.mark.mpi
@pytest.mark.quick
def test_all_cells_and_the_pressure_of_all_ranks_are_drawn(squeezed_blocks, folder):
    problem, pressure = squeezed_blocks
    mesh, file = problem.u.function_space.mesh, folder / "contact.png"
    hits = problem.contact.statistics.hits
    whole = cells_of(mesh) if problem.dim == 2 else outside(mesh)
    figure = raymortar.plot(problem.contact, file)
    if COMM.rank > 0:
        assert figure is None
        return
    assert file.read_bytes().startswith(b"\x89PNG")
    left, right = (axes for axes in figure.axes if axes.get_label() != "<colorbar>")
    drawn = [c for c in left.collections if hasattr(c, "get_paths") and c.get_paths()]
    if problem.dim == 2:
        assert len(drawn[-1].get_paths()) == whole
        x, y = right.lines[0].get_data()
        assert len(x) == hits
        np.testing.assert_allclose(y, pressure, rtol=1e-6)
        assert len(right.lines) == 1
    else:
        assert len(left.collections[0].get_facecolor()) == whole
        values = right.collections[0].get_array()
        np.testing.assert_allclose(values, pressure, rtol=1e-6)


@pytest.mark.mpi
def test_friction_has_a_curve_of_its_own():
    """At its limit: mu times the pressure, and its colours are explained."""
    blocks = Blocks("quadrilateral", raymortar.AugmentedLagrangian(), Coulomb(0.3))
    blocks.press()
    blocks.step(limit_of(Coulomb(0.3), 2), 0.1)
    figure = raymortar.plot(blocks.contact)
    if COMM.rank == 0:
        from matplotlib import pyplot

        normal, along = (line.get_ydata() for line in figure.axes[1].lines)
        np.testing.assert_allclose(along, 0.3 * normal, rtol=1e-6)
        assert figure.axes[1].get_legend() is not None
        pyplot.close(figure)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["expression", "vector", "cellwise", "nodal"])
def test_bodies_take_their_colours_from_any_field(kind):
    """Of the uniform state, or of a function that is 3 everywhere."""
    problem, F, P = squeeze(blocks("triangle"))
    problem.solve()
    mesh, value = problem.u.function_space.mesh, 3.0
    if kind == "expression":
        field = ufl.det(ufl.Identity(2) + ufl.grad(problem.u))
        value = np.linalg.det(F)
    else:
        space = {
            "vector": compat.vector_space(mesh, 1),
            "cellwise": compat.space(mesh, "DG", 0),
            "nodal": compat.scalar_space(mesh, 1),
        }[kind]
        field = fem.Function(space, name="three")
        field.x.array[:] = 3.0 / np.sqrt(2.0 if kind == "vector" else 1.0)
    figure = raymortar.plot(problem.contact, field=field)
    if COMM.rank == 0:
        from matplotlib import pyplot

        left = figure.axes[0]
        np.testing.assert_allclose(left.collections[0].get_array(), value, rtol=1e-8)
        names = {axes.get_ylabel() for axes in figure.axes}
        assert ("three" if kind != "expression" else "field") in names
        pyplot.close(figure)


@pytest.mark.mpi
def test_what_is_lacking_is_said_on_all_ranks(monkeypatch, folder):
    problem, _, _ = squeeze(blocks("triangle"))
    problem.contact.update()
    nowhere = folder / "nowhere" / "a.png"
    with pytest.raises(ContactError, match="nowhere/a.png cannot be written"):
        raymortar.plot(problem.contact, nowhere)
    with pytest.raises(ContactError, match="a.word cannot be written"):
        raymortar.plot(problem.contact, nowhere.with_name("a.word"))
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ContactError, match="needs matplotlib .*: apt install"):
        raymortar.plot(problem.contact)
