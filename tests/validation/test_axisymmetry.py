"""Solids of revolution: patch tests, tangents, areas, closed forms, refusals."""

import gathered
import hosts
import numpy as np
import pytest
import revolution
import states
from dolfinx import fem
from friction_states import FrictionCase, check_regime, law_for, set_both
from problems import COMM, fix, worst
from revolution import on_axis
from tangents import Pair, is_second_order, quiet_slopes

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    History,
    LoadSteps,
    Penalty,
    SNESSolver,
    Stick,
    rigid,
)

E, NU, PRESSURE = 2000.0, 0.3, 25.0
MEASURES = ("reference", "current")
FORMS = [("triangle", 1), ("triangle", 2), ("quadrilateral", 1), ("quadrilateral", 2)]


def blocks(cell, radius=0.0, **options):
    """Two cylinders on each other, or rings of an inner radius; 2 wide, 1 high each."""
    scene = two_blocks(COMM, 2, cell, (4, 2), (3, 3), lower_size=(2.0, 1.0),
                       upper_size=(2.0, 1.0), **options)  # fmt: skip
    return revolution.moved(scene, radius)


def axis_of(V, scene, radius):
    """What holds the inner side: the axis, nothing off it."""
    return [on_axis(V, scene)] if radius == 0.0 else []


def error_of(found, exact):
    """Largest difference of the displacement from a function of X. Collective."""
    V = found.u.function_space
    X = V.tabulate_dof_coordinates()[:, :2]
    return worst(found.u.x.array.reshape(-1, 2) - exact(X))


# Patch tests


@pytest.mark.mpi(where=lambda form, radius, **_: form[1] == 1 and radius == 0.0)
@pytest.mark.parametrize("method", ("normal", "vector", "penalty"))
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("radius", (0.0, 3.0))
@pytest.mark.parametrize("form", FORMS, ids=lambda f: f"{f[0]}-P{f[1]}")
def test_a_pressed_pair_is_uniform(form, radius, measure, method):
    """Cylinders on the axis, and discs whose hole may grow: sigma_z alone."""
    cell, degree = form
    grow = NU * PRESSURE / E  # of all radii
    gamma = 1e5
    current = measure == "current"
    # Penalty: with the current measure as many times as much lies on the same area
    sunk = (
        PRESSURE / gamma / (1.0 + grow) ** (2 * current) if method == "penalty" else 0
    )
    way = -2.0 * PRESSURE / E - sunk

    def supports(V, scene):
        held = [fix(V, scene, "bottom", 1), fix(V, scene, "top", 1, way)]
        return held + axis_of(V, scene, radius)

    found = revolution.build(
        blocks(cell, radius, perturb=0.2), degree, E=E, nu=NU, bcs=supports,
        measure=measure,
        method=Penalty(gamma) if method == "penalty" else AugmentedLagrangian(
            multiplier=method
        ),
    )  # fmt: skip
    assert revolution.solve(found) <= 5

    def exact(X):
        z = X[:, 1]
        return np.column_stack([grow * X[:, 0], -PRESSURE / E * z - sunk * (z > 1.0)])

    # At the interface both bodies have nodes: the upper one's lie below by what it sinks
    if method != "penalty":
        assert error_of(found, exact) <= 1e-10
    p = gathered.points(found.contact)
    pressure = PRESSURE / (1.0 + grow) ** (2 * current)
    assert p["pressure"] == pytest.approx(pressure, rel=1e-9)
    turn = np.pi * ((radius + 2.0) ** 2 - radius**2) * (1.0 + grow) ** (2 * current)
    assert p["weight"].sum() == pytest.approx(turn, rel=1e-9)
    resultant = found.contact.resultant()
    force = PRESSURE * np.pi * ((radius + 2.0) ** 2 - radius**2)
    assert resultant.force == pytest.approx([0.0, force], rel=1e-9, abs=1e-9)
    assert resultant.moment == 0.0
    assert abs(resultant.radial) <= 1e-8 * force


@pytest.mark.mpi(where=lambda form, **_: form == ("triangle", 2))
@pytest.mark.parametrize("friction", (None, Coulomb(0.5), Stick()), ids=str)
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("radius", (0.0, 3.0))
@pytest.mark.parametrize("form", FORMS, ids=lambda f: f"{f[0]}-P{f[1]}")
def test_hydrostatic_pressure_passes_through_a_cone(form, radius, measure, friction):
    """An inclined interface, under a uniform pressure from all sides."""
    cell, degree = form
    shrink = PRESSURE * (1.0 - 2.0 * NU) / E

    def supports(V, scene):
        sides = ["bottom", "top", "lower_right", "upper_right"]
        sides += ["lower_left", "upper_left"] if radius else []
        shrunk = [fix(V, scene, sides, None, lambda X: -shrink * X)]
        return shrunk + axis_of(V, scene, radius)

    found = revolution.build(
        blocks(cell, radius, interface=lambda x: 0.8 + 0.2 * x[:, 0]),
        degree, E=E, nu=NU, bcs=supports, measure=measure, friction=friction,
    )  # fmt: skip
    revolution.solve(found)
    assert error_of(found, lambda X: -shrink * X) <= 1e-10
    p = gathered.points(found.contact)
    pressure = PRESSURE / (1.0 - shrink) ** (2 * (measure == "current"))
    assert p["pressure"] == pytest.approx(pressure, rel=1e-8)
    # Of the cone's surface, seen from above and from the side
    resultant = found.contact.resultant()
    outer, inner = radius + 2.0, radius
    area = np.pi * (outer**2 - inner**2)
    assert resultant.force[1] == pytest.approx(PRESSURE * area, rel=1e-8)
    assert resultant.radial == pytest.approx(-0.2 * PRESSURE * area, rel=1e-8)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("radius", (0.0, 3.0))
def test_a_large_squeeze_is_homogeneous(radius, measure):
    """Neo-Hookean, 20 %: the radial stretch follows from the free side."""
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    stretch = 1.0
    for _ in range(50):  # P_r = mu (a - 1/a) + lambda ln(a^2 0.8) / a = 0
        a = stretch
        value = mu * (a - 1 / a) + lmbda * np.log(a * a * 0.8) / a
        slope = mu * (1 + 1 / a**2) + lmbda * (2 - np.log(a * a * 0.8)) / a**2
        stretch -= value / slope
    scene = blocks("quadrilateral", radius)
    moved = fem.Constant(scene.mesh, 0.0)

    def supports(V, scene):
        held = [fix(V, scene, "bottom", 1), fix(V, scene, "top", 1, moved)]
        return held + axis_of(V, scene, radius)

    found = revolution.build(
        scene, 2, "neo-hookean", E=E, nu=NU, bcs=supports, measure=measure
    )

    def apply(t):
        moved.value = -0.4 * t

    LoadSteps(SNESSolver(found.problem), apply, 2).run()
    exact = [stretch - 1.0, -0.2]
    assert error_of(found, lambda X: X * exact) <= 1e-8
    nominal = mu * (0.8 - 1 / 0.8) + lmbda * np.log(stretch**2 * 0.8) / 0.8
    p = gathered.points(found.contact)
    expected = nominal / stretch ** (2 * (measure == "current"))
    assert p["pressure"] == pytest.approx(-expected, rel=1e-8)


# Tangents


def full_pair(scene, case):
    return Pair(
        *(
            states.make_contact(scene, case, tangent=t, axisymmetric=True)
            for t in ("fixed", "full")
        )
    )


@pytest.mark.parametrize("method", states.METHODS)
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("degrees", states.DEGREES)
@pytest.mark.parametrize("kind", ("many", "overhang"))
def test_full_tangent(kind, degrees, measure, method, record_property):
    case = states.Case("triangle", *degrees, method, measure)
    scene = case.scene(kind)

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, _ = quiet_slopes(
        lambda seed: full_pair(scene, case), prepare, wanted=lambda contact: True
    )
    record_property("slope", full.tolist())
    assert is_second_order(full), full


@pytest.mark.parametrize("law, regime", [("coulomb", "slip"), ("tresca", "stick")])
@pytest.mark.parametrize("method", ("augmented", "elastic", "rate"))
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("degrees", states.DEGREES)
def test_full_tangent_with_friction(degrees, measure, method, law, regime):
    case = FrictionCase("quadrilateral", *degrees, method, measure, law, regime)
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, regime)
        return True

    def make(seed):
        friction = law_for(case, scene, seed)
        if friction is None:
            return None
        return Pair(
            *(
                case.contact(scene, friction, tangent=t, axisymmetric=True)
                for t in ("fixed", "full")
            )
        )

    full, _ = quiet_slopes(make, prepare, wanted=lambda contact: True)
    assert is_second_order(full), full


SHAPES = {
    "sphere": rigid.Circle((0.0, 1.9), 1.0),
    "torus": rigid.Circle((0.6, 1.6), 0.7),
    "cone": rigid.Wedge((0.0, 0.9), (0.0, 1.0), 1.3),
    "funnel": rigid.Line((0.5, 0.92), (0.1, -1.0)),
}
LAWS = {
    "normal": {},
    "friction": {"friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(400.0), "friction": Coulomb(0.3)},
    "nodes": {
        "method": AugmentedLagrangian(condition="nodes"),
        "friction": Coulomb(0.3),
    },
    "dual": {
        "method": AugmentedLagrangian(condition="nodes", multiplier="dual"),
        "friction": Coulomb(0.3),
    },
}


def pressed(name, measure="reference", degree=2, n=3, **options):
    """A disc of rubber on the axis, below a rigid tool."""
    return revolution.build(
        revolution.disc("triangle", n), degree, "neo-hookean", E=40.0,
        bcs=lambda V, s: [fix(V, s, "bottom"), on_axis(V, s)],
        master=rigid.Body(SHAPES[name]), measure=measure, **options,
    )  # fmt: skip


@pytest.mark.mpi(
    where=lambda law, measure, **_: (law, measure) == ("penalty", "current")
)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("name", SHAPES)
def test_tangent_of_rigid_tools(name, measure, law):
    found = pressed(name, measure, **LAWS[law])
    revolution.solve(found)
    found.contact.advance()
    body = found.contact.pairs[0].master
    body.move((0.0, -0.03))
    found.solver.solve()
    assert gathered.points(found.contact)["status"].max() > 1
    aways = (0.002, 0.004, 0.007)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-7


@pytest.mark.mpi
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("measure", MEASURES)
def test_forces_are_those_of_the_support(measure, law):
    found = pressed("sphere", measure, **LAWS[law])
    revolution.solve(found)
    resultant = found.contact.resultant()
    reaction = found.problem.reactions({"below": found.problem.bcs[:1]})["below"]
    assert resultant.force[1] < 0.0
    assert reaction[1] == pytest.approx(-resultant.force[1], rel=1e-7)
    assert resultant.force[0] == resultant.moment == 0.0
    p = gathered.points(found.contact)
    t, n, w = p["traction"], p["contact_normal"], p["weight"]
    along = np.einsum("qi,qi->q", t, n)[:, None] * n
    assert resultant.radial == pytest.approx(w @ t[:, 0], rel=1e-10)
    assert resultant.normal == pytest.approx([0.0, w @ along[:, 1]], rel=1e-10)
    of_pairs = found.contact.results.resultants()
    assert of_pairs[0].force == pytest.approx(resultant.force, rel=1e-12)
    assert of_pairs[0].radial == pytest.approx(resultant.radial, rel=1e-12)
    history = History(found.problem)
    history.record(1.0)
    assert history["force_0_y"][0] == resultant.force[1]
    assert history["radial_0"][0] == resultant.radial


def test_friction_in_full_slip_carries_its_share():
    """A plug in a rigid cone: forces of pressure and of friction along the axis."""
    mu, slope = 0.2, 0.3
    scene = revolution.disc(
        "quadrilateral", 4, side=lambda z: 1.0 + slope * z, slave="right"
    )
    down = fem.Constant(scene.mesh, 0.0)
    found = revolution.build(
        scene, 2, "neo-hookean", E=40.0, friction=Coulomb(mu),
        bcs=lambda V, s: [fix(V, s, "top", 1, down), on_axis(V, s)],
        master=rigid.Line((1.0, 0.0), (-1.0, slope)),
    )  # fmt: skip

    def apply(t):
        down.value = -0.1 * t

    LoadSteps(SNESSolver(found.problem), apply, 4).run()
    p = gathered.points(found.contact)
    closed = p["status"] > 1
    assert (p["status"][closed] == 3).all() and closed.mean() > 0.8
    resultant = found.contact.resultant()
    ratio = resultant.tangential[1] / resultant.normal[1]
    assert ratio == pytest.approx(mu / slope, rel=0.02)
