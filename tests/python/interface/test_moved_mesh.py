"""A mesh that is moved after `Contact` was made: refused where contact depends on it."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, build, fix, worst

import raymortar
from meshes.scenes import two_blocks
from raymortar import ContactError, Penalty
from raymortar.core import compat

pytestmark = [pytest.mark.quick, pytest.mark.mpi]
MOVED = (
    r"node\(s\) of the contact surfaces have moved in the mesh since Contact was made"
)


def pressed(scene, degree=1, **options):
    """Two blocks, the upper one pushed down by a twentieth."""

    def bcs(V, scene):
        down = np.zeros(scene.mesh.geometry.dim)
        down[-1] = -0.05
        return [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, fem.Constant(scene.mesh, down)),
        ]

    return build(scene, degree, bcs=bcs, **options)


def upper_nodes(scene):
    """Geometry nodes of the upper block, wherever they are."""
    cells = scene.cell_tags.find(scene.bodies["upper"])
    return np.unique(compat.geometry_dofmap(scene.mesh)[cells])


@pytest.mark.parametrize("cell, dim", [("triangle", 2), ("hexahedron", 3)])
@pytest.mark.parametrize("degree", [1, 2])
def test_a_body_that_is_moved_is_refused(cell, dim, degree):
    scene = two_blocks(COMM, dim, cell, 2, 3)
    problem = pressed(scene, degree)
    problem.solve()
    scene.mesh.geometry.x[upper_nodes(scene), dim - 1] += 0.5
    with pytest.raises(ContactError, match=MOVED + ".* make contact"):
        problem.contact.update()
    with pytest.raises(ContactError, match=MOVED):
        problem.solve()


@pytest.mark.parametrize("surface", ["slave", "master"])
def test_one_node_that_one_rank_has_moved_is_seen_by_all(surface):
    scene = two_blocks(COMM, 2, "quadrilateral", 3, 4)
    problem = pressed(scene, method=Penalty(1e3))
    (zone,) = problem.contact.zones
    side = zone.facets.slave if surface == "slave" else zone.facets.masters[0]
    owner = COMM.allreduce(COMM.rank if len(side.cells) else -1, max)
    if COMM.rank == owner:
        corners = compat.geometry_dofmap(scene.mesh)[side.cells[0]]
        on = np.isclose(scene.mesh.geometry.x[corners, 1], 1.0)
        scene.mesh.geometry.x[corners[on][0], 0] += 1e-7
    with pytest.raises(ContactError, match="1 " + MOVED) as info:
        problem.contact.update()
    assert len(set(COMM.allgather(str(info.value)))) == 1


def test_coordinates_that_are_no_numbers_are_seen():
    scene = two_blocks(COMM, 2, "triangle", 2, 2)
    problem = pressed(scene)
    scene.mesh.geometry.x[:, 0] = np.nan
    with pytest.raises(ContactError, match=MOVED):
        problem.contact.update()


def test_nodes_off_the_contact_may_move():
    """The volume's forms see them, and the solution is that of the mesh as it is."""

    def shake(scene):
        x = scene.mesh.geometry.x
        inside = np.abs(x[:, 1] - 1.0) > 0.1
        inside &= (x[:, 1] > 0.01) & (x[:, 1] < 1.99)
        x[inside, :2] += 0.02 * np.sin(9.0 * x[inside, :2])

    found = []
    for before in (True, False):
        scene = two_blocks(COMM, 2, "triangle", 3, 4)
        if before:
            shake(scene)
        problem = pressed(scene, method=raymortar.AugmentedLagrangian(4e3))
        if not before:
            shake(scene)
        problem.solve()
        found.append(problem.u.x.array.copy())
    assert worst(found[1] - found[0]) < 1e-11


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_displacement_added_and_taken_off_again_is_no_movement(scale):
    """As for pictures of the deformed mesh; that rounds."""
    scene = two_blocks(COMM, 2, "triangle", 3, 4)
    problem = pressed(scene)
    problem.solve()
    x, shift = scene.mesh.geometry.x, scale * np.array([0.1, 0.7, 0.0])
    problem.u.x.array[:] += np.tile(shift[:2], len(problem.u.x.array) // 2)
    before = x.copy()
    for _ in range(3):
        x += shift
        x -= shift
    assert not np.array_equal(x, before)
    problem.contact.update()


def test_load_steps_do_not_halve_for_it():
    scene = two_blocks(COMM, 2, "triangle", 2, 3)
    problem = pressed(scene)

    def apply(t):
        scene.mesh.geometry.x[:, 1] += 0.1

    solver = raymortar.SNESSolver(problem.problem)
    with pytest.raises(ContactError, match=MOVED):
        raymortar.LoadSteps(solver, apply, 2, progress=False).run()


def test_contact_made_anew_takes_the_tractions_over():
    """Springs of friction too, which a contact that starts anew would not have."""
    scene = two_blocks(COMM, 2, "quadrilateral", 3, 4)
    problem = pressed(scene, method=Penalty(1e4), friction=raymortar.Coulomb(0.3))
    problem.solve()
    problem.contact.advance()
    state = problem.contact.state()
    problem.solve()  # the next step, in which nothing is moved
    old = problem.contact.points()["traction"]
    scene.mesh.geometry.x[:] += [3.0, -2.0, 0.0]
    anew = pressed(scene, method=Penalty(1e4), friction=raymortar.Coulomb(0.3))
    anew.contact.restore(state)
    anew.solve()
    assert worst(old[:, 0]) > 1e-3 * worst(old)
    assert worst(anew.contact.points()["traction"] - old) < 1e-8 * worst(old)
