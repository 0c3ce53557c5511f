"""What of a slave surface meets the master: weights, gaps, layers, distances.

Everything here is read off `Contact` after `update`; few tests solve.
"""


import numpy as np
import pytest
from pairing import HIT, lift, measures, total, touch
from problems import COMM, DIMENSION, build, fix, stack, worst
from rotations import ROTATION

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Penalty, Search
from raymortar.core.options.methods import STRATEGIES

ROUNDING = 1e-12


# Weights


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("swap", [False, True])
def test_weights_of_a_covered_surface_add_up(cell, degree, swap):
    pair = ("master", "slave") if swap else ("slave", "master")
    scene = two_blocks(
        COMM,
        DIMENSION[cell],
        cell,
        perturb=0.2,
        perturb_sides=0.3,
        pattern="random",
        rotation=ROTATION[DIMENSION[cell]],
    )
    contact = touch(scene, [pair], degree)
    whole, covered = measures(contact)
    print(f"whole {whole - 1:.1e}, covered {covered - 1:.1e}")
    assert abs(whole - 1.0) <= ROUNDING
    assert abs(covered - 1.0) <= ROUNDING
    assert worst(contact.zones[0].cpp.segments()["covered"] - 1.0) <= ROUNDING
    # But for the rounding of triangles between three vertices on a line
    assert min(contact.points()["weight"], default=1.0) > -ROUNDING


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_polynomials_up_to_the_degree_are_exact(cell, degree):
    dim, options = DIMENSION[cell], {"perturb": 0.2, "perturb_sides": 0.3}
    contact = touch(two_blocks(COMM, dim, cell, **options), quadrature_degree=degree)
    points = contact.points()
    for powers in np.ndindex(*(degree + 1,) * (dim - 1)):
        if sum(powers) <= degree:
            values = np.prod(points["x"][:, :-1] ** powers, axis=1)
            exact = 1.0 / np.prod(np.add(powers, 1.0))
            assert abs(total(values * points["weight"]) - exact) <= ROUNDING


def overlaps(dim):
    """Options of `two_blocks`, and the true measure of overlap and of the slave."""
    if dim == 2:
        yield {"overhang": 0.3}, 0.7, 1.0
        yield {"overhang": -0.43}, 0.57, 1.0
        yield {"upper_size": (0.41, 1.0)}, 0.41, 0.41
        yield {"upper_size": (1.7, 1.0)}, 1.0, 1.7
        yield {"upper_size": (0.5, 1.0), "overhang": 0.6}, 0.15, 0.5
    else:
        yield {"overhang": (0.3, -0.21)}, 0.7 * 0.79, 1.0
        yield {"overhang": (-0.55, 0.0)}, 0.45, 1.0
        yield {"upper_size": (0.41, 0.37, 1.0)}, 0.41 * 0.37, 0.41 * 0.37
        yield {"upper_size": (1.7, 1.3, 1.0)}, 1.0, 1.7 * 1.3
        size = {"upper_size": (0.5, 0.6, 1.0)}
        yield size | {"overhang": (0.6, 0.1)}, 0.15 * 0.6, 0.3


@pytest.mark.mpi(
    where=lambda case, turned, degree, **_: case in (1, 4) and turned and degree == 2
)
@pytest.mark.parametrize("case", range(5))
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("degree", [1, 2])
def test_overhanging_block_integrates_the_true_overlap(cell, case, turned, degree):
    dim = DIMENSION[cell]
    options, overlap, area = list(overlaps(dim))[case]
    rotation = ROTATION[dim] if turned else None
    scene = two_blocks(COMM, dim, cell, rotation=rotation, **options)
    contact = touch(scene, degree=degree)
    whole, covered = measures(contact)
    print(f"whole {whole - area:.1e}, covered {covered - overlap:.1e}")
    assert abs(whole - area) <= ROUNDING
    assert abs(covered - overlap) <= ROUNDING
    segments = contact.zones[0].cpp.segments()
    assert abs(total(segments["covered_area"]) - overlap) <= ROUNDING
    assert abs(total(segments["whole_area"]) - area) <= ROUNDING


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "hexahedron"])
def test_covered_fraction_of_each_facet(cell):
    dim = DIMENSION[cell]
    overhang = 0.3 if dim == 2 else (0.4, -0.21)
    contact = touch(two_blocks(COMM, dim, cell, overhang=overhang))
    surface = contact.zones[0].facets.slave_surface
    corners = surface.X[surface.facet_nodes][:, :, : dim - 1]
    low, high = corners.min(axis=1), corners.max(axis=1)
    covered = np.clip(high, 0.0, 1.0) - np.clip(low, 0.0, 1.0)
    fraction = np.prod(covered / (high - low), axis=1)
    found = contact.zones[0].cpp.segments()["covered"]
    assert worst(found - fraction) <= ROUNDING
    kinds = {0.0, 1.0} - set(np.round(found, 9))
    assert COMM.size > 1 or not kinds  # some facets are free, some covered


@pytest.mark.mpi
@pytest.mark.parametrize("method", [AugmentedLagrangian(1.0), Penalty(1.0)])
def test_points_without_master_are_misses(cell, method):
    dim = DIMENSION[cell]
    overhang = 0.3 if dim == 2 else (0.3, -0.21)
    scene = two_blocks(COMM, dim, cell, overhang=overhang, gap=0.01)
    contact = touch(scene, method=method)
    points = contact.points()
    hit = points["status"] >= HIT
    assert np.array_equal(hit, points["master"] >= 0)
    lateral = points["x"][hit][:, : dim - 1]
    assert np.all(lateral >= -1e-12) and np.all(lateral <= 1 + 1e-12)
    statistics = contact.statistics
    assert statistics.hits == total(hit)
    assert statistics.points == total(np.ones(len(hit)))
    # With a multiplier the uncovered part is integrated, too
    misses = contact.multiplier is not None
    assert (statistics.hits < statistics.points) == misses
    assert statistics.active_points == 0
    assert abs(statistics.min_gap - 0.01) <= ROUNDING
    assert abs(statistics.max_gap - 0.01) <= ROUNDING


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_force_is_that_of_the_covered_part(cell, degree):
    dim = DIMENSION[cell]
    overhang, overlap = (0.3, 0.7) if dim == 2 else ((0.3, -0.21), 0.7 * 0.79)
    R, gamma, depth = ROTATION[dim], 1e3, 0.01
    scene = two_blocks(
        COMM, dim, cell, overhang=overhang, gap=-depth, rotation=ROTATION[dim]
    )
    contact = touch(scene, degree=degree, method=Penalty(gamma))
    found = contact.resultant()
    force = gamma * depth * overlap * R[:, -1]
    middle = {2: [0.65, 1 - depth], 3: [0.65, 0.395, 1 - depth]}[dim]
    x = R @ middle
    # NumPy 2 has no cross product of vectors in the plane
    moment = np.cross(x, force) if dim == 3 else x[0] * force[1] - x[1] * force[0]
    size = np.linalg.norm(force)
    assert np.abs(found.force - force).max() <= ROUNDING * size
    assert np.abs(found.moment - moment).max() <= ROUNDING * size
    assert np.ndim(found.moment) == dim - 2


# Gaps


@pytest.mark.mpi(where=lambda distance, degree, **_: distance != 0.0 and degree == 1)
@pytest.mark.parametrize("distance", [0.123, 0.0, -0.05])
@pytest.mark.parametrize("degree", [1, 2])
def test_gap_of_parallel_faces_is_their_distance(cell, distance, degree):
    dim = DIMENSION[cell]
    R = ROTATION[dim]
    contact = touch(
        two_blocks(COMM, dim, cell, gap=distance, rotation=R),
        (("slave", "master"),),
        degree,
    )
    assert worst(contact.points()["gap"] - distance) <= ROUNDING
    gap = contact.gap().x.array
    on_slave = ~np.isnan(gap)
    assert worst(gap[on_slave] - distance) <= ROUNDING
    nodes = contact.zones[0].result_table
    assert COMM.size > 1 or set(np.flatnonzero(on_slave)) == set(nodes.ravel())


@pytest.mark.mpi(where=lambda share, **_: share > 1.0)
@pytest.mark.parametrize("share", [0.1, 2.0])
def test_deep_penetration_is_found_and_pushed_out(cell, share):
    dim = DIMENSION[cell]
    n = 5 if dim == 2 else 3
    depth = share / n  # in edges of the slave's facets
    scene = two_blocks(COMM, dim, cell, gap=-depth, upper_size=(0.6,) * dim)

    def held(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top")]

    search = Search(depth=1.5 * depth)
    problem = build(scene, material="linear", bcs=held, search=search)
    contact = problem.contact
    contact.update()
    whole, covered = measures(contact)
    assert abs(covered - whole) <= ROUNDING
    assert worst(contact.points()["gap"] + depth) <= ROUNDING
    assert contact.statistics.active_points == contact.statistics.points
    problem.solve()
    print(problem.history)
    mean = total(contact.points()["gap"] * contact.points()["weight"]) / whole
    print(f"mean gap {mean / depth:.1e} of the depth")
    assert abs(mean) <= 1e-9 * depth
    assert problem.slave_multiplier().max(initial=0.0) <= 0.0


@pytest.mark.mpi
def test_default_depth_sees_two_facets_deep(cell):
    dim = DIMENSION[cell]
    n = 5 if dim == 2 else 3
    contact = touch(two_blocks(COMM, dim, cell, gap=-1.99 / n))
    statistics = contact.statistics
    assert statistics.hits == statistics.points > 0


# Distances


@pytest.mark.mpi(where=lambda multiplier, **_: multiplier == "vector")
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
def test_bodies_out_of_reach_have_no_contact(cell, multiplier):
    dim = DIMENSION[cell]
    method = AugmentedLagrangian(multiplier=multiplier)
    problem = build(
        two_blocks(COMM, dim, cell, 3, 2, gap=5.0),
        method=method,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=0.125)],
        nu=0.0,
    )
    contact = problem.contact
    contact.multiplier.x.array[:] = -7.0
    assert problem.solve() <= 2
    statistics = contact.statistics
    assert statistics.hits == statistics.active_points == 0 < statistics.points
    assert "meets a master within reach" in str(statistics)
    assert worst(problem.slave_multiplier()) <= 1e-12
    assert worst(problem.stress()) <= 1e-8  # each body moves as its Dirichlet side
    assert np.all(np.isnan(contact.gap().x.array))
    assert worst(contact.resultant().force) <= 1e-12


@pytest.mark.mpi
def test_bodies_may_leave_and_come_back(cell):
    """Far off no rank holds a master facet, nor any candidate of before."""
    contact = touch(two_blocks(COMM, DIMENSION[cell], cell))
    there = contact.statistics.hits
    assert there == contact.statistics.points > 0
    for height, hits in [(1e3, 0), (0.0, there), (-1e3, 0), (0.0, there)]:
        lift(contact, height)
        assert contact.statistics.hits == hits


@pytest.mark.mpi
@pytest.mark.parametrize("reach, seen", [(0.29, False), (0.31, True)])
def test_reach_is_the_largest_gap_that_is_seen(cell, reach, seen):
    scene = two_blocks(COMM, DIMENSION[cell], cell, gap=0.3)
    statistics = touch(scene, search=Search(reach=reach)).statistics
    assert statistics.hits == (statistics.points if seen else 0)


@pytest.mark.mpi
@pytest.mark.parametrize("depth, seen", [(0.29, False), (0.31, True)])
def test_depth_is_the_largest_penetration_that_is_seen(cell, depth, seen):
    scene = two_blocks(COMM, DIMENSION[cell], cell, gap=-0.3)
    statistics = touch(scene, search=Search(depth=depth)).statistics
    assert statistics.hits == (statistics.points if seen else 0)


# Layers


def layers(cell, rotation=None):
    """A block above a small thin one above a large one: gaps 0.05 and 0.06."""
    return stack(
        cell,
        (2, 3, 4),
        heights=(0.5, 0.1, 0.5),
        gaps=(0.0, 0.06, 0.05),
        widths=(1.0, 0.4, 1.0),
        rotation=rotation,
    )


NEAR, FAR = 0.05, 0.05 + 0.1 + 0.06


@pytest.mark.mpi(where=lambda strategy, turned, **_: strategy == "bvh" and turned)
@pytest.mark.parametrize("strategy", ["bvh", "brute-force"])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("order", [1, -1])
def test_closer_of_two_layers_wins(cell, strategy, turned, order):
    dim = DIMENSION[cell]
    scene = layers(cell, ROTATION[dim] if turned else None)
    pairs = [("bottom_2", "top_1"), ("bottom_2", "top_0")][::order]
    contact = touch(scene, pairs, search=Search(strategy, reach=1.0))
    assert len(contact.zones) == 1
    points = contact.points()
    assert np.all(points["status"] >= HIT) and np.all(points["weight"] > -ROUNDING)
    near = points["gap"] < 0.1
    assert worst(points["gap"] - np.where(near, NEAR, FAR)) <= ROUNDING
    assert abs(total(points["weight"][near]) - 0.4 ** (dim - 1)) <= ROUNDING
    assert abs(total(points["weight"]) - 1.0) <= ROUNDING
    assert worst(contact.zones[0].cpp.segments()["covered"] - 1.0) <= ROUNDING


@pytest.mark.mpi
def test_back_faces_are_no_masters(cell):
    contact = touch(layers(cell), [("bottom_2", "bottom_1")], search=Search(reach=1.0))
    assert contact.statistics.hits == 0


@pytest.mark.mpi
def test_back_faces_hide_nothing(cell):
    # The thin block's lower side is closer than the large block's top, but turned away
    pairs = [("bottom_2", "bottom_1"), ("bottom_2", "top_0")]
    contact = touch(layers(cell), pairs, search=Search(reach=1.0))
    assert worst(contact.points()["gap"] - FAR) <= ROUNDING
    assert abs(measures(contact)[1] - 1.0) <= ROUNDING


# Strategies


@pytest.mark.mpi
@pytest.mark.parametrize("degree, geometry_degree", [(1, 1), (2, 2)])
def test_strategies_agree(cell, degree, geometry_degree):
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        geometry_degree=geometry_degree,
        interface=lambda x: 1 + 0.2 * np.sum((x - 0.5) ** 2, axis=1),
        overhang=0.2 if dim == 2 else (0.2, 0.1),
        gap=0.02,
        perturb_sides=0.2,
        rotation=ROTATION[dim],
    )
    all_pairs = touch(scene, degree=degree, search=Search("brute-force"))
    b = all_pairs.zones[0].cpp.segments()
    assert len(b["slave"]) > 0 or COMM.size > 1
    for strategy in STRATEGIES:
        contact = touch(scene, degree=degree, search=Search(strategy))
        a = contact.zones[0].cpp.segments()
        for name in ("slave", "master", "offsets", "xi"):
            assert np.array_equal(a[name], b[name]), (strategy, name)
        p, q = contact.points(), all_pairs.points()
        for name in ("slave", "master", "weight", "gap", "xi", "eta", "status"):
            assert np.array_equal(p[name], q[name]), (strategy, name)
        assert contact.statistics.candidates == all_pairs.statistics.candidates


# Candidates


@pytest.mark.mpi
@pytest.mark.parametrize("strategy", ["bvh", "brute-force"])
def test_candidates_are_kept_within_the_skin(cell, strategy):
    skin = 0.1
    scene = two_blocks(COMM, DIMENSION[cell], cell, gap=0.2)
    contact = touch(scene, search=Search(strategy, reach=0.5, skin=skin))
    first = contact.statistics.candidate_builds
    ranks = COMM.allreduce(len(contact.zones[0].facets.slave.facets) > 0)
    assert first == ranks
    for height in (0.2 * skin, 0.4 * skin, -0.4 * skin):
        lift(contact, height)
        assert worst(contact.points()["gap"] - 0.2 - height) <= ROUNDING
    assert contact.statistics.candidate_builds == first
    lift(contact, 2.0 * skin)
    assert contact.statistics.candidate_builds == first + ranks
    assert worst(contact.points()["gap"] - 0.2 - 2.0 * skin) <= ROUNDING
    # From there on the new place counts
    lift(contact, 2.2 * skin)
    assert contact.statistics.candidate_builds == first + ranks
