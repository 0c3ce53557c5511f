"""Every writer's file, read back: all fields next to the displacement, to the digit."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import dolfinx
import numpy as np
import pytest
from problems import COMM, DIMENSION, build
from written import at_nodes

from meshes.scenes import two_blocks
from raymortar import ContactError, Coulomb
from raymortar.io import of_one_degree, write_vtk, write_xdmf

HAS_ADIOS2 = getattr(dolfinx, "has_adios2", False)  # DOLFINx 0.5 does not say


def pressed_in(cell, degree=1):
    """Upper block that sticks out by a quarter of its width, pressed in by 0.01.

    Displacement and multiplier are no solution, but differ from node to node.
    """
    scene = two_blocks(COMM, DIMENSION[cell], cell, 4, 3, overhang=0.25, gap=-0.01)
    problem = build(scene, degree, friction=Coulomb(0.3))
    x = problem.u.function_space.tabulate_dof_coordinates()
    problem.u.x.array[:] = 1e-3 * np.sin(x[:, : problem.dim]).ravel()
    multiplier = problem.contact.multiplier
    x = multiplier.function_space.tabulate_dof_coordinates()
    multiplier.x.array[:] = -np.cos(x[:, : problem.dim]).ravel()
    problem.contact.update()
    return problem, [problem.u, *problem.contact.fields()]


def compare(read, functions, count):
    """What was read, {name: {position: values}}, with functions at those nodes."""
    assert set(read) == {f.name for f in functions}
    for f in functions:
        exact = at_nodes(f)
        assert len(read[f.name]) == count(exact)
        for x, values in read[f.name].items():
            n = len(exact[x])
            np.testing.assert_allclose(values[:n], exact[x], rtol=1e-12, atol=1e-15)
            assert not np.any(values[n:])


def from_xdmf(path):
    """Fields of an XDMF file at the nodes of its mesh."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path.with_suffix(".h5"), "r") as file:
        geometry = next(iter(file["Mesh"].values()))["geometry"][:]
        x = np.zeros((len(geometry), 3))
        x[:, : geometry.shape[1]] = np.round(geometry, 9) + 0.0
        return {
            name: dict(zip(map(tuple, x), next(iter(steps.values()))[:].tolist()))
            for name, steps in file["Function"].items()
        }


def from_vtk(folder):
    """Fields of all .vtu files at their points."""
    found = {}
    for path in sorted(folder.rglob("*.vtu")):
        arrays = {}
        for kind in ("Points", "PointData"):
            for array in ElementTree.parse(path).find(f".//{kind}").iter("DataArray"):
                values = np.array(array.text.split(), dtype=float)
                width = int(array.get("NumberOfComponents") or 1)
                arrays[
                    kind if kind == "Points" else array.get("Name")
                ] = values.reshape(-1, max(width, 1))
        x = map(tuple, np.round(arrays.pop("Points"), 9) + 0.0)
        x = list(x)
        for name, values in arrays.items():
            if not name.startswith("vtk"):  # numbers and ghosts of the points
                found.setdefault(name, {}).update(zip(x, values.tolist()))
    return found


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_xdmf_has_all_fields_at_the_nodes_of_the_mesh(cell, folder):
    path = folder / "out.xdmf"
    problem, functions = pressed_in(cell)
    write_xdmf(path, problem.u.function_space.mesh, functions)
    COMM.barrier()
    compare(from_xdmf(path), functions, len)


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("cell, degree", [("triangle", 2), ("tetrahedron", 1)])
def test_vtk_has_all_fields_at_all_nodes(cell, degree, folder):
    problem, functions = pressed_in(cell, degree)
    write_vtk(folder / "out.pvd", problem.u.function_space.mesh, functions)
    COMM.barrier()
    compare(from_vtk(folder), functions, len)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, degree, version",
    [("quadrilateral", 2, "1.0"), ("hexahedron", 1, "1.0"), ("hexahedron", 2, "2.2")],
)
def test_readers_of_python_know_the_version(cell, degree, version, folder):
    """That of meshio, but where the order of nodes is of a later one."""
    problem, functions = pressed_in(cell, degree)
    write_vtk(folder / "out.pvd", problem.u.function_space.mesh, functions)
    COMM.barrier()
    files = list(folder.rglob("*.vtu"))
    assert len(files) == COMM.size
    roots = [ElementTree.parse(path).getroot() for path in files]
    assert {root.get("version") for root in roots} == {version}


@pytest.mark.parametrize("cell, degree", [("triangle", 2), ("hexahedron", 1)])
def test_meshio_reads_all_fields(cell, degree, folder):
    meshio = pytest.importorskip("meshio")
    problem, functions = pressed_in(cell, degree)
    write_vtk(folder / "out.pvd", problem.u.function_space.mesh, functions)
    read = meshio.read(*folder.rglob("*.vtu"))
    places = [tuple(x) for x in np.round(read.points, 9) + 0.0]
    found = {}
    for f in functions:
        values = read.point_data[f.name].reshape(len(places), -1).tolist()
        found[f.name] = dict(zip(places, values))
    compare(found, functions, len)


@pytest.mark.mpi
def test_fields_of_two_degrees_are_written_at_the_finer_nodes(folder):
    """3D: the multiplier has degree 1, the displacement 2; linear in between."""
    problem, functions = pressed_in("tetrahedron", 2)
    write_vtk(folder / "out.pvd", problem.u.function_space.mesh, functions)
    COMM.barrier()
    read = from_vtk(folder)
    assert {len(values) for values in read.values()} == {len(at_nodes(problem.u))}
    compare({"f": read["f"]}, [problem.u], len)
    coarse = at_nodes(problem.contact.status())
    for x, values in coarse.items():
        assert read["status"][x][0] == pytest.approx(values[0], abs=1e-12)


def as_vtx(function):
    """Values as they lie in a VTX file: node by node, vectors filled up to three."""
    width = function.function_space.dofmap.index_map_bs
    rows = function.x.array.reshape(-1, width)
    filled = np.zeros((len(rows), 1 if width == 1 else 3))
    filled[:, :width] = rows
    return filled.tobytes()


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.skipif(not HAS_ADIOS2, reason="DOLFINx without ADIOS2")
@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("tetrahedron", 2)])
def test_vtx_has_all_fields_at_all_nodes(cell, degree, tmp_path):
    """Each rank's block of each field, and one set of points for all of them.

    ADIOS2 files are read by their bytes, as their Python module is rarely there.
    """
    from dolfinx.io import VTXWriter

    path = COMM.bcast(tmp_path) / "out.bp"
    problem, functions = pressed_in(cell, degree)
    written = of_one_degree(functions)
    with VTXWriter(COMM, path, written) as file:
        file.write(0.5)
    COMM.barrier()
    data = b"".join(part.read_bytes() for part in path.glob("data.*"))
    names = b"".join(part.read_bytes() for part in path.glob("*md.*"))
    x = problem.u.function_space.tabulate_dof_coordinates()
    assert x.tobytes() in data
    for f in written:
        np.testing.assert_array_equal(f.function_space.tabulate_dof_coordinates(), x)
        assert as_vtx(f) in data
        assert f.name.encode() in names


@pytest.mark.mpi
def test_vtk_into_no_folder_is_reported(folder):
    problem, functions = pressed_in("triangle")
    path = folder / "nowhere" / "out.pvd"
    with pytest.raises(ContactError, match="nowhere/out.pvd cannot be written"):
        write_vtk(path, problem.u.function_space.mesh, functions)
