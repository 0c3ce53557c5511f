"""The one-call picture: what is drawn is all of the bodies and the exact pressure."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
import ufl
from dolfinx import fem
from load_paths import blocks
from problems import COMM
from sheared_blocks import Blocks, limit_of
from squeezing import squeeze

import raymortar
from raymortar import ContactError, Coulomb
from raymortar.core import compat
from raymortar.plotting import drawing, rendering
from raymortar.plotting.pieces import pieces_of_one_size

pytest.importorskip("matplotlib")


def cells_of(mesh):
    return COMM.allreduce(mesh.topology.index_map(mesh.topology.dim).size_local)


def outside(mesh):
    return COMM.allreduce(len(compat.exterior_facets(mesh)))


def squeezed(cell):
    """Uniform state: the problem, and the pressure of the closed form."""
    problem, F, P = squeeze(blocks(cell))
    problem.solve()
    return problem, -P[-1, -1]


@pytest.fixture
def squeezed_blocks(cell):
    return squeezed(cell)


@pytest.mark.mpi
@pytest.mark.quick
def test_all_cells_and_the_pressure_of_all_ranks_are_drawn(
    squeezed_blocks, folder, monkeypatch
):
    faces = []

    def split(polygons):
        faces.append(len(polygons))
        return pieces_of_one_size(polygons)

    monkeypatch.setattr(drawing, "pieces_of_one_size", split)
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
        assert faces == [whole]
        opaque = np.array(left.collections[0].get_facecolor())[:, 3] == 1.0
        assert opaque.sum() > 3 * whole
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


@pytest.mark.parametrize("polygon", ["triangle", "quadrilateral"])
def test_polygons_are_split_into_triangles_that_fill_them(polygon):
    """Each the same share of the area, all turned like the polygon."""
    corners = np.array([[0.0, 0.0], [2.0, 1.0], [3.0, 4.0], [1.0, 3.0]])
    corners = corners[: 3 if polygon == "triangle" else 4]
    a, b = (np.roll(corners, -1, axis=0) - corners)[:2]
    area = (a[0] * b[1] - a[1] * b[0]) / (2 if polygon == "triangle" else 1)
    # A bilinear function of the edges' coordinates, which splits keep at their corners
    values = np.array([1.0, 2.0, 5.0, 3.0])[: len(corners), None]
    fine = drawing.shaded(np.hstack([corners, values])[None])
    assert len(fine) >= drawing.SHADED
    (x, y), (z, w) = (fine[:, k, :2].T - fine[:, 0, :2].T for k in (1, 2))
    np.testing.assert_allclose(0.5 * (x * w - y * z), area / len(fine), rtol=1e-12)
    r, s = np.linalg.solve(
        np.column_stack([a, corners[-1]]), fine[..., :2].reshape(-1, 2).T
    )
    last = values[-1, 0] - 1.0
    twist = 0.0 if polygon == "triangle" else 5.0 - 2.0 - last
    exact = 1.0 + r + last * s + twist * r * s
    np.testing.assert_allclose(fine[..., 2].ravel(), exact, atol=1e-12)


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


# CI has no pyvista: VTK, Qt and their like are 65 packages of 300 MB
@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.skipif(rendering.lacking() is not None, reason=str(rendering.lacking()))
def test_pyvista_draws_all_facets_and_the_exact_pressure(cell_3d, tmp_path):
    problem, pressure = squeezed(cell_3d)
    mesh, file = problem.u.function_space.mesh, COMM.bcast(tmp_path) / "contact.png"
    V, whole, hidden = problem.u.function_space, outside(mesh), file.parent / "no"
    x = V.tabulate_dof_coordinates() + problem.u.x.array.reshape(-1, 3)
    parts = [part for part in COMM.allgather(x) if len(part)]
    plotter = raymortar.plot(problem.contact, file, label="u", backend="pyvista")
    with pytest.raises(ContactError, match="no/a.png cannot be written"):
        raymortar.plot(problem.contact, hidden / "a.png", backend="pyvista")
    if COMM.rank > 0:
        assert plotter is None
        return
    assert file.read_bytes().startswith(b"\x89PNG")
    assert np.ptp(plotter.screenshot()) > 200
    plotter.subplot(0, 0)
    (bodies,) = plotter.meshes
    assert bodies.n_cells == whole
    box = np.array(bodies.bounds).reshape(3, 2)
    np.testing.assert_allclose(box[:, 0], np.min(np.concatenate(parts), 0), atol=1e-9)
    np.testing.assert_allclose(box[:, 1], np.max(np.concatenate(parts), 0), atol=1e-9)
    plotter.subplot(0, 1)
    (surface,) = plotter.meshes
    np.testing.assert_allclose(surface["contact pressure"], pressure, rtol=1e-6)
    plotter.close()


@pytest.mark.mpi
def test_backends_that_cannot_draw_say_what_they_lack(monkeypatch):
    flat, solid = (squeeze(blocks(cell))[0] for cell in ("triangle", "hexahedron"))
    for problem in (flat, solid):
        problem.contact.update()
    with pytest.raises(ContactError, match="backend 'pyvista' draws bodies in 3D"):
        raymortar.plot(flat.contact, backend="pyvista")
    with pytest.raises(ContactError, match="'vtk' is not one of matplotlib, pyvista"):
        raymortar.plot(flat.contact, backend="vtk")
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(ContactError, match="needs pyvista .*: apt install"):
        raymortar.plot(solid.contact, backend="pyvista")


@pytest.mark.parametrize("kind, works", [("vtkX", False), ("vtkEGL", True)])
def test_windows_of_an_x_server_need_a_display(kind, works, monkeypatch):
    """Without one VTK would end the program; its other windows need none."""

    class Window:
        def GetClassName(self):
            return f"{kind}OpenGLRenderWindow"

    core = SimpleNamespace(vtkRenderWindow=Window)
    for name in ("pyvista", "vtkmodules", "vtkmodules.vtkRenderingOpenGL2"):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace())
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkRenderingCore", core)
    monkeypatch.delenv("DISPLAY", raising=False)
    assert works == (rendering.lacking() is None)
    monkeypatch.setenv("DISPLAY", ":99")
    assert rendering.lacking() is None


@pytest.mark.parametrize("largest, ends", [(0.5, "neither"), (2.0, "max")])
def test_a_bar_of_cut_colours_has_an_arrow(largest, ends):
    from matplotlib.figure import Figure

    square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    figure = Figure()
    axes = figure.subplots()
    values = np.full((1, 4, 1), largest)
    colours = drawing.draw_field(axes, square, values, top=1.0)
    assert figure.colorbar(colours, ax=axes).extend == ends
