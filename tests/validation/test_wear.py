"""Archard's wear: worn volumes and falling pressures (V5)."""

from __future__ import annotations

import warnings

from petsc4py import PETSc

import gathered
import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import CELLS, fix, stack, worst
from worn import Pressed

import raymortar
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    rigid,
)
from raymortar.core import compat
from raymortar.fluxes import Archard, Wear

DUAL = AugmentedLagrangian(condition="nodes", multiplier="dual")
K, PUSH, SLIDE = 0.3, 0.05, 0.02  # a slab of modulus 1 and height 1


class Worn:
    """The lower slab of two on a rigid flat that moves below it, pushed from above."""

    def __init__(self, cell="triangle", degree=1, friction=None, method=None):
        self.scene = scene = stack(cell, (3, 2))
        self.dim = dim = scene.mesh.geometry.dim
        V = compat.vector_space(scene.mesh, degree)
        self.u, v = fem.Function(V, name="u"), ufl.TestFunction(V)
        flat = rigid.Line if dim == 2 else rigid.Plane
        self.tool = rigid.Body(flat((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,)))
        self.contact = Contact(
            self.u,
            scene.facet_tags,
            [(scene.tags["bottom"], self.tool)],
            method,
            friction=friction,
        )
        F = ufl.inner(ufl.sym(ufl.grad(self.u)), ufl.grad(v)) * ufl.dx
        bcs = [fix(V, scene, "slave"), fix(V, scene, "top")]
        bcs += [fix(V, scene, "master", i) for i in range(dim - 1)]
        self.push = fem.Constant(scene.mesh, 0.0)
        bcs.append(fix(V, scene, "master", dim - 1, self.push))
        self.problem = NonlinearProblem(F, self.contact, bcs)
        self.push.value = -PUSH
        self.problem.solve()
        self.contact.advance()

    def slide(self, wear, steps):
        """Slide in steps of the same length; the pressure of each."""

        def apply(t):
            self.tool.move((SLIDE * steps * t, *(0.0,) * (self.dim - 1)))

        pressures = []
        for _ in LoadSteps(
            self.problem.snes_solver, apply, steps, on_accept=wear.accept
        ):
            pressures.append(self.contact.resultant().force[-1])
        return np.array(pressures)


@pytest.mark.mpi(where=lambda cell, **_: cell in ("triangle", "hexahedron"))
@pytest.mark.parametrize(
    "cell, degree",
    [*((cell, 1) for cell in CELLS), ("triangle", 2), ("tetrahedron", 2)],
)
@pytest.mark.parametrize("method", [None, DUAL], ids=["points", "dual"])
def test_pressure_falls_as_the_slab_wears(cell, degree, method):
    """p_n = E (push - depth_n) / H and depth_(n+1) = depth_n + k p_n slide."""
    case = Worn(cell, degree, method=method)
    wear = Wear(case.contact, Archard(K))
    pressures = case.slide(wear, 4)
    depth = 0.0
    for p in pressures:
        assert abs(p / (PUSH - depth) - 1.0) <= 1e-10
        depth += K * (PUSH - depth) * SLIDE
    assert abs(wear.volume() / depth - 1.0) <= 1e-10
    assert abs(wear.step / (K * pressures[-1] * SLIDE) - 1.0) <= 1e-10
    worn = wear.depth.x.array[wear.depth.x.array > 0.0]
    assert worst(worn / depth - 1.0) <= 1e-10


@pytest.mark.mpi
@pytest.mark.parametrize("method", [None, DUAL], ids=["points", "dual"])
@pytest.mark.parametrize("degree", [1, 2])
def test_worn_volume_is_k_times_force_times_slide(degree, method, record_property):
    """With friction pressures are not uniform, and the slab shears until all slips."""
    case, k, steps = Worn("triangle", degree, Coulomb(0.3), method), 1e-9, 8
    wear, expected, volumes = Wear(case.contact, Archard(k)), [], []

    def accept():
        p = gathered.points(case.contact)
        pressure = -np.einsum("qi,qi->q", p["traction"], p["contact_normal"])
        slip = np.linalg.norm(p["slip"], axis=1)
        expected.append(k * float(p["weight"] @ (np.maximum(pressure, 0.0) * slip)))
        wear.accept()
        volumes.append(wear.volume())

    def apply(t):
        case.tool.move((SLIDE * steps * t, 0.0))

    for _ in LoadSteps(case.problem.snes_solver, apply, steps, on_accept=accept):
        force = case.contact.resultant().force[1]
    assert abs(volumes[-1] / sum(expected) - 1.0) <= 1e-12
    error = abs((volumes[-1] - volumes[-2]) / (k * force * SLIDE) - 1.0)
    record_property("error", error)
    assert error <= 1e-6


def test_laws_and_steps_that_are_too_large():
    case = Worn()
    contact = case.contact
    with pytest.raises(ContactError, match="Archard.k = -1.0"):
        Archard(-1.0)
    with pytest.raises(ContactError, match="must be a Contact, not int"):
        Wear(3, Archard(K))
    with pytest.raises(ContactError, match="must be Archard or a function"):
        Wear(contact, 3.0)
    with pytest.raises(ContactError, match="Wear.largest = -1.0"):
        Wear(contact, Archard(K), largest=-1.0)
    for law, message in (
        (lambda p, v: np.ones(1), r"shape \(1,\)"),
        (lambda p, v: -np.ones(len(p)), "negative or not finite"),
    ):
        with pytest.raises(ContactError, match=message):
            Wear(contact, law).accept()
    with pytest.warns(raymortar.ContactWarning, match="take smaller steps"):
        case.slide(Wear(contact, Archard(K), largest=1e-6), 1)
    with pytest.raises(ContactError, match="has an offset"):
        Wear(contact, Archard(K))
    with pytest.raises(ContactError, match=r"it must take 2 arguments, p and v"):
        Wear(Worn().contact, lambda p: p)
    pair = (case.scene.tags["slave"], case.scene.tags["master"])
    tie = raymortar.Tie(case.u, case.scene.facet_tags, [pair])
    with pytest.raises(ContactError, match="is a Tie"):
        Wear(tie, Archard(K))


@pytest.mark.quick
def test_a_wear_that_accepts_no_step_is_told_once():
    case = Worn()
    wear = Wear(case.contact, Archard(K))
    for told in (1, 0):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always", raymortar.ContactWarning)
            LoadSteps(case.problem.snes_solver, lambda t: None, 1).run()
        assert sum("has accepted no step" in str(one.message) for one in found) == told
    assert wear.volume() == 0.0
    fresh = stack("triangle", (1, 1))
    u = fem.Function(compat.vector_space(fresh.mesh, 1), name="u")
    contact = Contact(
        u, fresh.facet_tags, [(fresh.tags["slave"], fresh.tags["master"])]
    )
    with pytest.raises(ContactError, match="before a step was accepted"):
        Wear(contact, Archard(K)).accept()


@pytest.mark.quick
@pytest.mark.parametrize("implicit", [False, True])
def test_the_offset_belongs_to_one_wear(implicit):
    for spoil in (
        lambda case: case.contact.set_offset(-1e-3),
        lambda case: case.slide(Wear(case.contact, Archard(K)), 1),
    ):
        case = Worn()
        wear = Wear(case.contact, Archard(K), implicit=implicit)
        with pytest.raises(ContactError, match="set by something else"):
            spoil(case)
            case.slide(wear, 1)


@pytest.mark.quick
def test_a_second_wear_is_refused_when_it_is_made():
    case = Worn()
    wear = Wear(case.contact, Archard(K))
    with pytest.raises(ContactError, match="Wear.contact is set .* already, a Wear"):
        Wear(case.contact, Archard(K))
    case.slide(wear, 1)
    assert wear.volume() > 0.0


@pytest.mark.quick
def test_a_step_wears_once():
    case = Worn()
    wear = Wear(case.contact, Archard(K))
    case.slide(wear, 2)
    depth = wear.volume()
    with pytest.raises(ContactError, match="called for this step already"):
        wear.accept()
    assert wear.volume() == depth


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("k", [0.3, 30.0, 3e3])
@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("hexahedron", 1)])
def test_implicit_steps_of_any_size(cell, degree, k):
    """p_n = E (push - depth_n) / H at the end of each step, by a factor of up to 60."""
    case = Worn(cell, degree)
    wear = Wear(case.contact, Archard(k), implicit=True)
    depth = 0.0
    for p in case.slide(wear, 3):
        depth = (depth + k * SLIDE * PUSH) / (1.0 + k * SLIDE)
        assert abs(p / (PUSH - depth) - 1.0) <= 1e-6 * (1.0 + k * SLIDE)
    assert abs(wear.volume() / depth - 1.0) <= 1e-7


@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("is_paired", [False, True])
def test_a_worn_surface_at_the_start_acts_in_the_first_step(cell, implicit, is_paired):
    """As the same offset does, also where values are set after an update."""
    forces = []
    for worn in (True, False):
        case = Worn(cell, friction=Coulomb(0.3))
        if worn:
            wear = Wear(case.contact, Archard(1e-12), implicit=implicit)
            if is_paired:
                case.contact.update()
            wear.depth.x.array[:] = 0.4 * PUSH
        else:
            case.contact.set_offset(0.4 * PUSH)
        case.problem.solve()
        forces.append(case.contact.resultant().force[-1])
    assert abs(forces[0] / forces[1] - 1.0) <= (1e-9 if implicit else 1e-12)
    assert abs(forces[1] / (0.6 * PUSH) - 1.0) <= 0.1


@pytest.mark.parametrize("implicit", [False, True])
def test_a_depth_goes_back_with_its_contact(implicit):
    case = Worn(friction=Coulomb(0.3))
    wear = Wear(case.contact, Archard(5.0), implicit=implicit)
    case.slide(wear, 2)
    state, force = case.contact.state(), case.contact.resultant().force
    depth = wear.depth.x.array.copy()
    found = [case.slide(wear, 2)]
    assert worst(wear.depth.x.array - depth) > 0.0
    case.tool.move((2 * SLIDE, 0.0))
    case.contact.restore(state)
    assert np.array_equal(wear.depth.x.array, depth)
    case.contact.update()
    np.testing.assert_allclose(case.contact.resultant().force, force, rtol=1e-12)
    found.append(case.slide(wear, 2))
    np.testing.assert_allclose(*found, rtol=1e-10)


def uneven(implicit, k, steps=6, degree=1):
    """Differences of depth over a slab that starts with a rough surface, by step."""
    case = Worn("triangle", degree)
    wear = Wear(case.contact, Archard(k), implicit=implicit)
    y = wear.depth.function_space.tabulate_dof_coordinates()[:, 1]
    on = np.flatnonzero(np.abs(y) < 1e-12)
    wear.depth.x.array[on] = 1e-4 * np.cos(np.pi * np.arange(len(on)))
    found = [np.ptp(wear.depth.x.array[on])]

    def accept():
        wear.accept()
        found.append(np.ptp(wear.depth.x.array[on]))

    def apply(t):
        case.tool.move((SLIDE * steps * t, 0.0))

    for _ in LoadSteps(case.problem.snes_solver, apply, steps, on_accept=accept):
        pass
    return np.array(found)


def test_explicit_steps_have_a_limit_and_implicit_ones_none():
    """Rough surfaces wear smooth, but by explicit steps beyond the limit."""
    assert (np.diff(uneven(False, 5.0)) < 0.0).all()
    with pytest.warns(raymortar.ContactWarning, match="as deep as explicit steps may"):
        rough = uneven(False, 30.0)
    assert rough[1] > 1.5 * rough[0]
    smooth = uneven(True, 30.0)
    assert (np.diff(smooth) < 0.0).all()
    assert smooth[-1] < 0.1 * smooth[0]


@pytest.mark.mpi
def test_implicit_wear_with_friction_is_the_law_of_the_end():
    """A pin that tilts: depth of the step = k p slip of the state that was found."""
    case = Worn("triangle", 1, Coulomb(0.3))
    wear = Wear(case.contact, Archard(5.0), implicit=True)
    lacks = []

    def accept():
        found = wear._depths()[0]
        lacks.append(worst(found - wear.array) / worst(found))
        wear.accept()

    def apply(t):
        case.tool.move((4.0 * SLIDE * t, 0.0))

    for _ in LoadSteps(case.problem.snes_solver, apply, 4, on_accept=accept):
        pass
    assert max(lacks) <= 1e-6, lacks


def test_implicit_wear_needs_solves_that_are_repeated():
    """By a loop of the user's own it would wear nothing."""
    case = Pressed()
    wear, problem = Wear(case.contact, Archard(1e-3), implicit=True), case.problem
    case.press(1.0)
    problem.solve()
    case.contact.advance()
    wear.accept()
    case.slide(1.0)
    A, x = problem.create_matrix(), problem.start()
    b, change = x.duplicate(), x.duplicate()
    ksp = PETSc.KSP().create(problem.comm)
    ksp.setType("preonly"), ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    for _ in range(4):
        problem.F(x, b)
        problem.J(x, A)
        ksp.setOperators(A)
        ksp.solve(b, change)
        x.axpy(-1.0, change)
    problem.F(x, b)
    case.contact.advance()
    with pytest.raises(ContactError, match="solvers of raymortar alone do"):
        wear.accept()
