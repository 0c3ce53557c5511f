"""Damaged files, full disks, the largest tags, ranks without facets, no memory."""

from petsc4py import PETSc

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from materials import MATERIALS, lame
from problems import CELLS, COMM, DIMENSION, SOLVERS, build, fix, symmetry, worst
from squeezing import homogeneous

import raymortar
from meshes.scenes import two_blocks
from raymortar import ContactError
from raymortar.core import compat
from raymortar.io import read_gmsh, write_xdmf
from raymortar.setup import memory

LARGEST_TAG = 2**31 - 1


@pytest.fixture
def pressed():
    """Two blocks, pressed."""
    problem = build(
        two_blocks(COMM, 2),
        bcs=lambda V, s: [
            fix(V, s, "bottom"),
            fix(V, s, "top", None, lambda x: np.outer(np.ones(len(x)), [0, -0.05])),
        ],
    )
    problem.solve()
    return problem


@pytest.fixture(scope="module")
def gmsh_file(tmp_path_factory):
    """A whole file of two squares, its text."""
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path_factory.mktemp("gmsh") / "squares.msh"
    gmsh.initialize(["", "-v", "1"])
    try:
        for k in range(2):
            gmsh.model.occ.addRectangle(0, 1.0 * k, 0, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1, 2], 1)
        gmsh.model.addPhysicalGroup(1, [3], 7)
        gmsh.model.addPhysicalGroup(1, [5], LARGEST_TAG)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path.read_text()


@pytest.mark.mpi
def test_largest_tag_is_a_tag_like_any_other(gmsh_file, tmp_path):
    path = tmp_path / "whole.msh"
    path.write_text(gmsh_file)
    mesh = read_gmsh(path, COMM, 2)
    u = fem.Function(compat.vector_space(mesh.mesh, 1))
    contact = raymortar.Contact(
        u, mesh.facet_tags, [(LARGEST_TAG, 7)], raymortar.AugmentedLagrangian(1.0)
    )
    contact.update()
    assert contact.statistics.hits == contact.statistics.points > 0


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.95])
def test_truncated_meshes_are_refused(gmsh_file, tmp_path, share):
    path = tmp_path / "cut.msh"
    path.write_text(gmsh_file[: int(share * len(gmsh_file))])
    with pytest.raises(ContactError, match="not a whole Gmsh file"):
        read_gmsh(path, COMM, 2)


@pytest.mark.mpi
@pytest.mark.parametrize("seed", range(4))
def test_corrupted_meshes_are_refused(gmsh_file, tmp_path, seed):
    text = np.frombuffer(gmsh_file.encode(), np.uint8).copy()
    rng = np.random.default_rng(seed)
    text[rng.integers(len(text) // 4, len(text), 40)] = ord("x")
    path = tmp_path / "corrupted.msh"
    path.write_bytes(text.tobytes())
    with pytest.raises(ContactError, match="not a whole Gmsh file"):
        read_gmsh(path, COMM, 2)


@pytest.mark.mpi
def test_full_disk_is_reported(pressed, folder):
    """A file that takes no byte: the device that is always full. Of several ranks the
    last one's disk."""
    last = COMM.size - 1
    if COMM.rank == last:
        name = f"full_{last}.vtu" if last else "full.vtu"
        (folder / name).symlink_to("/dev/full")
    with pytest.raises(ContactError, match="cannot be written.*No space left"):
        pressed.contact.results.write_segments(folder / "full.vtu")


@pytest.mark.mpi
def test_folder_that_is_a_file_is_reported(pressed, folder):
    no_folder = folder / "file"
    no_folder.write_text("")
    with pytest.raises(ContactError, match="cannot be written"):
        write_xdmf(no_folder / "u.xdmf", pressed.scene.mesh, [pressed.u])
    with pytest.raises(ContactError, match="cannot be written"):
        pressed.contact.results.write_segments(no_folder / "segments.vtu")


def all_on_the_last(midpoints, size):
    return np.full(len(midpoints), size - 1)


def interface_on_the_last(midpoints, size):
    near = np.abs(midpoints[:, 1] - 1.0) < 0.3
    return np.where(near, size - 1, 0)


@pytest.mark.mpi
@pytest.mark.parametrize("partition", [all_on_the_last, interface_on_the_last])
@pytest.mark.parametrize("solver", SOLVERS)
def test_ranks_without_a_cell_or_a_facet_take_part(partition, solver):
    scene = two_blocks(COMM, 2, "quadrilateral", 4, 5, partition=partition)
    # Numbers: DOLFINx 0.5 crashes in V.sub(i).collapse() on a rank without cells
    problem = build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [
            *symmetry(V, s),
            fix(V, s, "bottom", 1),
            fix(V, s, "top", 1, -0.4),
        ],
    )
    F = homogeneous(2)
    pressure = MATERIALS["neo-hookean"][1](F - np.eye(2), *lame(2000, 0.3))[1, 1]
    facets = [len(z.facets.slave.facets) for z in problem.contact.zones]
    assert COMM.rank == COMM.size - 1 or sum(facets) == 0
    problem.solve(solver)
    assert worst(problem.gradient() + np.eye(2) - F) < 1e-8
    assert worst(problem.slave_multiplier() / pressure - 1.0) < 1e-8


# Memory


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_guess_of_the_matrix_is_less_than_its_size(cell, degree):
    """But not by far, or it would warn of nothing."""
    dim = DIMENSION[cell]
    problem = build(two_blocks(COMM, dim, cell, 4, 5), degree)
    contact, A = problem.contact, problem.problem.create_matrix()
    (zone,) = contact.zones
    guess = COMM.allreduce(memory.contact_entries(zone, contact.layout.components))
    volume = assemble_matrix(problem.problem.a)
    volume.assemble()
    every = PETSc.Mat.InfoType.GLOBAL_SUM
    added = A.getInfo(every)["nz_used"] - volume.getInfo(every)["nz_used"]
    print(guess, added)
    assert added / 4 < guess < added


def test_machine_tells_its_memory():
    available = memory.available_memory()
    assert available is None or 1e6 < available < 1e15


@pytest.mark.mpi
@pytest.mark.quick
def test_matrix_that_cannot_fit_is_refused_on_every_rank(monkeypatch):
    """Before it is allocated; only one rank's machine is short of memory."""
    problem = build(two_blocks(COMM, 2))
    last = COMM.rank == COMM.size - 1
    monkeypatch.setattr(memory, "available_memory", lambda: 1000 if last else None)
    with pytest.raises(
        MemoryError, match=r"takes at least .* GB .* 1e-06 GB are avail"
    ):
        problem.problem.create_matrix()
    monkeypatch.undo()
    assert problem.problem.create_matrix().getSize()[0] > 0
