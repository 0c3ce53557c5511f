"""Prescribed slaves that are finer than their masters: contact is solved with the sides
exchanged, and forces keep the names that the user gave these."""

import warnings

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Checkpoint,
    ContactError,
    ContactWarning,
    Coulomb,
    History,
    LoadSteps,
    NewtonSolver,
    compat,
)

pytestmark = pytest.mark.quick
GIVEN, OTHER = ("lid", "bed"), ("bed", "lid")
# Of a program with the sides in the other order, relative
SAME = 1e-10
PUSH, DRAG = 0.06, 0.02


class Press:
    """A rigid lid over a soft bed, both one wide, with numbers of facets along x.

    The lid comes down on the bed from a gap, and moves along it.
    """

    def __init__(self, cell, bed, lid, degree=1, gap=0.01, material="neo-hookean"):
        self.dim = DIMENSION[cell]
        size = (1.0,) * self.dim
        self.scene = scene = two_blocks(
            COMM, self.dim, cell, bed, lid, lower_size=size, upper_size=size, gap=gap
        )
        self.names = {"lid": scene.tags["slave"], "bed": scene.tags["master"]}
        self.u = fem.Function(compat.vector_space(scene.mesh, degree), name="u")
        self.form, *_ = residual(scene, self.u, material, 10.0)
        self.moved = fem.Constant(scene.mesh, np.zeros(self.dim))
        V, dim = self.u.function_space, scene.mesh.topology.dim
        cells = scene.cell_tags.find(scene.bodies["upper"])
        dofs = fem.locate_dofs_topological(V, dim, cells)
        self.lid = [fem.dirichletbc(self.moved, dofs, V)]
        self.bcs = [fix(V, scene, "bottom"), *self.lid]

    def contact(self, *pairs, **options):
        tags = self.scene.facet_tags
        return raymortar.Contact(self.u, tags, list(pairs), names=self.names, **options)

    def problem(self, contact, bcs=None):
        bcs = self.bcs if bcs is None else bcs
        return raymortar.NonlinearProblem(self.form, contact, bcs)

    def move(self, t):
        self.moved.value[0] = t * DRAG
        self.moved.value[-1] = -t * (PUSH + 0.01)

    def solve(self, contact, **options):
        """The problem after three load steps, and how many tangents they took."""
        problem = self.problem(contact)
        solver = NewtonSolver(problem)
        for _ in LoadSteps(solver, self.move, 3, progress=False, **options):
            pass
        return problem


def quietly(function, *args, **options):
    """Result of a call that may tell of exchanged sides."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "all of slave", ContactWarning)
        return function(*args, **options)


def assert_same(found, expected):
    """Equal to rounding in proportion to the largest entry."""
    size = max(np.abs(expected).max(initial=0.0), 1e-3)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=SAME * size)


def both(cell, bed, lid, degree=1, **options):
    """Contacts and presses of the user's order and of the other one, solved."""
    found = []
    for order in (GIVEN, OTHER):
        press = Press(cell, bed, lid, degree)
        contact = press.contact(order, **options)
        quietly(press.solve, contact)
        found += [(press, contact)]
    return found


CASES = {
    "quadrilateral": dict(cell="quadrilateral", bed=5, lid=9),
    "friction": dict(cell="triangle", bed=5, lid=9, friction=Coulomb(0.3)),
    "degree 2": dict(cell="quadrilateral", bed=5, lid=9, degree=2),
    "hardly finer": dict(cell="quadrilateral", bed=20, lid=21),
    "nodes": dict(
        cell="triangle",
        bed=5,
        lid=9,
        friction=Coulomb(0.3),
        method=AugmentedLagrangian(condition="nodes", multiplier="dual"),
    ),
    "hexahedra": dict(cell="hexahedron", bed=2, lid=3, friction=Coulomb(0.3)),
    "tetrahedra": dict(cell="tetrahedron", bed=2, lid=4),
}


@pytest.mark.mpi(where=lambda name, **_: name in ("friction", "hexahedra"))
@pytest.mark.parametrize("name", CASES)
def test_forces_are_those_of_the_other_order_by_the_names_given(name):
    """A path that ended or went astray arrives, alike to 1e-10."""
    (press, contact), (swapped, other) = both(**CASES[name])
    assert_same(press.u.x.array, swapped.u.x.array)
    (own,), (theirs,) = contact.resultants(), other.resultants()
    each = [contact.resultant(*GIVEN), contact.resultant("lid"), contact.resultant()]
    for found in (own, *each, contact.meetings()[0].resultant):
        for part in ("force", "moment", "normal", "tangential"):
            assert_same(getattr(found, part), -getattr(theirs, part))
    assert own.force[-1] > 0.0  # on the lid, from below
    met = contact.meetings()[0]
    assert (met.one, met.other) == GIVEN
    # Fields and points are on the bed
    for field in ("gap", "pressure", "status", "coverage"):
        found, expected = (getattr(c, field)().x.array for c in (contact, other))
        assert_same(np.nan_to_num(found), np.nan_to_num(expected))
    points, expected = contact.points(*GIVEN), other.points(*OTHER)
    for key in ("x", "traction", "weight", "pair"):
        assert_same(points[key], expected[key])


@pytest.mark.mpi
def test_forces_balance_with_supports():
    press = Press("triangle", 5, 9)
    contact = press.contact(GIVEN, friction=Coulomb(0.3))
    problem = quietly(press.solve, contact)
    held = problem.reactions({"lid": press.lid})["lid"]
    assert_same(contact.resultant("lid", "bed").force, -held)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_uniform_stress_is_exact(cell):
    press = Press(cell, 2, 3, gap=0.0, material="linear")
    V, scene = press.u.function_space, press.scene
    bcs = [fix(V, scene, "bottom", press.dim - 1), *press.lid]
    for k, sides in enumerate((("left", "right"), ("front", "back"))[: press.dim - 1]):
        bcs += [fix(V, scene, f"lower_{side}", k) for side in sides]
    contact = press.contact(GIVEN)
    problem = press.problem(contact, bcs)
    press.moved.value[-1] = -1e-3
    quietly(lambda: NewtonSolver(problem).solve())
    p = contact.pressure().x.array
    p = p[contact.coverage().x.array > 0.0]
    assert COMM.allreduce(len(p)) and np.ptp(p) <= SAME * p.max()


@pytest.mark.mpi
def test_it_is_told_once():
    press = Press("quadrilateral", 4, 8)
    contact = press.contact(GIVEN)
    problem = press.problem(contact)
    with pytest.warns(ContactWarning, match="all of slave 'lid' is prescribed") as told:
        NewtonSolver(problem)
    (text,) = (str(one.message) for one in told)
    assert "solved as by pairs=[('bed', 'lid')], with points and fields on" in text
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        NewtonSolver(problem)
    (pair,) = contact.pairs
    assert pair.is_exchanged and (pair.slave_name, pair.master_name) == GIVEN
    assert "('lid', 'bed')" in repr(contact)


@pytest.mark.mpi
def test_records_have_the_names_given(tmp_path):
    found = []
    for order in (GIVEN, OTHER):
        press = Press("quadrilateral", 4, 8)
        contact = press.contact(order, friction=Coulomb(0.3))
        problem = press.problem(contact)
        solver = quietly(NewtonSolver, problem)
        history = History(problem, patches=True, axes={"z": (0.0, 0.0)})
        for _ in LoadSteps(solver, press.move, 2, history=history, progress=False):
            pass
        found.append(history)
    own, other = found
    for kind in ("force", "normal", "tangential"):
        for x in "xy":
            column = own[f"{kind}_lid_bed_{x}"]
            assert_same(column, -other[f"{kind}_bed_lid_{x}"])
    assert_same(own["torque_z_lid_bed"], -other["torque_z_bed_lid"])
    for kind in ("area", "max_pressure"):
        assert_same(own[f"{kind}_lid_bed"], other[f"{kind}_bed_lid"])
    assert_same(own["friction_work"], other["friction_work"])


def test_a_checkpoint_goes_on(tmp_path):
    forces = []
    for parts in ([(0.0, 1.0, 4)], [(0.0, 0.5, 2), (0.5, 1.0, 2)]):
        for begin, end, steps in parts:
            press = Press("quadrilateral", 4, 8)
            contact = press.contact(GIVEN, friction=Coulomb(0.3))
            problem = press.problem(contact)
            solver = quietly(NewtonSolver, problem)
            file = Checkpoint(problem, tmp_path / f"{len(parts)}.chk")
            if begin:
                assert file.read() == begin
            path = dict(path=(begin, end), progress=False)
            for step in LoadSteps(solver, press.move, steps, **path):
                file.write(step.factor)
        forces.append(contact.resultant("lid", "bed").force)
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-8)


def test_far_apart_the_mean_facets_decide():
    """Not the smallest of a graded master."""
    press = Press("quadrilateral", 4, 9, gap=0.5)
    x = press.scene.mesh.geometry.x
    below = x[:, 1] < 1.25
    x[below, 0] **= 2  # from 0.06 to 0.44 long
    problem = press.problem(press.contact(GIVEN))
    assert problem.contact.pairs[0].is_exchanged


@pytest.mark.mpi
def test_one_of_several_contacts():
    """Each has its rows, and results are numbered as the user's."""
    press = Press("quadrilateral", 4, 8)
    line = raymortar.rigid.Line((0.0, -0.5), (0.0, 1.0))
    facets, side = press.scene.facet_tags, press.scene.tags["bottom"]
    floor = raymortar.Contact(press.u, facets, [(side, line)])
    contact = press.contact(GIVEN)
    held = fix(press.u.function_space, press.scene, "lower_left")
    problem = press.problem([floor, contact], [held, *press.lid])
    assert [pair.is_exchanged for pair in problem.contact.pairs] == [False, True]
    press.move(1.0)
    quietly(lambda: NewtonSolver(problem).solve())
    assert_same(problem.contact.resultant("lid").force, contact.resultant().force)
    assert contact.resultant().force[-1] > 0.0


def test_what_is_set_before_stays():
    press = Press("quadrilateral", 4, 8, gap=0.0)
    contact = press.contact(GIVEN, offset=-0.01)
    contact.set_gamma(7.0)
    contact.dt = 0.5
    press.problem(contact)
    assert contact.pairs[0].is_exchanged
    assert (contact.gamma, contact.offset, contact.dt) == (7.0, -0.01, 0.5)


def test_states_go_to_contacts_with_the_same_sides():
    found = []
    for order in ("problem first", "kept"):
        press = Press("quadrilateral", 4, 8)
        contact = press.contact(GIVEN, friction=Coulomb(0.3))
        if order == "kept":
            contact.keep_sides()
        found.append((press, contact))
    (press, contact), (_, kept) = found
    early = contact.state()
    quietly(press.solve, contact)
    state = contact.state()
    with pytest.raises(
        ContactError, match="with exchanged sides, this one is with sides"
    ):
        kept.restore(state)
    with pytest.raises(
        ContactError, match="with sides as given, this one is with exch"
    ):
        contact.restore(early)
    anew = press.contact(GIVEN, friction=Coulomb(0.3))
    press.problem(anew)
    anew.restore(state)
    anew.update()
    assert_same(anew.resultant("lid").force, contact.resultant("lid").force)


def test_a_restored_state_keeps_sides():
    """Tractions of an older contact, whose slave was free, stay where they are."""
    press = Press("quadrilateral", 4, 8)
    contact = press.contact(GIVEN)
    state = contact.state()
    state["multiplier 0"][:] = 1.0
    contact.restore(state)
    press.problem(contact)
    assert not contact.pairs[0].is_exchanged


def test_condensed():
    forces = []
    for order in (GIVEN, OTHER):
        press = Press("quadrilateral", 4, 8)
        dual = AugmentedLagrangian(condition="nodes", multiplier="dual")
        contact = press.contact(order, method=dual)
        problem = quietly(
            raymortar.CondensedProblem, press.form, press.u, contact, press.bcs
        )
        snes = PETSc.SNES().create(COMM)
        problem.attach(snes)
        snes.getKSP().setType("preonly")
        snes.getKSP().getPC().setType("lu")
        snes.setTolerances(atol=1e-12)
        press.moved.value[-1] = -0.03
        x = problem.create_vector()
        snes.solve(None, x)
        assert snes.getConvergedReason() > 0
        forces.append(contact.resultant("lid" if order == GIVEN else "bed").force)
    assert_same(forces[0], -forces[1])
    assert forces[0][-1] > 0.0


def test_in_time():
    """Impulses are those on the lid."""
    found = []
    for order in (GIVEN, OTHER):
        press = Press("quadrilateral", 4, 8)
        contact = press.contact(order)
        problem = press.problem(contact)
        V = press.u.function_space
        a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
        inertia = raymortar.dynamics.Inertia(ufl.inner(a, v) * ufl.dx, contact)
        history = History(problem)
        steps = raymortar.dynamics.TimeSteps(
            quietly(NewtonSolver, problem),
            inertia,
            press.move,
            end=1.0,
            dt=0.25,
            history=history,
        )
        for _ in steps:
            pass
        found.append((history, press.u.x.array.copy()))
    (own, u), (other, expected) = found
    assert_same(u, expected)
    columns = [name for name in own.columns if name.startswith("impulse")]
    assert len(columns) == 2
    for name in columns:
        assert_same(own[name], -other[name])
    for x in "xy":
        assert_same(own[f"force_lid_bed_{x}"], -other[f"force_bed_lid_{x}"])
    assert own["force_lid_bed_y"][-1] > 0.0


# What keeps sides as they are


def varying(x):
    return 0.1 + 0.0 * x[0]


def update(contact):
    contact.update()


def read(contact):
    return contact.multiplier


def keep(contact):
    contact.keep_sides()


def vary(contact):
    contact.set_offset(varying)


def wear(contact):
    raymortar.Wear(contact, raymortar.Archard(1e-6))


def inertia(contact):
    V = contact.u.function_space
    a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    raymortar.dynamics.Inertia(ufl.inner(a, v) * ufl.dx, contact)


@pytest.mark.parametrize(
    "options",
    [
        dict(friction=Coulomb(varying)),
        dict(friction=raymortar.Friction(lambda p, v: 0.1 * p)),
        dict(offset=varying),
        dict(smooth=lambda x: x),
        dict(frame="slave"),
        dict(before=update),
        dict(before=read),
        dict(before=keep),
        dict(before=vary),
        dict(before=wear),
        dict(before=inertia),
    ],
)
def test_sides_stay_where_something_is_of_the_slave(options):
    press = Press("quadrilateral", 4, 8)
    before = options.pop("before", lambda contact: None)
    contact = press.contact(GIVEN, **options)
    before(contact)
    problem = press.problem(contact)
    assert not contact.pairs[0].is_exchanged
    with pytest.warns(ContactWarning, match="give the sides in the other order"):
        NewtonSolver(problem)


@pytest.mark.mpi
@pytest.mark.parametrize("side", ["master", "lower_left"])
def test_sides_stay_where_a_node_is_in_another_pair(side):
    press = Press("quadrilateral", 4, 8)
    line = raymortar.rigid.Line((-2.0, 0.0), (1.0, 0.0))
    facets = press.scene.facet_tags
    other = raymortar.Contact(press.u, facets, [(press.scene.tags[side], line)])
    contact = press.contact(GIVEN)
    press.problem([contact, other])
    assert not contact.pairs[0].is_exchanged


def test_what_is_of_the_slave_is_refused_once_sides_are_exchanged():
    press = Press("quadrilateral", 4, 8)
    contact = press.contact(GIVEN)
    press.problem(contact)
    gamma = fem.Function(compat.scalar_space(press.scene.mesh, 1))
    for attempt in (
        lambda: wear(contact),
        lambda: contact.set_offset(varying),
        lambda: contact.set_gamma(gamma),
    ):
        with pytest.raises(
            ContactError, match=r"solved as by pairs=\[\('bed', 'lid'\)\]"
        ):
            attempt()
    contact.set_offset(0.01)
    contact.set_gamma(0.1 * contact.gamma)
