"""Damping of bodies: closed forms, order, tangent, balances, what is refused."""

from functools import cache

import hosts
import moving
import numpy as np
import pytest
import strips
import ufl
from dolfinx import fem
from problems import COMM, worst
from scipy.linalg import eigh

import raymortar
from raymortar import ContactError, dynamics, rigid
from raymortar.core.errors import SetUpError
from raymortar.dynamics import Adaptive, GeneralizedAlpha, Midpoint, Newmark
from raymortar.dynamics.motion import InertiaTerm, Motion

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
MASSES = ["nearest", "affine", "consistent"]
RHO, E = 2.0, 50.0


def bar(alpha=0.0, beta=0.0, mass="nearest", held=True, gap=5.0, soft=0.0, **options):
    """An elastic bar above a plane, with Rayleigh damping alpha M + beta K."""
    scene = moving.bars(n=6, lower=False, gap=gap, width=0.4)
    V, u, v = scene.V, scene.u, scene.v
    scene.energy, residual = moving.elastic(scene, E)
    if soft:
        residual = strips.neo_hookean(u, soft)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    scene.contact = raymortar.Contact(
        u, scene.facets, [(moving.SLAVE, floor)], **options
    )
    head = scene.facets.find(moving.HEAD)
    scene.up = fem.Constant(scene.mesh, 0.0)
    scene.bcs = [
        raymortar.tools.prescribe(V, head, scene.up, 1),
        raymortar.tools.prescribe(V, head, 0.0, 0),
    ]
    bcs = scene.bcs if held else []
    scene.problem = raymortar.NonlinearProblem(residual, scene.contact, bcs)
    a = scene.a
    strain = ufl.inner(ufl.sym(ufl.grad(a)), ufl.sym(ufl.grad(v)))
    scene.alpha, by_strain = (fem.Constant(scene.mesh, float(c)) for c in (alpha, beta))
    damping = scene.alpha * RHO * ufl.inner(a, v) * ufl.dx
    damping += by_strain * E * strain * ufl.dx
    form = RHO * ufl.inner(a, v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, scene.contact, mass, damping=damping)
    return scene


def steps_of(scene, scheme, dt, end, **options):
    return dynamics.TimeSteps(
        scene.problem.snes_solver, scene.inertia, end=end, dt=dt, scheme=scheme,
        **options,
    )  # fmt: skip


def constant(scene, *value):
    found = fem.Function(scene.V)
    found.x.array.reshape(-1, scene.d)[:] = value
    return found


@cache
def coasting_error(scheme, mass, n):
    """Error of the way that a free body coasts while damping by its mass stops it."""
    scene = bar(alpha=3.0, mass=mass, held=False)
    v0 = constant(scene, 0.3, 0.2)
    steps_of(scene, scheme, 0.5 / n, 0.5, velocity=v0).run()
    exact = (1.0 - np.exp(-3.0 * 0.5)) / 3.0 * np.array([0.3, 0.2])
    return worst(scene.u.x.array.reshape(-1, 2) - exact)


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mass", MASSES)
def test_a_free_body_coasts_as_in_closed_form(scheme, mass):
    errors = [coasting_error(scheme, mass, n) for n in (16, 32)]
    assert errors[1] <= 1e-4
    assert 1.9 <= np.log2(errors[0] / errors[1]) <= 2.1


def oscillation(t, rate, square):
    """A damped oscillator that starts from 1 at rest."""
    d, w = 0.5 * rate, np.sqrt(square - 0.25 * rate**2)
    return np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))


def mode(scene):
    """The lowest mode of a bar, owned values, and the square of its frequency: one rank."""
    layout, free = scene.contact.layout, ~scene.problem.prescribed
    K = scene.problem.create_matrix()
    K.zeroEntries()
    scene.problem.volume.add_tangent(K, scene.problem.bcs)
    K.assemble()
    rows = np.flatnonzero(free)
    stiffness, mass = (
        M.getValues(range(layout.n), range(layout.n))[np.ix_(rows, rows)]
        for M in (K, scene.inertia.matrix)
    )
    inverse, modes = eigh(mass, stiffness)  # nodes without mass: eigenvalue 0
    shape = np.zeros(layout.n)
    shape[rows] = modes[:, -1] / np.abs(modes[:, -1]).max()
    return shape, 1.0 / inverse[-1]


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize(
    "alpha, beta, mass", [(4.0, 0.0, "nearest"), (1.0, 0.2, "consistent")]
)
def test_a_mode_is_the_damped_oscillator_to_order_2(scheme, alpha, beta, mass):
    """Damping by the mass keeps modes for any rule, that by stiffness for one mass."""
    errors = []
    for n in (40, 80):
        scene = bar(alpha, beta, mass)
        shape, square = mode(scene)
        scene.u.x.array[:] = 1e-2 * shape
        steps_of(scene, scheme, 0.6 / n, 0.6).run()
        now = 1e-2 * oscillation(0.6, alpha + beta * square, square)
        errors.append(worst(scene.u.x.array - now * shape) / 1e-2)
    assert errors[1] <= 2e-3
    assert 1.9 <= np.log2(errors[0] / errors[1]) <= 2.1


def test_adaptive_steps_follow_the_damped_oscillator():
    found = []
    for error in (1e-2, 1e-3):
        scene = bar(4.0)
        shape, square = mode(scene)
        scene.u.x.array[:] = 1e-2 * shape
        steps = steps_of(scene, Newmark(), 0.1, 0.6, adapt=Adaptive(error=error))
        count = len(list(steps))
        off = worst(scene.u.x.array - 1e-2 * oscillation(0.6, 4.0, square) * shape)
        found.append((count, off / 1e-2))
    assert found[0][0] < found[1][0]
    assert found[1][1] < 0.3 * found[0][1] <= 1e-2


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mass", MASSES)
def test_the_tangent_is_that_of_differences(scheme, mass):
    scene = bar(2.0, 0.3, mass, gap=0.0, soft=20.0)
    motion = Motion(scene.inertia, scheme)
    term = InertiaTerm(scene.problem, motion)
    motion.set_velocity([constant(scene, 0.3, -0.2)])
    motion.begin(0.1)
    with term.acting():
        assert 1.8 <= moving.taylor_slope(scene.problem, 3) <= 2.2


def balance(history):
    """Energy less what works on the body, and what damping took."""
    gained = history["kinetic"] + history["elastic"] + history["dissipated"]
    return gained - history["contact_work"] - history["external_work"]


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", [Newmark(), Midpoint()], ids=str)
@pytest.mark.parametrize("mass", MASSES[:2])
def test_damping_takes_what_vibration_loses(scheme, mass):
    scene = bar(2.0, 0.05, mass)
    scene.u.interpolate(lambda x: 1e-2 * np.vstack([6.0 - x[1], 0.5 * (6.0 - x[1])]))
    history = raymortar.History(scene.problem)
    steps_of(scene, scheme, 0.02, 1.0, energy=scene.energy, history=history).run()
    whole, taken = balance(history), history["dissipated"]
    start = history["kinetic"] + history["elastic"]
    assert taken[-1] > 0.5 * start[0]
    assert np.all(np.diff(taken) >= 0.0)
    assert worst(whole / whole[0] - 1.0) <= 1e-9


@pytest.mark.mpi
def test_energies_balance_in_an_impact():
    scene = bar(0.0, 0.05, held=False, gap=0.02, friction=raymortar.Coulomb(0.3))
    history = raymortar.History(scene.problem)
    steps = steps_of(
        scene, Newmark(), 0.005, 0.8, energy=scene.energy, history=history,
        velocity=constant(scene, 0.05, -0.2),
    )  # fmt: skip
    steps.run()
    assert history["active"].max() > 0.0 == history["active"][-1]
    whole, total = balance(history), history["kinetic"] + history["elastic"]
    assert worst(whole / whole[0] - 1.0) <= 1e-8
    assert 0.01 < history["dissipated"][-1] / total[0] < 0.9
    assert total.max() <= total[0] * (1.0 + 1e-3)


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mass", MASSES)
def test_damping_of_strain_rates_keeps_momentum(scheme, mass):
    scene = bar(0.0, 0.2, mass, held=False)
    v0 = fem.Function(scene.V)
    v0.interpolate(lambda x: np.vstack([0.1 + 0.0 * x[0], 0.5 * np.sin(3.0 * x[1])]))
    history = raymortar.History(scene.problem)
    steps_of(
        scene, scheme, 0.02, 0.4, velocity=v0, history=history, energy=scene.energy
    ).run()
    p = history["momentum_y"]
    assert history["dissipated"][-1] > 0.01 * history["kinetic"][0]
    assert worst(np.diff(p)) <= 1e-11
    assert worst(np.diff(history["momentum_x"])) <= 1e-11


@pytest.mark.mpi
@pytest.mark.parametrize("mass", MASSES)
def test_reactions_contain_damping(mass):
    """What lifts a damped bar is what its momentum gains, and does the work."""
    scene = bar(0.0, 0.3, mass)
    history = raymortar.History(scene.problem, reactions={"head": scene.bcs})

    def lift(t):
        scene.up.value = 0.1 * (1.0 - np.cos(4.0 * t))

    steps_of(
        scene, Newmark(), 0.01, 0.6, apply=lift, energy=scene.energy, history=history
    ).run()
    change = np.diff(history["momentum_y"]) / np.diff(history["time"])
    force = history["reaction_head_y"]
    assert worst(change - 0.5 * (force[1:] + force[:-1])) <= 1e-8 * worst(force)
    whole = balance(history)
    assert worst(whole - whole[0]) <= 1e-8 * history["kinetic"].max()
    assert history["dissipated"][-1] > 0.1 * history["kinetic"].max()


@pytest.mark.mpi
def test_the_matrix_follows_a_constant_of_the_form():
    scene = bar(2.0)
    one = np.ones(scene.V.dofmap.index_map.size_local * 2)
    before, mass = scene.inertia.damped(one), scene.inertia.times(one)
    made_once = scene.inertia.revision
    scene.inertia.damped(one)
    assert scene.inertia.revision == made_once
    assert worst(before - 2.0 * mass) <= 1e-12
    scene.alpha.value = 6.0
    assert worst(scene.inertia.damped(one) - 3.0 * before) <= 1e-12
    assert scene.inertia.revision == made_once + 1


@pytest.mark.mpi
def test_of_several_unknowns_one_is_damped():
    hosted = hosts.taylor_hood("list")
    functions = hosted.contact.unknowns.functions
    V = functions[0].function_space
    a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    mass = ufl.inner(a, v) * ufl.dx
    inertia = dynamics.Inertia([mass, None], hosted.contact, damping=[3.0 * mass, None])
    values = np.ones(hosted.contact.unknowns.owned_starts[-1])
    assert worst(inertia.damped(values) - 3.0 * inertia.times(values)) <= 1e-12
    assert worst(inertia.damped(values)) > 0.0


def damped_by(damping):
    scene = bar()
    return dynamics.Inertia(
        RHO * ufl.inner(scene.a, scene.v) * ufl.dx, scene.contact,
        damping=damping(scene),
    )  # fmt: skip


@pytest.mark.mpi
@pytest.mark.parametrize(
    "damping, text",
    [
        (
            lambda s: ufl.inner(s.u, s.v) * ufl.dx,
            "damping is a form of rank 1.*velocity",
        ),
        (lambda s: s.v[0] * ufl.dx, "damping is a form of rank 1.*velocity, a trial"),
        (lambda s: fem.Constant(s.mesh, 1.0) * ufl.dx, "rank 0.*velocity"),
        (lambda s: 3.0, "damping must be one UFL form.*float"),
        (lambda s: [None], "damping must be a bilinear form of the velocity"),
        (lambda s: 1j * ufl.inner(s.a, s.v) * ufl.dx, "damping has complex values"),
        (
            lambda s: fem.Constant(s.mesh, 1j) * ufl.inner(s.a, s.v) * ufl.dx,
            "damping has complex values",
        ),
    ],
    ids=["function", "load", "functional", "number", "none", "complex", "constant"],
)
def test_wrong_forms_are_refused(damping, text):
    with pytest.raises(ContactError, match=text):
        damped_by(damping)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "damping, text",
    [
        (
            lambda s: s.u[0] * ufl.inner(s.a, s.v) * ufl.dx,
            "damping depends on u, which the problem solves for",
        ),
        (
            lambda s: [ufl.inner(s.a, s.v) * ufl.dx, None],
            "damping has 2 forms for 1 unknowns",
        ),
    ],
    ids=["of the unknown", "two"],
)
def test_forms_that_do_not_fit_the_problem_are_refused(damping, text):
    inertia = damped_by(damping)
    with pytest.raises(ContactError, match=text):
        inertia.matrix


@pytest.mark.mpi
def test_what_has_no_mass_is_not_damped():
    scene = bar()
    x = ufl.SpatialCoordinate(scene.mesh)
    density = ufl.conditional(ufl.lt(x[1], 5.5), RHO, 0.0)
    plain = ufl.inner(scene.a, scene.v)
    inertia = dynamics.Inertia(
        density * plain * ufl.dx, scene.contact, damping=0.1 * plain * ufl.dx
    )
    with pytest.raises(SetUpError, match="damping acts on unknowns without mass"):
        inertia.matrix
