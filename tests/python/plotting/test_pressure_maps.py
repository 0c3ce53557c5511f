"""Maps of the pressure in 3D: seen along the mean normal, and zoomed to contact."""

import numpy as np
import pytest
from problems import COMM, build, fix
from rigid_scenes import press, shapes

import raymortar
from meshes.scenes import two_blocks
from raymortar import rigid
from raymortar.plotting import rendering
from raymortar.plotting.gathering import joined
from raymortar.plotting.views import name_of, plane_of

pytest.importorskip("matplotlib")


@pytest.mark.parametrize("axis, names", [(0, "yz"), (1, "xz"), (2, "xy")])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_normals_along_axes_leave_the_other_axes(axis, names, sign):
    frame = plane_of(sign * np.eye(3)[axis])
    assert "".join(map(name_of, frame)) == names
    assert (frame[frame != 0.0] == 1.0).all()


def test_planes_are_across_their_normals():
    random = np.random.default_rng(2)
    for _ in range(50):
        normal = random.normal(size=3)
        normal /= np.linalg.norm(normal)
        frame = np.vstack([plane_of(normal), normal])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)


def test_oblique_directions_are_named_by_components():
    assert name_of(np.array([0.6, 0.0, 0.8])) == "along (0.60, 0.00, 0.80)"


def map_of(figure):
    """The axes of the pressure."""
    (found,) = (
        axes
        for axes in figure.axes
        if axes.get_label() != "<colorbar>" and not hasattr(axes, "zaxis")
    )
    return found


@pytest.mark.mpi
def test_the_map_is_zoomed_to_the_points_in_contact(folder):
    """A ball on a block: contact is a small part of the slave surface."""
    ball = rigid.Body(shapes(3)["sphere"])
    problem = press("hexahedron", ball, material="linear").problem
    raymortar.SNESSolver(problem).solve()
    contact = problem.contact
    figure = raymortar.plot(contact, folder / "ball.png")
    points = contact.points()
    active = points["x"][points["status"] >= 2]
    parts = COMM.gather(active[:, :2], root=0)
    if COMM.rank == 0:
        at = np.concatenate(parts)
        axes = map_of(figure)
        assert axes.get_xlabel() == "x" and axes.get_ylabel() == "y"
        for k, (lower, upper) in enumerate((axes.get_xlim(), axes.get_ylim())):
            assert lower <= at[:, k].min() and at[:, k].max() <= upper
            assert upper - lower <= 1.31 * np.ptp(at, axis=0).max()


def pressed_down(t):
    return np.tile([0.0, 0.0, -0.01], (len(t), 1))


def shown_at(drawn, at):
    """Values of what is drawn last at points (n, 2): of the triangles there."""
    mesh = drawn._triangulation
    corners = np.stack([mesh.x, mesh.y], axis=1)[mesh.triangles]
    ways = np.roll(corners, -1, axis=1) - corners
    to = at[:, None, None] - corners
    sides = ways[..., 0] * to[..., 1] - ways[..., 1] * to[..., 0]
    inside = (sides > 0.0).all(axis=2) | (sides < 0.0).all(axis=2)
    assert inside.any(axis=1).all()
    last = inside.shape[1] - 1 - np.argmax(inside[:, ::-1], axis=1)
    return drawn.get_array()[mesh.triangles[last]].mean(axis=1)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_only_the_covered_part_of_a_facet_shows_pressure(cell):
    """The upper block hangs over two sides of the lower one, by parts of a facet. Both
    rise by two degrees, so that facets lie behind each other."""
    scene = two_blocks(COMM, 3, cell, 2, 3, overhang=(0.4, 0.3))
    scene.mesh.geometry.x[:, 2] += 0.03 * scene.mesh.geometry.x[:, 0]
    case = build(
        scene,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=pressed_down)],
    )
    case.solve()
    figure = raymortar.plot(case.contact)
    if COMM.rank == 0:
        random = np.random.default_rng(5)
        at = np.array([0.4, 0.3]) + random.uniform(0.02, 0.98, size=(200, 2))
        at = at[np.abs(at - 1.0).min(axis=1) > 0.02]
        pressure = shown_at(map_of(figure).collections[0], at)
        np.testing.assert_array_equal(pressure > 0.0, (at < 1.0).all(axis=1))


def test_cells_of_vtk_have_no_point_twice():
    square = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    cells = rendering._cells(joined((square, square[:, :3])))
    np.testing.assert_array_equal(cells, [4, 0, 1, 2, 3, 3, 4, 5, 6])


@pytest.mark.mpi
def test_a_leaning_surface_is_seen_along_its_normal():
    """Two blocks, turned as one by 30 degrees: the map has their true size."""
    angle = np.radians(30.0)
    turn = np.array(
        [
            [np.cos(angle), 0.0, np.sin(angle)],
            [0.0, 1.0, 0.0],
            [-np.sin(angle), 0.0, np.cos(angle)],
        ]
    )
    scene = two_blocks(COMM, 3, "hexahedron", 2, 3)
    x = scene.mesh.geometry.x
    x[:] = x @ turn.T
    down = -0.01 * turn[:, 2]

    def pressed(t):
        return np.tile(down, (len(t), 1))

    case = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=pressed)]
    )
    case.solve()
    figure = raymortar.plot(case.contact)
    if COMM.rank == 0:
        axes = map_of(figure)
        assert axes.get_ylabel() == "y"
        assert axes.get_xlabel() in (
            "along (0.87, 0.00, -0.50)",
            "along (-0.87, 0.00, 0.50)",
        )
        left, right = axes.get_xlim()
        assert 0.9 <= right - left <= 1.4
