"""Friction in solved problems: limits, holding, rotations, restart, fields.

Most of them are homogeneous: F = I + (a - 1) e_z (x) e_z + k e (x) e_z in the blocks,
with a lateral direction e. Of the neo-Hookean law the traction on horizontal planes
is then mu k along e, and depends on a alone along e_z. The tractions of the lateral
faces are given, so that the states are exact on any mesh.
"""

from __future__ import annotations

import numpy as np
import problems
import pytest
import states
from dolfinx import fem
from problems import COMM, DIMENSION, Problem, build, cellwise, lame, worst
from test_friction_tangent import turn

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NewtonSolver,
    Penalty,
    Stick,
    Tresca,
    compat,
)
from raymortar.scenes import two_blocks

E, NU = 10.0, 0.3
SHEAR = lame(E, NU)[0]
HEIGHT, WIDTH = 0.6, 0.8  # of the upper block
SQUEEZE = 0.9  # a
OPEN, STICK, SLIP = 1, 2, 3
METHODS = {
    "augmented": AugmentedLagrangian,
    "elastic": lambda: Penalty(200.0),
    "rate": lambda: Penalty(200.0, tangential="rate"),
}
HOLDING = ("augmented", "elastic")
# Coefficients for blocks that go through partial slip
SOFT = {
    "augmented": AugmentedLagrangian,
    "elastic": lambda: Penalty(30.0),
    "rate": lambda: Penalty(30.0, tangential="rate"),
}


# Homogeneous blocks


def direction(dim):
    """Lateral direction e of the shear."""
    return np.array([1.0, 0.0] if dim == 2 else [0.8, 0.6, 0.0])


def up(dim):
    return np.eye(dim)[-1]


def deformation(dim, k, a=SQUEEZE):
    z = up(dim)
    return np.eye(dim) + (a - 1.0) * np.outer(z, z) + k * np.outer(direction(dim), z)


def nominal(dim, k, a=SQUEEZE):
    """Nominal stress."""
    H = deformation(dim, k, a) - np.eye(dim)
    return problems.MATERIALS["neo-hookean"][1](H, *lame(E, NU))


def pressure(dim):
    """Normal traction on horizontal planes, < 0."""
    return nominal(dim, 0.0)[-1, -1]


class Blocks:
    """A block on a wide foundation that is fixed throughout, or one like itself.

    Its bottom is at height 1, or at 0 with the foundation from -0.6 to 0.
    """

    def __init__(self, cell, method, friction, degree=1, fixed=True, **options):
        self.dim, self.fixed = DIMENSION[cell], fixed
        self.gamma = method.gamma if isinstance(method, Penalty) else np.inf
        self.elastic = getattr(method, "tangential", "") == "elastic"
        lateral = self.dim - 1
        size = 2.0 if fixed else WIDTH
        self.scene = two_blocks(
            COMM,
            self.dim,
            cell,
            lower_divisions=(3,) * lateral + (1,),
            upper_divisions=(2,) * lateral + (2,),
            lower_size=(size,) * lateral + (HEIGHT,),
            upper_size=(WIDTH,) * lateral + (HEIGHT,),
        )
        bodies = ["upper"] if fixed else ["upper", "lower"]
        loaded = [t for t in self.scene.tags if t.split("_")[0] in bodies]
        self.problem: Problem = build(
            self.scene,
            degree,
            "neo-hookean",
            method,
            E=E,
            nu=NU,
            loaded=loaded,
            bcs=self.conditions,
            friction=friction,
            **options,
        )
        self.X = states.dof_positions(self.problem.u.function_space)
        self.bottom = HEIGHT  # of the upper block

    @property
    def contact(self):
        return self.problem.contact

    def conditions(self, V, scene):
        """The foundation or its bottom, and the top, are where `self.ends` says."""
        self.ends = fem.Function(V)
        find = scene.facet_tags.find
        facets = [find(scene.tags[name]) for name in ("top", "bottom")]
        dofs = fem.locate_dofs_topological(V, self.dim - 1, np.concatenate(facets))
        if self.fixed:
            cells = scene.cell_tags.find(scene.bodies["lower"])
            whole = fem.locate_dofs_topological(V, self.dim, cells)
            dofs = np.unique(np.concatenate([dofs, whole]))
        self.held = dofs
        return [fem.dirichletbc(self.ends, dofs)]

    def displacement(self, k, slide=0.0):
        """Of homogeneous shear, the upper block ahead of the foundation by `slide`."""
        upper = self.X[:, -1] > self.bottom - 1e-9
        F = deformation(self.dim, k)
        top = (self.X - self.bottom * up(self.dim)) @ F.T
        top += self.bottom * up(self.dim) + slide * direction(self.dim)
        top += pressure(self.dim) / self.gamma * up(self.dim)
        below = self.X.copy()
        if not self.fixed:
            below = self.X @ F.T
            top += self.bottom * (F - np.eye(self.dim))[:, -1]
        return np.where(upper[:, None], top, below) - self.X

    def exact(self, k, slide=0.0):
        """Where nodes of both bodies coincide the upper one's cells decide."""
        V = self.problem.u.function_space
        u = self.displacement(k, slide)
        lower = np.unique(
            compat.dofmap_array(V)[
                self.scene.cell_tags.find(self.scene.bodies["lower"])
            ]
        )
        F = np.eye(self.dim) if self.fixed else deformation(self.dim, k)
        u[lower] = self.X[lower] @ F.T - self.X[lower]
        return u

    def drive(self, k, slide=0.0, Q=None):
        """Prescribe the ends and lateral tractions of a state, turned by Q."""
        Q = np.eye(self.dim) if Q is None else Q
        x = self.X + self.exact(k, slide)
        self.ends.x.array[:] = (x @ Q.T - self.X).ravel()
        self.problem.load.value[:] = Q @ nominal(self.dim, k)
        return x @ Q.T - self.X

    def step(self, k, slide=0.0):
        """Solve for a state; error of the displacement, the step not yet accepted."""
        u = self.drive(k, slide)
        self.problem.solve()
        return worst(self.problem.u.x.array - u.ravel())

    def press(self):
        """Pressure without shear, accepted.

        From near the solution: a tenth of the height in one step, with slip on the
        way there, is more than Newton's method can do in some of the cases.
        """
        self.problem.u.x.array[:] = self.exact(0.0).ravel()
        if self.contact.multiplier is not None:
            lam = self.contact.multiplier.x.array.reshape(-1, self.dim)
            lam[:, -1] = -0.9 * pressure(self.dim)
        assert self.step(0.0) <= 1e-9
        self.contact.advance()

    def statuses(self):
        """Of all closed points of all ranks."""
        status = self.contact.points()["status"]
        return set().union(*COMM.allgather(set(status[status >= OPEN])))

    def ratio(self):
        """R_T / R_N of the contact force."""
        r = self.contact.resultant()
        return np.linalg.norm(r.tangential) / np.linalg.norm(r.normal)

    def spring(self, k):
        """Slip of springs that hold the shear k."""
        return SHEAR * k / self.gamma if self.elastic else 0.0


def limit_of(friction, dim):
    """Shear k at which a law slips."""
    if isinstance(friction, Tresca):
        return friction.bound / SHEAR
    return friction.mu * -pressure(dim) / SHEAR


# Friction patch (A7)


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("mu", [0.25, 0.5, 1.0])
@pytest.mark.parametrize("method", METHODS)
def test_force_ratio_is_mu_once_it_slips(cell, method, mu, record_property):
    blocks = Blocks(cell, METHODS[method](), Coulomb(mu))
    blocks.press()
    k = limit_of(Coulomb(mu), blocks.dim)
    for slide in (0.02, 0.05, 0.1):
        error = blocks.step(k, slide + blocks.spring(k))
        assert blocks.statuses() == {SLIP}
        record_property("ratio", abs(blocks.ratio() / mu - 1.0))
        record_property("displacement", error)
        assert abs(blocks.ratio() / mu - 1.0) <= 1e-9
        assert error <= 1e-9
        blocks.contact.advance()


@pytest.mark.parametrize("method", HOLDING)
def test_tresca_plateau_is_the_bound(cell, method):
    bound = 0.2
    blocks = Blocks(cell, METHODS[method](), Tresca(bound))
    blocks.press()
    k = limit_of(Tresca(bound), blocks.dim)
    area = WIDTH ** (blocks.dim - 1)
    for slide in (0.02, 0.05):
        blocks.step(k, slide + blocks.spring(k))
        assert blocks.statuses() == {SLIP}
        force = np.linalg.norm(blocks.contact.resultant().tangential)
        assert abs(force / (bound * area) - 1.0) <= 1e-9
        blocks.contact.advance()


@pytest.mark.parametrize("method", HOLDING)
def test_stick_has_no_plateau(cell, method):
    """Ten times what Coulomb friction would hold, without slip."""
    blocks = Blocks(cell, METHODS[method](), Stick())
    blocks.press()
    for k in (0.05, 0.1, 0.2):
        assert blocks.step(k, blocks.spring(k)) <= 1e-9
        assert blocks.statuses() == {STICK}
        force = blocks.contact.resultant().tangential
        area = WIDTH ** (blocks.dim - 1)
        assert worst(force + SHEAR * k * area * direction(blocks.dim)) <= 1e-9
        blocks.contact.advance()


@pytest.mark.parametrize("share", [0.5, 0.99, 1.01])
@pytest.mark.parametrize("method", HOLDING)
def test_uniform_shear_slips_above_the_limit_only(cell, method, share):
    """A traction on all of the upper block's faces cannot pass mu p: with the top
    held, the excess of the imposed shear goes into slip."""
    mu = 0.5
    blocks = Blocks(cell, METHODS[method](), Coulomb(mu))
    blocks.press()
    limit = limit_of(Coulomb(mu), blocks.dim)
    k = min(share, 1.0) * limit
    excess = max(share - 1.0, 0.0) * limit * HEIGHT
    assert blocks.step(k, excess + blocks.spring(k)) <= 1e-9
    assert blocks.statuses() == {SLIP if share > 1.0 else STICK}


@pytest.mark.parametrize("degree", [1, 2])
def test_stick_passes_a_uniform_shear_between_deformable_blocks(cell, degree):
    """A3 with friction: homogeneous simple shear through both, no slip."""
    blocks = Blocks(cell, AugmentedLagrangian(), Coulomb(1.0), degree, fixed=False)
    blocks.press()
    k = 0.1
    assert SHEAR * k < -pressure(blocks.dim)
    assert blocks.step(k) <= 1e-8
    assert blocks.statuses() == {STICK}
    p = blocks.contact.points()
    t = nominal(blocks.dim, k)[:, -1]
    assert worst(p["slip"]) <= 1e-9
    assert worst(p["traction"] + t) <= 1e-8 * np.linalg.norm(t)


# Holding (E7)


@pytest.mark.parametrize("method", METHODS)
def test_held_block_keeps_its_force(cell, method, record_property):
    """Sheared to half the limit, held for 20 steps. The rate form creeps: a step
    leaves 1 / (1 + G / (gamma H)) of the shear in a block of height H."""
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = 0.5 * limit_of(Coulomb(0.5), blocks.dim)
    if method == "rate":
        # The top goes where k is left after the slip of this step
        blocks.step(k, SHEAR * k / blocks.gamma)
    else:
        blocks.step(k, blocks.spring(k))
    forces = [blocks.contact.resultant().tangential]
    total = k * HEIGHT + SHEAR * k / blocks.gamma
    for step in range(1, 21):
        blocks.contact.advance()
        if method == "rate":
            k /= 1.0 + SHEAR / (blocks.gamma * HEIGHT)
            blocks.problem.load.value[:] = nominal(blocks.dim, k)
        blocks.problem.solve()
        assert blocks.statuses() == {STICK}
        forces.append(blocks.contact.resultant().tangential)
    size = np.linalg.norm(forces, axis=1)
    change = abs(size[-1] / size[0] - 1.0)
    record_property("creep", change)
    if method != "rate":
        assert np.abs(size / size[0] - 1.0).max() <= 1e-8
        return
    share = 1.0 / (1.0 + SHEAR / (blocks.gamma * HEIGHT))
    np.testing.assert_allclose(size[1:] / size[:-1], share, rtol=1e-9)
    assert size[-1] < 0.6 * size[0] and total > 0.0


# Rotations of a loaded pair (F1)


def perturb(problem, seed, size=1e-3):
    """Random error of the start, so that Newton's method has something to find."""
    rng = np.random.default_rng(seed)
    u, lam = problem.u, problem.contact.multiplier
    u.x.array[:] += size * rng.uniform(-1.0, 1.0, u.x.array.shape)
    if lam is not None:
        lam.x.array[:] *= 1.0 + size * rng.uniform(-1.0, 1.0, lam.x.array.shape)
    for f in (u, lam):
        if f is not None:
            compat.scatter_forward(f.x)


def turn_guess(problem, Q):
    contact, X = problem.contact, states.dof_positions(problem.u.function_space)
    u = problem.u.x.array.reshape(X.shape)
    u[:] = (X + u) @ Q.T - X
    if contact.multiplier is not None:
        lam = contact.multiplier.x.array.reshape(X.shape[0:0] + (-1, len(Q)))
        lam[:] = lam @ Q.T


@pytest.mark.parametrize("steps", [1, 6])
@pytest.mark.parametrize("method", HOLDING)
def test_rotation_of_a_loaded_pair_is_no_slip(cell, method, steps, record_property):
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = 0.5 * limit_of(Coulomb(0.5), blocks.dim)
    slide = blocks.spring(k)
    blocks.step(k, slide)
    blocks.contact.advance()
    gradient = np.eye(blocks.dim) + blocks.problem.gradient()
    rng = np.random.default_rng(7)
    part = turn(blocks.dim, np.deg2rad(60.0 / steps), rng)
    Q = np.eye(blocks.dim)
    for i in range(steps):
        Q = part @ Q
        u = blocks.drive(k, slide, Q)
        turn_guess(blocks.problem, part)
        perturb(blocks.problem, i)
        blocks.problem.solve()
        assert blocks.statuses() == {STICK}
        assert worst(blocks.contact.points()["slip"]) <= 1e-10
        blocks.contact.advance()
    t = -Q @ nominal(blocks.dim, k)[:, -1]
    p = blocks.contact.points()
    turned = np.eye(blocks.dim) + blocks.problem.gradient()
    C, C_0 = (np.einsum("...ki,...kj", F, F) for F in (turned, gradient))
    figures = [
        worst(p["traction"][p["status"] == STICK] - t) / np.linalg.norm(t),
        worst(C - C_0),
        worst(blocks.problem.u.x.array - u.ravel()),
    ]
    record_property("rotation", figures)
    assert figures[0] <= 1e-7 and figures[1] <= 1e-8 and figures[2] <= 1e-8
    assert np.abs(energy(turned) - energy(gradient)).max() <= 1e-8 * energy(
        gradient
    ).max(initial=0.0)


def energy(F):
    """Strain energy density."""
    mu, lmbda = lame(E, NU)
    log = np.log(np.linalg.det(F))
    I_1 = np.einsum("...ij,...ij", F, F)
    return mu / 2 * (I_1 - F.shape[-1] - 2 * log) + lmbda / 2 * log**2


def clamped(cell, method, friction, degree=1):
    """A block pressed on a foundation, not homogeneous: both ends clamped.

    Returns the problem and a function that moves its top, turned by Q.
    """
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(3,) * (dim - 1) + (2,),
        upper_divisions=2,
        lower_size=(1.4,) * (dim - 1) + (0.6,),
        upper_size=0.7,
    )
    ends = {}

    def conditions(V, scene):
        for name in ("bottom", "top"):
            facets = scene.facet_tags.find(scene.tags[name])
            dofs = fem.locate_dofs_topological(V, dim - 1, facets)
            ends[name] = fem.Function(V), dofs
        return [fem.dirichletbc(*end) for end in ends.values()]

    problem = build(
        scene,
        degree,
        "neo-hookean",
        method,
        E=E,
        nu=NU,
        bcs=conditions,
        friction=friction,
    )
    X = states.dof_positions(problem.u.function_space)

    def move(top, Q=None):
        Q = np.eye(dim) if Q is None else Q
        for name, shift in (("bottom", np.zeros(dim)), ("top", np.asarray(top))):
            ends[name][0].x.array[:] = ((X + shift) @ Q.T - X).ravel()

    return problem, move


def pressed_and_sheared(cell, method, friction=None, degree=1):
    """Accepted state of `clamped` with partial slip, or nearly."""
    friction = Coulomb(0.5) if friction is None else friction
    problem, move = clamped(cell, method, friction, degree)
    push = np.zeros(DIMENSION[cell])
    for push[-1], push[0] in ((-0.03, 0.0), (-0.06, 0.0), (-0.06, 0.03)):
        move(push)
        problem.solve()
        problem.contact.advance()
    return problem, move, push


@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron", "hexahedron"])
def test_springs_of_a_clamped_pair_turn_with_it(cell, record_property):
    """A state that is not homogeneous: traction in global coordinates would be cut
    to cos 60 degrees, and the strain change by 1e-2."""
    problem, move, push = pressed_and_sheared(cell, Penalty(30.0), Stick())
    contact = problem.contact
    for _ in range(5):  # the springs settle in their space on the facets
        problem.solve()
        contact.advance()
    force = contact.resultant().force
    F = np.eye(problem.dim) + problem.gradient()
    Q = turn(problem.dim, np.deg2rad(60.0), np.random.default_rng(2))
    move(push, Q)
    turn_guess(problem, Q)
    perturb(problem, 1)
    problem.solve()
    turned = np.eye(problem.dim) + problem.gradient()
    C, C_0 = (np.einsum("...ki,...kj", A, A) for A in (turned, F))
    figures = [worst(C - C_0), worst(contact.resultant().force - Q @ force)]
    record_property("springs", figures)
    assert max(figures) <= 1e-6
    assert worst(contact.points()["slip"]) <= 1e-7


# History


@pytest.mark.parametrize("method", METHODS)
def test_failed_step_leaves_the_history(method):
    problem, move, push = pressed_and_sheared("quadrilateral", SOFT[method]())
    contact, before = problem.contact, problem.contact.state()
    push[0] += 0.02
    move(push)
    problem.solver.max_it = 1
    with pytest.raises(ConvergenceError):
        problem.solve()
    after = contact.state()
    np.testing.assert_array_equal(after.u_old, before.u_old)
    for one, two in zip(after.traction_old, before.traction_old):
        np.testing.assert_array_equal(one, two)


def run(problem, move, push, shears):
    """Solve and accept; unknowns and contact force at the end."""
    for push[0] in shears:
        move(push)
        problem.solve()
        problem.contact.advance()
    contact = problem.contact
    lam = contact.multiplier
    return [
        problem.u.x.array.copy(),
        contact.points()["traction"],
        np.zeros(1) if lam is None else lam.x.array.copy(),
    ]


@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
@pytest.mark.parametrize("method", METHODS)
def test_restored_state_gives_the_same_path(cell, method):
    problem, move, push = pressed_and_sheared(cell, SOFT[method]())
    state, shears = problem.contact.state(), (0.035, 0.04)
    first = run(problem, move, push, shears)
    run(problem, move, push, (0.02, 0.0))
    problem.contact.restore(state)
    for one, two in zip(first, run(problem, move, push, shears)):
        assert worst(one - two) <= 1e-12 * max(worst(one), 1.0)


@pytest.mark.parametrize("method", HOLDING)
def test_halved_steps_are_steps_of_that_size(method):
    """A failure within LoadSteps leaves no trace."""
    results = []
    for sabotaged in (True, False):
        problem, move, push = pressed_and_sheared("quadrilateral", SOFT[method]())
        push_0 = push.copy()
        failures = [0.5] if sabotaged else []

        def apply(t):
            move(push_0 + 0.06 * t * np.eye(problem.dim)[0])
            problem.solver.max_it = 25
            if failures and t > failures[0]:
                failures.pop()
                problem.solver.max_it = 1

        if sabotaged:
            steps = LoadSteps(problem.solver, apply, steps=2).run()
            factors = [step.factor for step in steps]
            assert steps[-1].halvings == 1 and len(factors) == 3
        else:
            for t in factors:
                apply(t)
                problem.solve()
                problem.contact.advance()
        results.append((problem.u.x.array.copy(), problem.contact.points()))
    assert worst(results[0][0] - results[1][0]) <= 1e-12
    assert worst(results[0][1]["traction"] - results[1][1]["traction"]) <= 1e-11


# Fields and resultants


def slave_values(blocks, f):
    """Values of a field at its nodes on the slave surface."""
    V = f.function_space
    dofs = np.concatenate([z.result_table.ravel() for z in blocks.contact.zones])
    size = V.dofmap.index_map_bs
    return f.x.array.reshape(-1, size)[np.unique(dofs)]


@pytest.mark.parametrize("method", HOLDING)
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_fields_of_a_uniform_state(cell, method, share):
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = share * limit_of(Coulomb(0.5), blocks.dim)
    slide = 0.03 if share == 1.0 else 0.0
    blocks.step(k, slide + blocks.spring(k))
    contact, e, z = blocks.contact, direction(blocks.dim), up(blocks.dim)
    # On the slave, whose outward normal is -z
    normal, tangential = -pressure(blocks.dim) * z, -SHEAR * k * e
    for part, value in (
        ("normal", normal),
        ("tangential", tangential),
        ("total", normal + tangential),
    ):
        assert worst(slave_values(blocks, contact.traction(part)) - value) <= 1e-9
    slip = (slide + blocks.spring(k)) * e
    assert worst(slave_values(blocks, contact.slip()) - slip) <= 1e-9
    assert worst(slave_values(blocks, contact.status()) - (2 if slide else 1)) == 0.0
    result, area = contact.resultant(), WIDTH ** (blocks.dim - 1)
    assert worst(result.normal - area * normal) <= 1e-9
    assert worst(result.tangential - area * tangential) <= 1e-9
    assert worst(result.force - result.normal - result.tangential) <= 1e-14


def test_open_contact_has_status_zero(cell):
    blocks = Blocks(cell, AugmentedLagrangian(10.0), Coulomb(0.5))
    u = blocks.exact(0.0)
    u[states.upper_dofs(blocks.scene, blocks.problem.u.function_space), -1] += 0.1
    blocks.problem.u.x.array[:] = u.ravel()
    blocks.contact.update()
    assert blocks.statuses() == {OPEN}
    assert worst(blocks.contact.status().x.array) == 0.0
    assert worst(blocks.contact.traction("tangential").x.array) == 0.0


def test_resultant_splits_on_curved_surfaces(cell):
    case = states.Case(cell, 2, 2, "vector", "current")
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "mixed", 1)
    p, result = contact.points(), contact.resultant()
    t_n = np.einsum("qi,qi->q", p["traction"], p["normal"])
    normal = (p["weight"] * t_n) @ p["normal"]
    assert np.abs(result.normal - normal).max() <= 1e-13
    assert np.abs(result.force - result.normal - result.tangential).max() <= 1e-14
    assert np.linalg.norm(result.tangential) > 1e-3


@pytest.mark.parametrize("method", ["normal", "penalty"])
def test_resultant_without_friction_is_normal(cell, method):
    case = states.Case(cell, 2, 2, method)
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "active", 1)
    result = contact.resultant()
    size = np.linalg.norm(result.force)
    assert size > 0.0
    assert np.abs(result.tangential).max() <= 1e-14 * size


# Input errors


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, "0.3", None, [0.3], 1j])
@pytest.mark.parametrize("law", [Coulomb, Tresca])
def test_impossible_coefficients_are_refused(law, value):
    with pytest.raises(ContactError, match="mu|bound"):
        law(value)


@pytest.fixture(scope="module")
def small():
    scene = two_blocks(COMM, 2, "triangle")
    return scene, fem.Function(compat.vector_space(scene.mesh, 1))


def make(small, **options):
    scene, u = small
    pair = (scene.tags["slave"], scene.tags["master"])
    return Contact(u, scene.facet_tags, [pair], **options)


@pytest.mark.parametrize("friction", [0.3, "coulomb", Coulomb, True])
def test_friction_of_another_type_is_refused(small, friction):
    with pytest.raises(ContactError, match="friction must be"):
        make(small, friction=friction)


def test_friction_needs_a_vector_multiplier(small):
    method = AugmentedLagrangian(1.0, multiplier="normal")
    with pytest.raises(ContactError, match="vector"):
        make(small, method=method, friction=Coulomb(0.3))
    method = AugmentedLagrangian(1.0)
    assert make(small, method=method, friction=Coulomb(0.3)).layout.components == 2


def test_unknown_tangential_penalty_is_refused():
    with pytest.raises(ContactError, match="tangential"):
        Penalty(1.0, tangential="viscous")


def test_slip_without_friction_is_refused(small):
    with pytest.raises(ContactError, match="friction"):
        make(small, method=Penalty(1.0)).slip()


def test_unknown_part_of_traction_is_refused(small):
    contact = make(small, method=Penalty(1.0))
    contact.update()
    with pytest.raises(ContactError, match="part"):
        contact.traction(part="shear")
