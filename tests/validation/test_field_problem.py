"""Fluxes where the field is the only unknown: what contact is, is known."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import conduction, field_space, prescribe, press, values_on
from problems import COMM, residual, stack, worst

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    Contact,
    ContactError,
    ContactWarning,
    ConvergenceError,
    Coulomb,
    NonlinearProblem,
    Search,
)
from raymortar.core import compat
from raymortar.core.errors import SetUpError
from raymortar.fluxes import FieldProblem, FieldTie, Flux

CONDUCTIVITY, HOT = {"0": 4.0, "1": 1.0}, 100.0


def of_fields(T_s, T_m, p, g, v, fields):
    return 2.0 * fields[0] ** 0.95 * (T_s - T_m)


def radiation(T_s, T_m, p, g, v):
    return 1e-5 * (T_s**3 - T_m**3)


def of_pressure(T_s, T_m, p, g, v):
    return 3.0 * (p / 0.01) ** 0.95 * (T_s - T_m)


class Slabs:
    def __init__(self, cell="triangle", degree=1, friction=None):
        self.scene = scene = stack(cell, (3, 4))
        V, self.W = compat.vector_space(scene.mesh, 1), field_space(scene.mesh, degree)
        self.u, self.T = fem.Function(V, name="u"), fem.Function(self.W, name="T")
        self.pair = (scene.tags["slave"], scene.tags["master"])
        self.contact = Contact(self.u, scene.facet_tags, [self.pair], friction=friction)
        self.F = conduction(scene, self.T, CONDUCTIVITY)
        ends = {"top": HOT, "bottom": 0.0}
        self.bcs = [prescribe(self.W, scene, *end) for end in ends.items()]

    def solve(self, flux, **options):
        problem = FieldProblem(self.F, self.T, flux, self.bcs, **options)
        problem.solve()
        return problem

    def check(self, q):
        errors = [
            worst(values_on(self.T, self.scene, "slave") - (HOT - q)),
            worst(values_on(self.T, self.scene, "master") - q / 4.0),
        ]
        assert max(errors) <= 1e-11 * HOT, errors


def test_options_that_nothing_reads_are_told():
    case = Slabs()
    flux = Flux(case.contact, case.T, of_fields, fields=[case.T])
    with pytest.warns(ContactWarning, match="read the PETSc option.s. 'ksp_rtoll':"):
        case.solve(flux, petsc_options={"ksp_rtoll": 1e-3})


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_a_known_pressure(cell_2d, degree):
    """57.142857, 42.857143 and 14.285714, by one iteration."""
    case = Slabs(cell_2d, degree)
    pressure = fem.Function(field_space(case.scene.mesh, 1))
    pressure.x.array[:] = 1.0
    flux = Flux(case.contact, case.T, of_fields, fields=[pressure])
    assert case.solve(flux).iterations == 1
    case.check(HOT / 1.75)
    assert abs(flux.rates().through - HOT / 1.75) <= 1e-11 * HOT


@pytest.mark.mpi
def test_radiation_is_solved_quadratically():
    case = Slabs("quadrilateral")
    flux = Flux(case.contact, case.T, radiation)
    problem = case.solve(flux)
    q = flux.rates().through
    assert abs(q - 1e-5 * ((HOT - q) ** 3 - (q / 4.0) ** 3)) <= 1e-10 * HOT
    case.check(q)
    assert problem.iterations <= 6
    assert "FieldProblem for 'T'" in repr(problem)


@pytest.mark.quick
@pytest.mark.mpi
def test_after_a_solve_of_the_displacement():
    """Pressure and heat of friction are those that the solve before has found; together
    they are what one problem of both gives."""
    found = []
    for together in (True, False):
        case = Slabs(friction=Coulomb(0.3))
        V, scene = case.u.function_space, case.scene
        form = residual(scene, case.u, E=1.0, nu=0.0)[0]
        bcs = press(V, scene, 0.02)
        flux = Flux(case.contact, case.T, of_pressure)
        if together:
            both = [case.contact, flux], [*bcs, *case.bcs]
            NonlinearProblem([form, case.F], *both, u=[case.u, case.T]).solve()
        else:
            NonlinearProblem(form, case.contact, bcs).solve()
            case.solve(flux)
        case.check(HOT / (1.25 + 1.0 / 3.0))
        found.append(flux.rates())
    assert abs(found[0].through / found[1].through - 1.0) <= 1e-10


def test_what_cannot_work_is_refused():
    case = Slabs()
    flux = Flux(case.contact, case.T, radiation)
    F, T, tags = case.F, case.T, case.scene.facet_tags
    for arguments, message in (
        ((F, T, case.contact), "terms must be a Flux, a FieldTie or a list"),
        ((F, T, []), "terms must be a Flux"),
        ((F, T, [flux, flux]), "in the list twice"),
        ((F, 3.0, flux), "u must be a Function"),
        ((F, fem.Function(case.W), flux), "the field T that Flux was given is none"),
    ):
        with pytest.raises(ContactError, match=message):
            FieldProblem(*arguments)
    with pytest.raises(ConvergenceError, match="not converged after 1 iterations"):
        case.solve(flux, petsc_options={"snes_max_it": 1})
    for given, message in (
        (3.0, "FieldTie.T must be a Function, not float"),
        (fem.Function(compat.space(case.scene.mesh, "DG", 1)), "a continuous Lagrange"),
        (fem.Function(field_space(case.scene.mesh, 3)), "degree 3; supported"),
    ):
        with pytest.raises(ContactError, match=message):
            FieldTie(given, tags, [case.pair])
    tie = FieldTie(T, tags, [case.pair])
    with pytest.raises(ContactError, match="is in no problem"):
        tie.rate()
    everywhere = fem.dirichletbc(
        fem.Function(case.W), np.arange(len(T.x.array), dtype=np.int32)
    )
    with pytest.raises(SetUpError, match="prescribed on all slave nodes"):
        FieldProblem(F, T, tie, [everywhere]).solve()


def cylinders(**options):
    """A heated core, a gap of a tenth of its radius with conduction and radiation, and a
    cooled vessel: MOOSE's large_gap_heat_transfer_test_rz_cylinder."""
    core, inner, outer = 1, 2, 3
    blocks = [
        Block((80, 1), (0.0, 0.0), (2.0, 1.0), tags={"right": core}, body="core"),
        Block((40, 1), (2.2, 0.0), (2.7, 1.0), tags={"left": inner, "right": outer}),
    ]
    mesh, _, tags = assemble_blocks(COMM, blocks, "quadrilateral")
    u = fem.Function(compat.vector_space(mesh, 1))
    T = fem.Function(compat.scalar_space(mesh, 1))
    T.x.array[:] = 500.0
    s, r = ufl.TestFunction(T.function_space), ufl.SpatialCoordinate(mesh)[0]
    turn, at = 2.0 * ufl.pi * r, ufl.Measure("ds", mesh, subdomain_data=tags)
    source = ufl.conditional(ufl.lt(r, 2.1), 50e3, 0.0)
    F = 34.6 * ufl.inner(ufl.grad(T), ufl.grad(s)) * turn * ufl.dx
    F += 10.0 * (T - 300.0) * s * turn * at(outer) - source * s * turn * ufl.dx
    contact = Contact(
        u, tags, [(inner, core)], axisymmetric=True, search=Search(reach=0.5)
    )
    flux = Flux(contact, T, gap_of_cylinders)
    problem = FieldProblem(F, T, flux, [], **options)
    return problem, T


def gap_of_cylinders(T_s, T_m, p, g, v, x):
    r_s, r_m = x[0], x[0] - g
    share = 1.0 / (1.0 / 0.8 + r_m / r_s * (1.0 / 0.8 - 1.0)) * r_m / r_s
    by_conduction = 0.1 / (r_s * np.log(r_s / r_m)) * (T_s - T_m)
    return by_conduction + 5.670367e-8 * share * (T_s**4 - T_m**4)


@pytest.mark.mpi
def test_radiation_takes_full_steps_however_residuals_grow():
    """By PETSc's own divergence tolerance it would end after one iteration."""
    problem, T = cylinders()
    problem.solve()
    assert problem.iterations <= 7
    x = T.function_space.tabulate_dof_coordinates()
    for r, expected in ((2.0, 4598.9464), (2.2, 4595.5949), (2.7, 4003.7037)):
        found = T.x.array[np.isclose(x[:, 0], r)]
        np.testing.assert_allclose(found, expected, atol=0.05)


@pytest.mark.parametrize(
    "options, words",
    [
        (
            {"snes_max_it": 3},
            r"largest number of iterations was reached\), .*snes_max_it",
        ),
        (
            {"snes_divergence_tolerance": 1e4},
            r"divergence tolerance\), .*as it is by default",
        ),
    ],
)
def test_a_failure_names_its_reason_and_a_remedy(options, words):
    problem, _ = cylinders(petsc_options=options)
    with pytest.raises(ConvergenceError, match=words):
        problem.solve()
