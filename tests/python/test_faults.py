"""Files that cannot be read or written, and tags as large as they come."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, build, fix

import raymortar
from raymortar import ContactError, compat
from raymortar.scenes import two_blocks

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


def test_largest_tag_is_a_tag_like_any_other(gmsh_file, tmp_path):
    path = tmp_path / "whole.msh"
    path.write_text(gmsh_file)
    mesh = compat.read_gmsh(path, COMM, 2)
    u = fem.Function(compat.vector_space(mesh.mesh, 1))
    contact = raymortar.Contact(
        u, mesh.facet_tags, [(LARGEST_TAG, 7)], raymortar.AugmentedLagrangian(1.0)
    )
    contact.update()
    assert contact.statistics.hits == contact.statistics.points > 0


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.95])
def test_truncated_meshes_are_refused(gmsh_file, tmp_path, share):
    path = tmp_path / "cut.msh"
    path.write_text(gmsh_file[: int(share * len(gmsh_file))])
    with pytest.raises(ContactError, match="not a whole Gmsh file"):
        compat.read_gmsh(path, COMM, 2)


@pytest.mark.parametrize("seed", range(4))
def test_corrupted_meshes_are_refused(gmsh_file, tmp_path, seed):
    text = np.frombuffer(gmsh_file.encode(), np.uint8).copy()
    rng = np.random.default_rng(seed)
    text[rng.integers(len(text) // 4, len(text), 40)] = ord("x")
    path = tmp_path / "corrupted.msh"
    path.write_bytes(text.tobytes())
    with pytest.raises(ContactError, match="not a whole Gmsh file"):
        compat.read_gmsh(path, COMM, 2)


def test_full_disk_is_reported(pressed, tmp_path):
    """A file that takes no byte: the device that is always full."""
    full = tmp_path / "full.vtu"
    full.symlink_to("/dev/full")
    with pytest.raises(ContactError, match="cannot be written.*No space left"):
        pressed.contact.write_segments(full)


def test_folder_that_is_a_file_is_reported(pressed, tmp_path):
    no_folder = tmp_path / "file"
    no_folder.write_text("")
    with pytest.raises(ContactError, match="cannot be written"):
        compat.write_xdmf(no_folder / "u.xdmf", pressed.scene.mesh, [pressed.u])
    with pytest.raises(ContactError, match="cannot be written"):
        pressed.contact.write_segments(no_folder / "segments.vtu")
