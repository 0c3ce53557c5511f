"""Patch tests: uniform states pass through any flat interface to rounding.

A1 (uniaxial pressure), A2 (hydrostatic, tilted interface) and A3 (large compression)
of the validation plan. Errors are the largest over all cells, at points inside and at
vertices, and over all multiplier unknowns.
"""

from itertools import product

from mpi4py import MPI

import numpy as np
import pytest
from problems import CELLS, COMM, DIMENSION, build, fix, stack, worst
from squeezing import squeeze
from uniform import (
    MAX_ITERATIONS,
    METHODS,
    NU,
    PRESSURE,
    ROUNDING,
    TOLERANCE,
    VECTOR,
    E,
    check,
    check_hydrostatic,
    errors,
)

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import Penalty


def upward(dim):
    """Unit vector of the last direction."""
    return np.eye(dim)[-1]


# A1: uniaxial pressure


def uniaxial(dim):
    """Stress, and strain along and across the load (plane strain in 2D)."""
    stress = np.zeros((dim, dim))
    stress[-1, -1] = -PRESSURE
    if dim == 2:
        return stress, -PRESSURE * (1 - NU**2) / E, PRESSURE * NU * (1 + NU) / E
    return stress, -PRESSURE / E, PRESSURE * NU / E


def bedded(V, scene):
    """Exact normal displacement of the bottom, of all left and of all front sides."""
    dim = scene.mesh.geometry.dim
    _, _, across = uniaxial(dim)
    conditions = [fix(V, scene, "bottom", dim - 1)]
    for axis, side in enumerate(("left", "front")[: dim - 1]):
        conditions += [
            fix(V, scene, name, axis, lambda x, axis=axis: across * x[:, axis])
            for name in scene.tags
            if side in name
        ]
    return conditions


def press(scene, degree=1, method=None, loaded=("top",), **options):
    """Solve A1."""
    problem = build(
        scene,
        degree,
        method=method,
        bcs=bedded,
        loaded=loaded,
        load=uniaxial(scene.mesh.geometry.dim)[0],
        **options,
    )
    assert problem.solve(rtol=ROUNDING) <= MAX_ITERATIONS, problem.history
    return problem


def check_uniaxial(problem, swap=False):
    up = upward(problem.dim)
    check(problem, uniaxial(problem.dim)[0], up if swap else -up)


def a1_cases():
    for case in product(CELLS, (1, 2), METHODS, (False, True)):
        cell, degree, multiplier, swap = case
        marks = []
        if degree == 1 and multiplier == "normal" and not swap:
            marks.append(pytest.mark.quick)
        if degree == 2 and multiplier == "vector" and swap and cell == "tetrahedron":
            marks.append(pytest.mark.mpi)
        yield pytest.param(
            *case,
            marks=marks,
            id=f"{cell}-P{degree}-{multiplier}-{'swapped' if swap else 'straight'}",
        )


@pytest.mark.parametrize("cell, degree, multiplier, swap", list(a1_cases()))
def test_uniform_pressure_is_exact(cell, degree, multiplier, swap):
    scene = two_blocks(COMM, DIMENSION[cell], cell)
    problem = press(scene, degree, METHODS[multiplier], swap=swap)
    check_uniaxial(problem, swap)
    _, along, across = uniaxial(problem.dim)
    strains = np.diag([across] * (problem.dim - 1) + [along])
    assert worst(problem.gradient() - strains) <= TOLERANCE * abs(along)


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_uniform_pressure_on_irregular_meshes(cell, degree):
    scene = two_blocks(
        COMM,
        DIMENSION[cell],
        cell,
        perturb=0.2,
        # Quadrilaterals without parallel sides: see `shaken_hexahedra`
        perturb_sides=0.0 if cell == "hexahedron" else 0.25,
        pattern="random",
    )
    check_uniaxial(press(scene, degree))


def shaken_hexahedra(degree, quadrature_degree):
    """Largest share by which a pressure differs from the uniform one, where all nodes of
    the sides are moved by up to a quarter of a cell."""
    scene = two_blocks(COMM, 3, "hexahedron", perturb=0.2, perturb_sides=0.25)
    problem = press(scene, degree, quadrature_degree=quadrature_degree)
    lam = problem.contact.multiplier.x.array[problem.contact.zones[0].multiplier_nodes]
    return COMM.allreduce(
        float(np.abs(lam / -PRESSURE - 1.0).max(initial=0.0)), MPI.MAX
    )


@pytest.mark.parametrize("degree, at_first", [(1, 4e-6), (2, 2e-6)])
def test_uniform_pressure_on_shaken_hexahedra(degree, at_first):
    """Shape functions are no polynomials in the plane of such facets, so that no rule is
    exact; the error falls faster than any power of the degree."""
    errors = [shaken_hexahedra(degree, q) for q in (None, 8, 12)]
    print(errors)
    assert errors[0] <= at_first
    assert errors[1] <= 1e-2 * at_first and errors[2] <= 1e-4 * at_first


@pytest.mark.mpi(where=lambda swap, **_: not swap)
@pytest.mark.parametrize("swap", [False, True])
def test_uniform_pressure_under_a_narrow_punch(cell, swap):
    # The foundation's uncovered top carries the same pressure
    problem = press(punch(cell), 1, VECTOR, ("top", "uncovered"), swap=swap)
    check_uniaxial(problem, swap)


def punch(cell):
    """Punch on a wider foundation: the layout of Taylor and Papadopoulos.

    The foundation's top is "master" under the punch and "uncovered" beside it.
    """
    dim = DIMENSION[cell]
    tags = {"bottom": 1, "top": 2, "slave": 3, "master": 4, "uncovered": 5}
    sides = {"left": 6, "right": 7, "front": 8, "back": 9}
    sides = {name: sides[name] for name in list(sides)[: 2 * (dim - 1)]}
    limits = [0.0, 0.25, 0.75, 1.0]
    blocks = []
    for place in product(range(3), repeat=dim - 1):
        top = "master" if set(place) == {1} else "uncovered"
        of_block = {"bottom": 1, "top": tags[top]}
        for axis, i in enumerate(place):
            first = ("left", "front")[axis] if i == 0 else None
            last = ("right", "back")[axis] if i == 2 else None
            of_block |= {name: sides[name] for name in (first, last) if name}
        lower = (*(limits[i] for i in place), 0.0)
        upper = (*(limits[i + 1] for i in place), 1.0)
        divisions = (*(1 + (i == 1) for i in place), 2)
        blocks.append(Block(divisions, lower, upper, tags=of_block, body="lower"))
    lower = (0.25,) * (dim - 1) + (1.0,)
    upper = (0.75,) * (dim - 1) + (1.5,)
    around = {f"punch_{name}": 10 + k for k, name in enumerate(sides)}
    blocks.append(
        Block(
            (3,) * dim,
            lower,
            upper,
            tags={"bottom": 3, "top": 2}
            | {name: around[f"punch_{name}"] for name in sides},
        )
    )
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, blocks, cell)
    return Scene(mesh, cell_tags, facet_tags, tags | sides | around)


def trapezoids(bodies):
    """Hexahedra whose contact facets have no parallel sides, on one body or both."""

    def skewed(x):
        lateral = 0.3 * x[:, :1] * (1 - x[:, :1]) * (x[:, 1:2] - 0.5)
        return x + lateral * np.eye(3)[0]

    names = {"bottom": 1, "top": 2, "slave": 3, "master": 4}
    names |= {"lower_left": 5, "lower_front": 6, "upper_left": 7, "upper_front": 8}
    lower = {"bottom": 1, "top": 4, "left": 5, "front": 6}
    upper = {"bottom": 3, "top": 2, "left": 7, "front": 8}
    mapping = {body: skewed for body in bodies}
    blocks = [
        Block((3, 3, 1), (0, 0, 0), (1, 1, 1), None, mapping.get("lower"), lower),
        Block((2, 2, 1), (0, 0, 1), (1, 1, 2), None, mapping.get("upper"), upper),
    ]
    return Scene(*assemble_blocks(COMM, blocks, "hexahedron"), names)


@pytest.mark.mpi
@pytest.mark.parametrize("bodies", [("lower",), ("upper",)], ids=["master", "slave"])
def test_exact_state_is_in_balance_on_trapezoids(bodies):
    # Shape functions are rational in the plane of a trapezoid: no rule is exact, but
    # without kinks inside segments the error falls faster than any power
    problem = build(
        trapezoids(bodies),
        bcs=bedded,
        loaded=("top",),
        load=uniaxial(3)[0],
        quadrature_degree=8,
    )
    _, along, across = uniaxial(3)
    strains = np.array([[across], [across], [along]])
    problem.u.interpolate(lambda x: strains * x)
    problem.contact.multiplier.x.array[:] = -PRESSURE
    x = problem.problem.start()
    b = x.duplicate()
    problem.problem.F(x, b)
    weights = COMM.allreduce(problem.contact.points()["weight"].sum())
    assert abs(weights - 1.0) <= 1e-12
    print(f"residual {b.norm():.1e} of {PRESSURE}")
    assert b.norm() <= TOLERANCE * PRESSURE


@pytest.mark.mpi(where=lambda degree, **_: degree == 2)
@pytest.mark.parametrize("degree", [1, 2])
def test_uniform_pressure_with_quadratic_geometry(cell, degree):
    scene = two_blocks(COMM, DIMENSION[cell], cell, 3, 2, geometry_degree=2)
    check_uniaxial(press(scene, degree))


@pytest.mark.mpi(where=lambda degree, swap, **_: degree == 1 and not swap)
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("degree", [1, 2])
def test_penalty_sinks_in_by_pressure_over_gamma(cell, degree, swap):
    gamma = 1e5
    scene = two_blocks(COMM, DIMENSION[cell], cell)
    problem = press(scene, degree, Penalty(gamma), swap=swap)
    check_uniaxial(problem)
    gap = problem.contact.gap().x.array
    gap = gap[~np.isnan(gap)]
    assert COMM.allreduce(len(gap)) > 0
    found = worst(gap * gamma / PRESSURE + 1.0)
    found = max(found, worst(problem.contact.points()["gap"] * gamma / PRESSURE + 1.0))
    print(f"gap {found:.1e}")
    assert found <= TOLERANCE


@pytest.mark.mpi(where=lambda pairs, **_: pairs[1][0] == "top_1")
@pytest.mark.parametrize(
    "pairs",
    [
        [("bottom_1", "top_0"), ("bottom_2", "top_1")],
        # The middle block is slave below and master above, or slave on both sides
        [("top_0", "bottom_1"), ("top_1", "bottom_2")],
        [("bottom_1", "top_0"), ("top_1", "bottom_2")],
    ],
)
def test_uniform_pressure_through_a_stack(cell, pairs):
    problem = press(stack(cell), pairs=pairs)
    assert len(problem.contact.zones) == 2
    check_uniaxial(problem)
    area = 1.0
    for i, (slave, _) in enumerate(pairs):
        sign = 1.0 if slave.startswith("bottom") else -1.0
        force = problem.contact.resultant(i).force
        exact = sign * PRESSURE * area * upward(problem.dim)
        assert np.abs(force - exact).max() <= TOLERANCE * PRESSURE


# A2: hydrostatic pressure, tilted interface

ROTATION_3D = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3


def tilted_normal(tilt):
    """Slave's normal of an interface with slopes tan(tilt)."""
    m = np.append(np.tan(tilt), -1.0)
    return m / np.linalg.norm(m)


@pytest.mark.mpi(where=lambda angle, **_: angle == 30)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("angle", [0, 15, 30, 45, 60])
def test_hydrostatic_pressure_on_a_tilted_line(cell_2d, angle, degree):
    tilt = np.radians(angle)
    scene = two_blocks(COMM, 2, cell_2d, 4, 3, tilt=tilt, perturb=0.2)
    check_hydrostatic(scene, tilted_normal(tilt), degree)


@pytest.mark.mpi(where=lambda angles, **_: angles == (40, -35))
@pytest.mark.parametrize("angles", [(0, 0), (20, 10), (40, -35), (57, 38)])
def test_hydrostatic_pressure_on_a_tilted_plane(cell_3d, angles):
    # The steepest of them is tilted by 60 degrees
    tilt = np.radians(angles)
    sizes = {"lower_size": (1, 1, 3), "upper_size": (1, 1, 3)}
    scene = two_blocks(COMM, 3, cell_3d, 3, 2, tilt=tilt, **sizes)
    check_hydrostatic(scene, tilted_normal(tilt))


@pytest.mark.mpi(where=lambda degree, method, **_: degree == 1 and method is VECTOR)
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("degree", [1, 2])
def test_hydrostatic_pressure_on_a_rotated_model(cell, degree, method):
    dim = DIMENSION[cell]
    R = np.array([[0.6, -0.8], [0.8, 0.6]]) if dim == 2 else ROTATION_3D
    tilt = 0.4 if dim == 2 else (0.4, -0.3)
    scene = two_blocks(COMM, dim, cell, 3, 2, tilt=tilt, rotation=R)
    check_hydrostatic(scene, R @ tilted_normal(tilt), degree, method)


# A3: large compression


def check_squeezed(problem, F, P, swap=False, measure="reference"):
    problem.solve(rtol=ROUNDING)
    print(problem.history)
    assert worst(problem.gradient() + np.eye(problem.dim) - F) <= 1e-8
    up = upward(problem.dim)
    normal = up if swap else -up
    assert errors(problem, P, normal)["stress"] <= TOLERANCE
    if measure == "current":
        # The multiplier is the traction of the Cauchy stress
        P = P @ F.T / np.linalg.det(F)
    lam = problem.slave_multiplier()
    vector = lam.shape[1] > 1
    exact = P @ normal if vector else normal @ P @ normal
    found = worst(lam - exact) / np.linalg.norm(P @ normal)
    print(f"multiplier {found:.1e}")
    assert found <= TOLERANCE


@pytest.mark.mpi(
    where=lambda degree, multiplier, measure, **_: (degree, multiplier, measure)
    == (1, "vector", "current")
)
@pytest.mark.parametrize("measure", ["reference", "current"])
@pytest.mark.parametrize("multiplier", METHODS)
@pytest.mark.parametrize("degree", [1, 2])
def test_large_compression_is_homogeneous(cell, degree, multiplier, measure):
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, *((5, 4) if dim == 2 else (3, 2)))
    swap = multiplier == "vector"
    method = METHODS[multiplier]
    problem, F, P = squeeze(scene, degree, method, measure=measure, swap=swap)
    check_squeezed(problem, F, P, swap, measure)


@pytest.mark.mpi
@pytest.mark.parametrize("material", ["linear", "svk"])
def test_large_compression_of_other_materials(cell_2d, material):
    problem, F, P = squeeze(two_blocks(COMM, 2, cell_2d), material=material)
    check_squeezed(problem, F, P)
