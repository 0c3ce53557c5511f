"""Fields on the slave: offset of the gap, friction coefficients from point to point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import press_fits
import pytest
import states
from dolfinx import fem
from friction_states import FrictionCase, frictional_pairs, in_regime, set_both
from problems import CELLS_2D, COMM, build, fix, symmetry, worst
from sheared_blocks import HOLDING, METHODS, SLIP, Blocks, limit_of
from slave_functions import bumps, function_of
from states import name_of
from tangents import Pair, is_first_order, is_second_order, quiet_slopes

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, Coulomb, LoadSteps, Penalty, Tresca
from raymortar.core import compat


def varying(limit):
    """A friction coefficient between 0.9 and 1.1 of a limit."""
    return lambda x: limit * (1.0 + 0.1 * np.sin(4.0 * x[0] - 2.0 * x[1]))


# Tangents


@dataclass(frozen=True)
class FieldCase(FrictionCase):
    """Contact with friction, an offset and a coefficient from point to point."""

    def contact(self, scene, friction, tangent="fixed", **options):
        kinds = {Coulomb: "mu", Tresca: "bound"}
        if type(friction) in kinds:
            limit = getattr(friction, kinds[type(friction)])
            friction = type(friction)(varying(limit))
        return super().contact(scene, friction, tangent, offset=bumps, **options)


def frictionless_cases():
    for cell in states.CELLS:
        for degrees, method, measure in (
            ((1, 1), "normal", "reference"),
            ((2, 2), "vector", "current"),
            ((1, 2), "penalty", "current"),
        ):
            case = states.Case(cell, *degrees, method, measure)
            quick = [pytest.mark.quick] if method == "normal" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.mpi(where=lambda case, **_: case.cell == "quadrilateral")
@pytest.mark.parametrize("case", list(frictionless_cases()))
def test_tangent_with_an_offset(case, record_property):
    """The offset varies along the facet, and so does gamma; segments move."""
    scene = case.scene("overhang")
    gamma = function_of(
        scene.mesh, lambda x: states.GAMMA * (1.0 + 0.2 * np.cos(2.0 * x[0])), 1
    )

    def make(seed):
        return Pair(
            *(
                states.make_contact(
                    scene,
                    case,
                    gamma=gamma,
                    offset=bumps,
                    tangent=tangent,
                    quadrature_degree=2 if case.dim == 3 else None,
                )
                for tangent in ("fixed", "full")
            )
        )

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, fixed = quiet_slopes(make, prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


def friction_cases():
    for cell in states.CELLS:
        for degrees, method, measure, law, regime in (
            ((1, 1), "augmented", "reference", "coulomb", "slip"),
            ((1, 2), "augmented", "current", "tresca", "slip"),
            ((2, 2), "augmented", "current", "coulomb", "stick"),
            ((1, 2), "elastic", "reference", "coulomb", "slip"),
            ((2, 2), "elastic", "current", "tresca", "slip"),
            ((1, 1), "rate", "current", "tresca", "slip"),
        ):
            case = FieldCase(cell, *degrees, method, measure, law, regime)
            quick = (
                [pytest.mark.quick] if degrees == (1, 1) and cell in CELLS_2D else []
            )
            name = f"{name_of(case)}-{law}-{regime}"
            yield pytest.param(case, id=name, marks=quick)


@pytest.mark.mpi(
    where=lambda case, **_: case.cell == "quadrilateral" and case.law == "coulomb"
)
@pytest.mark.parametrize("case", list(friction_cases()))
def test_tangent_with_offset_and_friction_coefficient(case, record_property):
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        return in_regime(contact, case.regime)

    full, fixed = quiet_slopes(frictional_pairs(case, scene), prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


# Closed forms


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["normal", "vector"])
@pytest.mark.parametrize("kind", ["stress", "strain", "aluminium"])
def test_press_fit_by_offset(kind, method, record_property):
    """Lame's pressure of shaft and hub, meshed without the interference."""
    delta, steel = 0.05, (2.1e5, 0.3)
    shaft = hub = steel
    expected = {"stress": 78.75, "strain": 86.53846, "aluminium": 31.39013}[kind]
    if kind == "aluminium":
        hub = (7e4, 0.33)
    if kind != "strain":
        lame = press_fits.pressure(delta, shaft[0], hub[0], shaft[1], hub[1])
        assert abs(lame / expected - 1.0) <= 1e-6
        shaft, hub = (press_fits.plane_strain_equivalent(*m) for m in (shaft, hub))
    scene = press_fits.scene_of()
    E, nu = ({"shaft": a, "hub": b} for a, b in zip(shaft, hub))
    problem = press_fits.press_fit(
        scene, E, nu, delta, method=AugmentedLagrangian(multiplier=method)
    )
    problem.solve()
    found, spread = press_fits.mean_pressure(problem.contact)
    record_property("error", abs(found / expected - 1.0))
    record_property("spread", spread / expected)
    assert abs(found / expected - 1.0) <= 2e-3
    assert spread <= 0.05 * expected  # 8 on 10 facets; a sixth on twice as many


class Coated(Blocks):
    """The upper block, or the one below, has a coat: it lies higher by that."""

    def __init__(self, *arguments, coat=0.03, **options):
        self.coat = coat
        super().__init__(*arguments, **options)

    @property
    def apart(self):
        return super().apart + self.coat


KINDS = {
    "number": lambda scene, value: value,
    "callable": lambda scene, value: lambda x: np.full(x.shape[1], value),
    "function": lambda scene, value: function_of(
        scene.mesh, lambda x: np.full(x.shape[1], value)
    ),
}


@pytest.mark.mpi(where=lambda cell, **_: cell in ("triangle", "hexahedron"))
@pytest.mark.quick
@pytest.mark.parametrize("coat", [0.03, -0.03])
@pytest.mark.parametrize("method", METHODS)
def test_coated_blocks_slip_as_bare_ones(cell, method, coat, record_property):
    mu = 0.5
    blocks = Coated(cell, METHODS[method](), Coulomb(mu), coat=coat, offset=-coat)
    blocks.press()
    k = limit_of(Coulomb(mu), blocks.dim)
    for slide in (0.02, 0.05):
        error = blocks.step(k, slide + blocks.spring(k))
        record_property("displacement", error)
        assert blocks.statuses() == {SLIP}
        assert abs(blocks.ratio() / mu - 1.0) <= 1e-9
        assert error <= 1e-9
        blocks.contact.advance()
    # At rest the springs keep what they hold
    error = blocks.step(k, slide + blocks.spring(k))
    assert error <= 1e-9 or method == "rate"


@pytest.mark.mpi(where=lambda method, **_: method == "augmented")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", HOLDING)
def test_all_kinds_of_values_are_the_same(method, kind):
    blocks = Coated("quadrilateral", METHODS[method](), Coulomb(0.5), offset=-0.03)
    make, scene = KINDS[kind], blocks.scene
    other = Coated(
        "quadrilateral",
        METHODS[method](),
        Coulomb(lambda x: np.full(x.shape[1], 0.5))
        if kind == "callable"
        else Coulomb(0.5),
    )
    other.contact.set_offset(make(other.scene, -0.03))
    assert scene is not other.scene
    for one in (blocks, other):
        one.press()
        one.step(0.3 * limit_of(Coulomb(0.5), 2))
    np.testing.assert_allclose(
        blocks.problem.u.x.array, other.problem.u.x.array, atol=1e-12
    )


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_traction_of_rigid_sliders_is_mu_of_x_times_pressure(cell, degree):
    """Penalty makes the pressure gamma (overlap - offset) at every point, and slip
    mu(x) times that: resultants are integrals of polynomials."""
    dim = states.Case(cell).dim
    scene = two_blocks(COMM, dim, cell, 3, 2, upper_size=0.6)
    V = compat.vector_space(scene.mesh, degree)
    upper = states.upper_dofs(scene, V)
    left, L = 0.2, 0.6  # of the upper block
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(
        fem.Function(V),
        scene.facet_tags,
        [pair],
        Penalty(10.0, tangential="rate"),
        Coulomb(lambda x: 0.2 + 0.1 * (x[0] - left)),
        offset=lambda x: -0.01 - 0.02 * (x[0] - left),
    )
    contact.update()
    contact.advance()
    u = contact.u.x.array.reshape(-1, dim)
    u[upper, -1] -= 0.01
    u[upper, 0] += 0.2
    contact.update()
    result = contact.resultant()
    # p = 10 (0.02 + 0.02 s), mu = 0.2 + 0.1 s, s from 0 to L
    depth = L ** (dim - 2)
    normal = 10.0 * (0.02 * L + 0.01 * L**2) * depth
    friction = 10.0 * (0.004 * L + 0.003 * L**2 + 0.002 / 3 * L**3) * depth
    assert worst(np.linalg.norm(result.normal) / normal - 1.0) <= 1e-12
    assert worst(result.tangential[0] / friction + 1.0) <= 1e-12


# What reads the gap


def pressed(offset, overlap=0.0, gap=0.0, **options):
    """A block over another one like it, its top down by an overlap."""

    def conditions(V, scene):
        dim = scene.mesh.geometry.dim
        return [
            *symmetry(V, scene),
            fix(V, scene, "bottom", dim - 1),
            fix(V, scene, "top", dim - 1, -overlap),
        ]

    scene = two_blocks(
        COMM,
        2,
        "quadrilateral",
        4,
        4,
        lower_size=(1.0, 1.0),
        upper_size=(1.0, 1.0),
        gap=gap,
    )
    return build(scene, 1, E=100.0, nu=0.0, bcs=conditions, offset=offset, **options)


@pytest.mark.mpi
def test_results_have_the_gap_of_the_law():
    problem = pressed(0.1)
    contact = problem.contact
    contact.update()
    points = contact.points()
    assert worst(points["gap"] - 0.1) <= 1e-14
    assert worst(points["distance"]) <= 1e-14
    counts = contact.statistics
    assert abs(counts.min_gap - 0.1) <= 1e-14 and counts.active_points == 0
    gap = contact.gap().x.array
    assert worst(gap[np.isfinite(gap)] - 0.1) <= 1e-14


@pytest.mark.mpi
@pytest.mark.filterwarnings("error::raymortar.ContactWarning")
@pytest.mark.parametrize("factor", [0.5, 2.5])
def test_surfaces_may_overlap_by_a_clearance(factor, record_property):
    """Also by more than the default depth: twice the facet's size of 0.25."""
    clearance, more = factor * 0.25, 0.02
    problem = pressed(clearance, clearance + more)
    problem.solve()
    contact = problem.contact
    points = contact.points()
    assert worst(points["gap"]) <= 1e-10
    assert worst(points["distance"] + clearance) <= 1e-10
    # Two blocks of height 1 in a column
    assert worst(points["pressure"] - 100.0 * more / 2.0) <= 1e-8


@pytest.mark.mpi
def test_interference_is_seen_from_beyond_the_default_reach():
    """The bodies lie an overlap apart, which is more than twice the facet's size."""
    interference, more = 0.6, 0.02
    problem = pressed(-interference, more, gap=interference)
    problem.solve()
    points = problem.contact.points()
    assert worst(points["gap"]) <= 1e-10
    assert worst(points["pressure"] - 100.0 * more / 2.0) <= 1e-8


@pytest.mark.mpi(where=lambda method, **_: method == "augmented")
@pytest.mark.filterwarnings("error::raymortar.ContactWarning")
@pytest.mark.parametrize("method", ["augmented", "penalty"])
def test_interference_grows_in_load_steps(method):
    """Closed form at every step; a clearance at the end sets the blocks free."""
    options = {"augmented": AugmentedLagrangian(), "penalty": Penalty(1e4)}[method]
    problem = pressed(0.0, method=options)
    contact, found = problem.contact, []
    solver = raymortar.SNESSolver(problem.problem)

    def apply(t):
        contact.set_offset(lambda x: np.full(x.shape[1], -0.08 * t * (1.0 - t)))

    steps = LoadSteps(solver, apply, steps=4, progress=False)
    for step in steps:
        t, points = step.factor, contact.points()
        spring = 2.0 / 100.0 + (1e-4 if method == "penalty" else 0.0)
        expected = 0.08 * t * (1.0 - t) / spring
        assert worst(points["pressure"] - expected) <= 1e-8
        found.append(t)
    assert found == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.mpi
def test_going_back_takes_the_offset_that_is_set():
    problem = pressed(-0.02)
    problem.solve()
    contact = problem.contact
    before, state = contact.points()["pressure"], contact.state()
    contact.advance()
    contact.set_offset(-0.04)
    problem.solve()
    # A column of two blocks: the overlap doubles
    np.testing.assert_allclose(contact.points()["pressure"], 2.0 * before)
    contact.set_offset(-0.02)
    contact.restore(state)
    np.testing.assert_allclose(contact.points()["pressure"], before)


def test_constants_of_ufl_are_refused_by_name():
    """They can be called, but not with points: that took minutes."""
    scene = two_blocks(COMM, 2, "quadrilateral", 2, 2)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    value = fem.Constant(scene.mesh, 0.3)
    pair = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, pair)
    for give in (
        lambda: Contact(u, scene.facet_tags, pair, offset=value),
        lambda: contact.set_offset(value),
        lambda: Coulomb(value),
    ):
        with pytest.raises(raymortar.ContactError, match="a Function or a callable"):
            give()
