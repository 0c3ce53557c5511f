"""Tractions of friction that no free displacement feels: the sides are held along the
surface [theory (5.21), (5.22)]."""

import numpy as np
import pytest
from friction_states import FrictionCase, frictional_pairs, set_both
from held_sides import KINDS, LAWS, PRESS, blocks, pressed, split
from problems import COMM, DIMENSION, build, fix, worst
from tangents import is_first_order, is_second_order, quiet_slopes

from meshes.scenes import two_blocks
from raymortar import ContactError, Coulomb, SNESSolver
from raymortar.core.interface.unfelt import unfelt_parts

TILT = 0.3
# Of the tests of tangents; larger steps see the curvature of the cone
FIRST_STEPS = 10.0 ** np.array([-3.5, -4.0])
SPUN = np.linalg.qr(np.array([[3.0, 1.0, 0.4], [-0.8, 3.0, 0.5], [-0.5, -0.6, 3.0]]))[0]

# Blocks that are pressed


@pytest.mark.quick
@pytest.mark.mpi(
    where=lambda cell, degree, law, **_: (cell, degree)
    in [("triangle", 2), ("hexahedron", 1)]
)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell, degree", KINDS)
def test_pressing_makes_no_friction(cell, degree, law):
    """Nothing can slip, and nothing pushes along the surface."""
    dim = DIMENSION[cell]
    for friction in (0.1, 1.0):
        case = pressed(cell, degree, law, range(dim - 1), friction)
        iterations = case.solve(SNESSolver)
        normal, tangential = split(case, np.eye(dim)[-1])
        assert normal == pytest.approx(PRESS, rel=1e-10)
        assert worst(tangential) < 1e-10 * PRESS
        assert worst(case.slave_multiplier()[:, :-1]) < 1e-10 * PRESS
        assert iterations <= 4


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("E", [2e3, 2e6])
def test_surfaces_that_bend_have_the_friction_of_their_tilt(E, law):
    """The gap of facets of degree 2 in space closes in the mean only. The slave's normals
    tilt by the strain, and with them a pressure without any friction."""
    forces = []
    for friction in (1e-12, 1.0):
        case = pressed("tetrahedron", 2, law, range(2), friction, E=E)
        case.solve(SNESSolver)
        forces.append(split(case, np.eye(3)[-1])[1])
    strain = PRESS / E
    assert worst(forces[1]) < 5e-3 * strain * PRESS
    assert worst(forces[1] - forces[0]) < 1e-3 * strain * PRESS


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, law, **_: (cell, law) == ("hexahedron", "points"))
@pytest.mark.parametrize("unit, E", [(1e-3, 2e11), (1e3, 1e-2)])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
def test_units_do_not_matter(cell, law, unit, E):
    dim = DIMENSION[cell]
    size = (unit,) * dim
    scene = two_blocks(COMM, dim, cell, 2, 3, lower_size=size, upper_size=size)
    load = -1e-3 * E
    case = pressed(cell, 1, law, range(dim - 1), scene=scene, E=E, load=load)
    case.solve(SNESSolver)
    normal, tangential = split(case, np.eye(dim)[-1])
    assert normal == pytest.approx(1e-3 * E * unit ** (dim - 1), rel=1e-9)
    assert worst(tangential) < 1e-9 * normal


@pytest.mark.quick
@pytest.mark.parametrize("law", LAWS)
def test_oblique_surfaces_have_none_either(law):
    """Held along x alone, a block can move along y alone: against a surface that is
    oblique to both it opens or closes, and cannot slip."""
    scene = blocks("quadrilateral", rotation=TILT)
    n = np.array([-np.sin(TILT), np.cos(TILT)])
    case = pressed("quadrilateral", 1, law, [0], scene=scene)
    case.solve(SNESSolver)
    normal, tangential = split(case, n)
    assert normal > 0.5 * PRESS
    assert worst(tangential) < 1e-8 * normal


@pytest.mark.quick
@pytest.mark.mpi(
    where=lambda law, held, nu, **_: (law, held, nu) == ("nodes", (1,), 0.0)
)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("held", [(0,), (1,), (2,), (0, 1), (1, 2)])
@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_oblique_surfaces_in_space(nu, law, held):
    """One free direction leaves no slip. Two leave one, across the held axis and the
    normal; the rest of the tangent plane has no friction, where contact is closed
    throughout (nu = 0, and where z is free). Points that open along another axis move
    along the surface, which counts as slip; at nodes the mean gap stays closed."""
    opens = nu > 0.0 and 2 in held
    bound = {"points": 1.5e-3}.get(law, 5e-6) if opens else 1e-10
    scene = blocks("hexahedron", (2, 3), rotation=SPUN)
    n = SPUN[:, 2]
    case = pressed("hexahedron", 1, law, held, scene=scene, friction=2.0, nu=nu)
    case.solve(SNESSolver)
    normal, tangential = split(case, n)
    slips = np.zeros(3)
    if len(held) == 1:
        slips = np.cross(np.eye(3)[held[0]], n)
        slips /= np.linalg.norm(slips)
    assert normal > 0.0
    assert worst(tangential - (tangential @ slips) * slips) < bound * normal


def test_free_directions_keep_their_friction():
    """Held along x and pushed along y below the bound: the friction is the push."""
    push = 0.2 * PRESS
    load = -PRESS * np.eye(3)
    load[1, 2] = push
    case = pressed("hexahedron", 1, "nodes", [0], load=load)
    case.solve(SNESSolver)
    _, tangential = split(case, np.array([0.0, 0.0, 1.0]))
    assert worst(tangential - [0.0, -push, 0.0]) < 1e-9 * PRESS


# The parts of tractions


@pytest.mark.quick
@pytest.mark.parametrize("d", [2, 3])
def test_parts_leave_only_directions_of_slip(d):
    """Behind the projection on the tangent plane (5.21) is the orthogonal projection on
    what no motion of the free components slips along while the gap stays closed."""
    random = np.random.default_rng(3)
    normals = [*random.normal(size=(20, d)), *np.eye(d), *(-np.eye(d))]
    for n in normals:
        n = n / np.linalg.norm(n)
        T = np.eye(d) - np.outer(n, n)
        for number in range(2**d):
            held = np.array([number >> i & 1 for i in range(d)], dtype=bool)
            (P,) = unfelt_parts(held[None], n[None])
            # Motions of the free components along the surface
            free = np.eye(d)[:, ~held]
            _, sizes, right = (
                np.linalg.svd(n[None] @ free) if free.size else ([], [], [])
            )
            rank = int(np.sum(np.asarray(sizes) > 1e-12))
            S = free @ right[rank:].T if free.size else np.zeros((d, 0))
            expected = np.zeros((d, d)) if not held.any() else T - S @ S.T
            np.testing.assert_allclose(T @ P, expected @ np.eye(d), atol=1e-12)


# The pressure


@pytest.mark.quick
@pytest.mark.mpi(where=lambda law, friction: (law, friction) == ("nodes", 0.3))
@pytest.mark.parametrize("friction", [None, 0.3])
@pytest.mark.parametrize("law", LAWS)
def test_a_pressure_that_nothing_feels_is_refused(law, friction):
    """Both sides are held along their normal, and overlap; along x they are free."""
    scene = two_blocks(COMM, 2, "quadrilateral", 2, 4, gap=-1e-3)

    def bcs(V, scene):
        sides = [fix(V, scene, name, 1) for name in ("slave", "master")]
        return [*sides, *(fix(V, scene, name) for name in ("bottom", "top"))]

    law_of = None if friction is None else Coulomb(friction)
    case = build(scene, method=LAWS[law], friction=law_of, bcs=bcs)
    with pytest.raises(ContactError, match="prescribed on both sides"):
        SNESSolver(case.problem).solve()


@pytest.mark.quick
@pytest.mark.parametrize("law", LAWS)
def test_a_pressure_that_something_feels_is_not(law):
    """One of the sides is free along its normal."""
    for free, held in (("slave", "master"), ("master", "slave")):
        scene = two_blocks(COMM, 2, "quadrilateral", 3, 3, gap=-1e-3)

        def bcs(V, scene, free=free, held=held):
            own = [fix(V, scene, free, 0), fix(V, scene, held)]
            return [*own, *(fix(V, scene, name) for name in ("bottom", "top"))]

        case = build(scene, method=LAWS[law], friction=Coulomb(0.3), bcs=bcs)
        SNESSolver(case.problem).solve()
        normal, tangential = split(case, np.array([0.0, 1.0]))
        assert normal > 0.0
        assert worst(tangential) < 1e-10 * normal


# Derivatives


@pytest.mark.quick
@pytest.mark.mpi(
    where=lambda cell, method: (cell, method) == ("quadrilateral", "nodes")
)
@pytest.mark.parametrize("method", ["augmented", "nodes", "dual"])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "tetrahedron"])
def test_tangent_is_exact_for_any_parts(cell, method):
    """At random states and for random parts, also where segments move."""
    case = FrictionCase(cell, 1, 1, method, "current", "coulomb", "slip")
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        contact.update()
        random = np.random.default_rng(seed)
        d = case.dim
        size = random.normal(size=(d, d)), random.normal(size=(d,))
        lam = contact.multiplier.x.array.reshape(-1, d)
        for zone in contact.zones:
            nodes = zone.multiplier_nodes
            parts = np.broadcast_to(0.3 * size[0], (len(nodes), d, d))
            zone.cpp.set_unfelt(
                parts.copy(), lam[nodes] + 0.1 * size[1], np.empty(0, np.int8)
            )
        return True

    full, fixed = quiet_slopes(
        frictional_pairs(case, scene), prepare, first_steps=FIRST_STEPS
    )
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed
