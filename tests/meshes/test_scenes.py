"""Ready-made scenes: shapes, tags, sizes of facets, quality."""

from mpi4py import MPI

import mesh_measures as measure
import numpy as np
import pytest

from meshes.scenes import (
    cylinder_on_block,
    sphere_on_plane,
    two_blocks,
    two_cylinders,
    two_spheres,
)
from raymortar.core import compat

COMM, SELF = MPI.COMM_WORLD, MPI.COMM_SELF
DIMENSION = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
CELLS = pytest.mark.parametrize("cell", DIMENSION)
PLANE = pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
SOLID = pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])


def area(scene, name):
    """Measure of a tagged surface."""
    return measure.area(scene.mesh, scene.facet_tags, scene.tags[name])


def volume(scene, name):
    """Volume (area) of a body."""
    return measure.volume(scene.mesh, scene.cell_tags, scene.bodies[name])


def nodes(scene, name):
    """Nodes (n, per facet, d) of the owned facets of a tagged surface."""
    facets = measure.owned_facets(scene.mesh, scene.facet_tags, scene.tags[name])
    return measure.facet_nodes(scene.mesh, facets)


def bodies(scene):
    """Facet nodes' independence: nodes that two bodies share."""
    dofmap = compat.geometry_dofmap(scene.mesh)
    tags = scene.cell_tags
    parts = [dofmap[tags.indices[tags.values == b]] for b in scene.bodies.values()]
    return np.intersect1d(*parts)


# Blocks


@pytest.mark.mpi
@CELLS
@pytest.mark.parametrize("degree", [1, 2])
def test_default_blocks_are_those_of_the_patch_test(cell, degree):
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, geometry_degree=degree)
    per_facet = 2 if cell == "tetrahedron" else 1
    lower, upper = {2: (7, 5), 3: (16 * per_facet, 9 * per_facet)}[dim]
    counts = measure.facet_counts(scene.mesh, scene.facet_tags, 12)
    assert counts[[1, 2, 3, 4]].tolist() == [lower, upper, upper, lower]
    assert len(scene.tags) == 4 + 4 * (dim - 1)
    assert np.allclose([volume(scene, b) for b in scene.bodies], 1.0)
    assert np.allclose([area(scene, name) for name in scene.tags], 1.0)
    for name, axis, place in [("slave", -1, 1.0), ("master", -1, 1.0)] + [
        ("top", -1, 2.0),
        ("bottom", -1, 0.0),
        ("lower_left", 0, 0.0),
        ("upper_right", 0, 1.0),
    ]:
        assert np.all(nodes(scene, name)[:, :, axis] == place)
    assert len(bodies(scene)) == 0


@CELLS
def test_narrow_block_sits_in_the_middle_and_may_overhang(cell):
    dim = DIMENSION[cell]
    size = (0.5,) * (dim - 1) + (2.0,)
    scene = two_blocks(SELF, dim, cell, upper_size=size, gap=0.1, perturb=0.2)
    x = nodes(scene, "slave")
    assert np.allclose([x[:, :, 0].min(), x[:, :, 0].max()], [0.25, 0.75])
    assert np.allclose(x[:, :, -1], 1.1)
    assert np.allclose(nodes(scene, "top")[:, :, -1], 3.1)
    assert np.isclose(area(scene, "slave"), 0.5 ** (dim - 1))
    scene = two_blocks(SELF, dim, cell, 2, 3, overhang=0.3)
    x = nodes(scene, "slave")
    assert np.allclose([x[:, :, 0].min(), x[:, :, 0].max()], [0.3, 1.3])


@CELLS
def test_tilted_interface_is_plane_and_common(cell):
    dim, angles = DIMENSION[cell], (0.6, -0.3)[: DIMENSION[cell] - 1]
    slopes = np.tan(angles)
    scene = two_blocks(SELF, dim, cell, tilt=angles, perturb=0.2, perturb_sides=0.2)
    for name in ("slave", "master"):
        x = nodes(scene, name)
        height = 1.0 + (x[:, :, :-1] - 0.5) @ slopes
        assert np.allclose(x[:, :, -1], height, atol=1e-14)
        assert np.isclose(area(scene, name), np.sqrt(1.0 + slopes @ slopes))
    assert np.allclose([volume(scene, b) for b in scene.bodies], 1.0)


@CELLS
def test_scene_turns_as_a_whole(cell):
    dim, angle = DIMENSION[cell], np.radians(37.0)
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(dim)
    matrix[:2, :2] = [[c, -s], [s, c]]
    first = two_blocks(SELF, dim, cell)
    scenes = [two_blocks(SELF, dim, cell, rotation=matrix)]
    if dim == 2:
        scenes += [two_blocks(SELF, dim, cell, rotation=angle)]
    for scene in scenes:
        for name in scene.tags:
            x, y = nodes(first, name) @ matrix.T, nodes(scene, name)
            assert np.allclose(*[np.sort(p.reshape(-1, dim), axis=0) for p in (x, y)])


@CELLS
def test_curved_interface_of_the_hydrostatic_patch_test(cell):
    dim = DIMENSION[cell]

    def parabola(x):
        return 1.0 + 0.2 * ((x - 0.5) ** 2).sum(axis=1)

    scene = two_blocks(SELF, dim, cell, 5, 4, 2, interface=parabola, perturb_sides=0.1)
    for name in ("slave", "master"):
        x = nodes(scene, name)
        lateral = x[:, :, :-1].reshape(-1, dim - 1)
        # Every node is on the surface: this degree represents it exactly
        assert np.allclose(x[:, :, -1].ravel(), parabola(lateral), atol=1e-14)
    if dim == 2:
        x = nodes(scene, "slave")
        assert np.allclose(x[:, 2, 0], x[:, :2, 0].mean(axis=1), atol=1e-14)
    volumes = 1.0 + 0.2 / 12.0 * (dim - 1) * np.array([1.0, -1.0])
    assert np.allclose([volume(scene, b) for b in ("lower", "upper")], volumes)


# Cylinders


@pytest.mark.mpi
@PLANE
@pytest.mark.parametrize("sector", ["half", "full"])
def test_cylinder_touches_block_and_is_fine_there(cell, sector):
    a, across, R = 6.2146, 20, 50.0
    scene = cylinder_on_block(COMM, cell, 2, sector=sector, master_ratio=0.7)
    whole = {"half": 1.0, "full": 2.0}[sector]
    assert np.isclose(volume(scene, "lower"), whole * 100.0 * 200.0)
    assert np.isclose(volume(scene, "upper"), whole * np.pi / 4 * R**2, rtol=1e-4)
    for name, length in [("master", 100.0), ("bottom", 100.0), ("top", R)]:
        assert np.isclose(area(scene, name), whole * length)
    # The arc ends at a ring, not beyond the angle
    assert 0.7 < area(scene, "slave") / (whole * R * np.pi / 3) <= 1.0
    assert np.isclose(area(scene, "side"), whole * 200.0)
    assert ("symmetry_x" in scene.tags) == (sector == "half")
    if sector == "half":
        assert np.isclose(area(scene, "symmetry_x"), R + 200.0)
        assert np.all(nodes(scene, "symmetry_x")[:, :, 0] == 0.0)
    x = nodes(scene, "slave")
    radii = np.linalg.norm(x - [0.0, R], axis=2)
    assert np.allclose(radii, R, rtol=1e-14)
    for name, ratio in [("slave", 1.0), ("master", 0.7)]:
        ends = nodes(scene, name)[:, :2]
        near = np.abs(ends[:, :, 0]).max(axis=1) < 1.01 * a
        sizes = np.linalg.norm(ends[near, 1] - ends[near, 0], axis=1)
        assert np.allclose(sizes, ratio * 2.0 * a / across, rtol=1e-3)
    assert len(bodies(scene)) == 0


@PLANE
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(
    "builder, options",
    [
        (cylinder_on_block, {"disc": "half"}),
        (cylinder_on_block, {"disc": "whole", "sector": "full"}),
        (two_cylinders, {"sector": "half", "facets_across": 40, "growth": 1.1}),
        (two_cylinders, {"facets_across": 6, "lower_radius": 20.0}),
    ],
)
def test_plane_scenes_have_good_cells(cell, degree, builder, options):
    scene = builder(SELF, cell, degree, **options)
    mesh = scene.mesh
    assert measure.smallest_jacobian(mesh) > 0.3
    assert len(measure.cell_nodes(mesh)) < 20000
    aspect = measure.aspect_ratios(mesh)
    assert aspect.max() < {"triangle": 30.0, "quadrilateral": 12.0}[cell]
    near = np.linalg.norm(measure.cell_nodes(mesh).mean(axis=1), axis=1)
    near = near < 2.0 * (0.68 if builder is two_cylinders else 6.2)
    assert aspect[near].max() < 15.0


@PLANE
def test_whole_disc(cell):
    scene = cylinder_on_block(SELF, cell, 2, disc="whole", sector="full", gap=0.5)
    assert np.isclose(volume(scene, "upper"), np.pi * 2500.0, rtol=1e-4)
    assert np.isclose(area(scene, "top"), np.pi / 2 * 50.0, rtol=1e-4)
    assert np.isclose(nodes(scene, "top")[:, :, 1].max(), 100.5)
    everything = np.pi * 100.0 + 800.0
    assert np.isclose(measure.exterior_area(scene.mesh), everything, rtol=1e-4)


def rate(builder, cell, degree, facets_across, growth, exact):
    """Rate of the upper body's error in the mean size of the cells."""
    errors, sizes = [], []
    for refine in (1, 2):
        # Twice as many rings: the square root of the growth
        scene = builder(
            SELF,
            cell,
            degree,
            facets_across=facets_across * refine,
            growth=growth ** (1 / refine),
        )
        errors.append(abs(volume(scene, "upper") - exact))
        cells = np.sum(scene.cell_tags.values == scene.bodies["upper"])
        sizes.append(cells ** (-1.0 / DIMENSION[cell]))
    return np.log(errors[0] / errors[1]) / np.log(sizes[0] / sizes[1])


@PLANE
@pytest.mark.parametrize("degree", [1, 2])
def test_area_of_cylinders_converges(cell, degree):
    found = rate(two_cylinders, cell, degree, 8, 1.44, np.pi * 32.0)
    assert found > {1: 1.9, 2: 3.6}[degree]


@pytest.mark.mpi
def test_rotated_cylinders_keep_their_measures():
    scene = two_cylinders(COMM, rotation=np.radians(37.0))
    first = two_cylinders(SELF)
    for name in first.tags:
        assert np.isclose(area(scene, name), area(first, name), rtol=1e-12)
    # The cut has turned: its normal is the rotated vertical
    normal = np.array([-np.sin(np.radians(37.0)), np.cos(np.radians(37.0))])
    assert np.allclose(nodes(scene, "top") @ normal, 8.0)


# Spheres


@pytest.mark.mpi
@SOLID
@pytest.mark.parametrize("builder", [two_spheres, sphere_on_plane])
def test_sphere_is_round_and_fine_at_the_pole(cell, builder):
    R, a, across = 50.0, 10.0, 8
    scene = builder(COMM, cell, 2, facets_across=across)
    assert np.isclose(volume(scene, "upper"), np.pi / 6 * R**3, rtol=1e-3)
    assert np.isclose(area(scene, "top"), np.pi / 4 * R**2, rtol=1e-3)
    if builder is two_spheres:
        assert np.isclose(volume(scene, "lower"), np.pi / 6 * R**3, rtol=1e-3)
        symmetry = np.pi / 2 * R**2
    else:
        assert np.isclose(volume(scene, "lower"), 50.0**3)
        assert np.isclose(area(scene, "master"), 50.0**2)
        assert np.isclose(area(scene, "side"), 2 * 50.0**2)
        symmetry = np.pi / 4 * R**2 + 50.0**2
    for axis, name in enumerate(["symmetry_x", "symmetry_y"]):
        assert np.isclose(area(scene, name), symmetry, rtol=1e-3)
        assert np.allclose(nodes(scene, name)[:, :, axis], 0.0, atol=1e-12)
    x = nodes(scene, "slave")
    assert np.allclose(np.linalg.norm(x - [0.0, 0.0, R], axis=2), R, rtol=1e-14)
    cap = np.pi / 2 * R**2 * (1.0 - np.cos(np.pi / 3))
    assert 0.5 < area(scene, "slave") / cap < 1.1
    # Facets near the pole: squares of the asked size, or halves of them
    corners = x[:, : 3 if cell == "tetrahedron" else 4]
    near = np.linalg.norm(corners[:, :, :2], axis=2).max(axis=1) < a
    edges = np.linalg.norm(corners[near, 1:3] - corners[near, :1], axis=2).min(axis=1)
    assert np.allclose(edges, 2.0 * a / across, rtol=0.05)
    assert len(bodies(scene)) == 0


@SOLID
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("builder", [two_spheres, sphere_on_plane])
@pytest.mark.parametrize(
    "options", [{"facets_across": 7}, {"sector": "half", "facets_across": 4}]
)
def test_solid_scenes_have_good_cells(cell, degree, builder, options):
    scene = builder(SELF, cell, degree, **options)
    mesh = scene.mesh
    assert measure.smallest_jacobian(mesh) > 0.1
    aspect = measure.aspect_ratios(mesh)
    assert aspect.max() < {"tetrahedron": 25.0, "hexahedron": 8.0}[cell]
    assert len(aspect) < 30000


@SOLID
def test_full_model_closes(cell):
    scene = two_spheres(SELF, cell, 2, sector="full", facets_across=4)
    assert sorted(scene.tags) == ["bottom", "master", "slave", "top"]
    boundary = 2 * (2 * np.pi + np.pi) * 50.0**2
    assert np.isclose(measure.exterior_area(scene.mesh), boundary, rtol=2e-3)
    assert np.isclose(volume(scene, "upper"), np.pi / 1.5 * 50.0**3, rtol=2e-3)


@SOLID
@pytest.mark.parametrize("degree", [1, 2])
def test_volume_of_spheres_converges(cell, degree):
    found = rate(two_spheres, cell, degree, 4, 1.69, np.pi / 6 * 50.0**3)
    assert found > {1: 1.9, 2: 3.4}[degree]


@pytest.mark.mpi
@CELLS
def test_distributed_scene_has_the_tags_of_one_rank(cell):
    builder = cylinder_on_block if DIMENSION[cell] == 2 else sphere_on_plane
    scenes = [builder(c, cell, facets_across=4, perturb=0.1) for c in (COMM, SELF)]
    counts = [measure.facet_counts(s.mesh, s.facet_tags, 8) for s in scenes]
    assert np.array_equal(*counts)
    for name in scenes[0].tags:
        assert np.isclose(*[area(s, name) for s in scenes], rtol=1e-12)


# Arguments


@pytest.mark.parametrize(
    "options, message",
    [
        ({"dim": 1}, "neither 2 nor 3"),
        ({"cell": "hexahedron"}, "dimension 3"),
        ({"lower_divisions": (3, 3, 3)}, "lower_divisions"),
        ({"upper_divisions": 0}, "integers >= 1"),
        ({"lower_size": (1.0, -1.0)}, "sizes must be positive"),
        ({"gap": np.inf}, "gap finite"),
        ({"tilt": 2.0}, "right angle"),
        ({"tilt": 1.3}, "inverted or flat"),
        ({"interface": lambda x: np.ones(2)}, "one height per point"),
        ({"interface": lambda x: -np.ones(len(x))}, "inverted or flat"),
        ({"rotation": np.diag([1.0, -1.0])}, "rotation matrix"),
        ({"rotation": np.eye(3)}, "rotation matrix"),
        ({"dim": 3, "rotation": 0.1}, "rotation matrix"),
        ({"overhang": (1.0, 1.0)}, "overhang"),
    ],
)
def test_bad_arguments_of_blocks(options, message):
    with pytest.raises(ValueError, match=message):
        two_blocks(SELF, **options)


@pytest.mark.parametrize(
    "builder, options, message",
    [
        (cylinder_on_block, {"cell": "hexahedron"}, "dimension 3"),
        (cylinder_on_block, {"facets_across": 1}, "facets_across"),
        (cylinder_on_block, {"contact_half_width": 0.0}, "must be positive"),
        (cylinder_on_block, {"contact_half_width": 40.0}, "too large for the radius"),
        (cylinder_on_block, {"block_size": (10.0, 10.0)}, "too large for a box"),
        (cylinder_on_block, {"block_size": (1.0,)}, "width and height"),
        (cylinder_on_block, {"block_size": (-1.0, 1.0)}, "not positive"),
        (cylinder_on_block, {"master_ratio": 0.0}, "master_ratio"),
        (cylinder_on_block, {"growth": 1.0}, "growth"),
        (cylinder_on_block, {"disc": "quarter"}, "neither 'half' nor 'whole'"),
        (cylinder_on_block, {"sector": "quarter"}, "sector 'quarter'"),
        (cylinder_on_block, {"slave_angle": 2.0}, "surface_angle"),
        (two_cylinders, {"radius": -1.0}, "radius = -1.0"),
        (two_cylinders, {"gap": np.nan}, "finite points"),
        (sphere_on_plane, {"block_size": (1.0, 1.0)}, "three lengths"),
        (two_spheres, {"cell": "triangle"}, "dimension 2"),
        (two_spheres, {"rotation": 0.3}, "rotation matrix"),
    ],
)
def test_bad_arguments_of_round_scenes(builder, options, message):
    with pytest.raises(ValueError, match=message):
        builder(SELF, **options)
