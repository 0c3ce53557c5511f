"""Heat that flows through contact: problems with a displacement and a temperature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import gathered
import numpy as np
import states
import ufl
from dolfinx import fem
from problems import COMM, cellwise, fix, residual
from tangents import FIRST_STEPS, SEEDS, Topology, all_hit_their_own, slopes

from raymortar import Contact, NonlinearProblem
from raymortar.core import compat
from raymortar.fluxes import Flux


@dataclass
class Heated:
    """A problem of displacement and temperature, in this order."""

    scene: Any
    u: Any
    T: Any
    contact: Any
    flux: Any
    problem: Any


def field_space(mesh, degree):
    """Space of scalar fields."""
    return compat.scalar_space(mesh, degree)


def prescribe(V, scene, name, value):
    """Dirichlet condition of a scalar field on the facets with a tag."""
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim - 1, facets)
    return fem.dirichletbc(fem.Constant(scene.mesh, float(value)), dofs, V)


def conduction(scene, T, conductivity, source=0.0, weight=1.0):
    """Residual of Fourier's law, with conductivities by body."""
    k, s = cellwise(scene, conductivity), ufl.TestFunction(T.function_space)
    return weight * (ufl.inner(k * ufl.grad(T), ufl.grad(s)) - source * s) * ufl.dx


def heated(
    scene, law, bcs, degree=1, field_degree=1, conductivity=1.0, E=1.0, **options
):
    """Two bodies, pressed and heated by conditions (V, W, scene) to a list.

    Options are those of `Contact`, and of `Flux` under ``flux``.
    """
    of_flux = options.pop("flux", {})
    pairs = options.pop("pairs", [(scene.tags["slave"], scene.tags["master"])])
    V = compat.vector_space(scene.mesh, degree)
    W = field_space(scene.mesh, field_degree)
    u, T = fem.Function(V, name="u"), fem.Function(W, name="T")
    F, _, _ = residual(scene, u, E=E, nu=0.0)
    contact = Contact(u, scene.facet_tags, pairs, **options)
    flux = Flux(contact, T, law, **of_flux)
    forms = [F, conduction(scene, T, conductivity)]
    problem = NonlinearProblem(forms, [contact, flux], bcs(V, W, scene), u=[u, T])
    return Heated(scene, u, T, contact, flux, problem)


# Slabs that are pressed onto each other

CONDUCTIVITY = {"0": 4.0, "1": 1.0}
DEPTH = 0.02  # of a nominal pressure of DEPTH / 2: modulus 1, height 2, nu = 0


def constant(T_s, T_m, p, g, v):
    return 2.0 * (T_s - T_m)


def of_pressure(T_s, T_m, p, g, v):
    return 3.0 * (p / 0.01) ** 0.95 * (T_s - T_m)


def elastic(u):
    """Hooke's law with modulus 1 and without lateral strain."""
    v = ufl.TestFunction(u.function_space)
    return ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx


# Tangents


def law_of_all(T_s, T_m, p, g, v, x, slip, dt, fields):
    """A smooth flux of everything that a law is given."""
    (field,) = fields
    return (
        (field + 0.3 * p * p + 0.2 * v + 4.0 * g * g + slip) * (T_s - T_m)
        + 0.1 * T_s * T_m * T_m
        + 0.2 * p * v * np.sin(3.0 * x[0] + x[1])
    ) / dt


def massive(contact, law=law_of_all, field_degree=1, **options):
    """A problem of contact and flux with the cheapest forms."""
    u = contact.u
    W = field_space(u.function_space.mesh, field_degree)
    T, more = fem.Function(W, name="T"), fem.Function(W)
    more.interpolate(lambda x: 1.0 + x[0] * x[0])
    flux = Flux(contact, T, law, fields=[more], **options)
    dx = ufl.dx(metadata={"quadrature_degree": 1})
    forms = [ufl.inner(f, ufl.TestFunction(f.function_space)) * dx for f in (u, T)]
    problem = NonlinearProblem(forms, [contact, flux], u=[u, T])
    return Heated(None, u, T, contact, flux, problem)


def set_temperature(T, seed):
    """A random smooth temperature."""
    rng, x = np.random.default_rng(seed), states.dof_positions(T.function_space)
    T.x.array[:] = 1.0 + states.smooth_field(rng, x, 0.5)[:, 0]


def field_rows(case, x):
    """Part of a vector of unknowns that belongs to the temperature, and to the tools'."""
    starts = case.contact.unknowns.owned_starts
    return x.array[starts[1] : starts[-1]]


def is_smooth(begin, now):
    """Whether no pressure, and no slip, passes zero between points of a flux: the law
    has a kink there, which the statuses of contact do not tell."""
    pressed = np.array_equal(begin["p"] > 0.0, now["p"] > 0.0)
    return pressed and bool(np.all(now["v"] >= 0.5 * begin["v"]))


def remainders(case, seed, first_steps=FIRST_STEPS[2:]):
    """Steps and Taylor remainders of the temperature's rows, with the topology held and
    no kink of pressure or slip; None where they are not. Displacement, multiplier and
    temperature vary together."""
    problem, contact = case.problem, case.contact
    x = problem.start()
    A, b = problem.create_matrix(), problem.create_vector()
    problem.F(x, b)
    problem.J(x, A)
    base = field_rows(case, b).copy()
    direction, change = x.duplicate(), x.duplicate()
    n = x.getSize()
    values = np.random.default_rng(seed + 1000).normal(size=n)
    direction.array[:] = values[slice(*x.getOwnershipRange())]
    A.mult(direction, change)
    slope = field_rows(case, change).copy()
    topology, at = Topology(contact), x.duplicate()
    begin = case.flux.points()
    for first in first_steps:
        steps = first * 10.0 ** -np.arange(0.0, 2.6, 0.5)
        found = []
        for e in steps:
            at.array[:] = x.array + e * direction.array
            problem.F(at, b)
            if not topology.holds(contact):
                break
            if not COMM.allreduce(is_smooth(begin, case.flux.points()), op=MPI.LAND):
                break
            error = field_rows(case, b) - base - e * slope
            found.append(np.sqrt(COMM.allreduce(error @ error)))
        problem.form(x)
        if len(found) == len(steps):
            return steps, np.array(found)
    return None


def field_slopes(make, prepare, heat=massive, wanted=all_hit_their_own):
    """Slopes of the Taylor remainders of a flux, at a state with no kink nearby.

    `make` takes a seed to a contact or None, `prepare` sets its state, `heat` makes the
    problem with a flux.
    """
    for seed in SEEDS:
        contact = make(seed)
        if contact is None or not prepare(contact, seed) or not wanted(contact):
            continue
        case = heat(contact)
        set_temperature(case.T, seed)
        found = remainders(case, seed)
        if found is not None:
            return slopes(*found)
    raise AssertionError("no random state without a kink nearby")


def press(V, scene, depth):
    """The lowest side held, the uppermost one moved down."""
    last = scene.mesh.geometry.dim - 1
    sides = [fix(V, scene, "bottom", i) for i in range(last + 1)]
    return [*sides, fix(V, scene, "top", last, -depth)] + [
        fix(V, scene, "top", i) for i in range(last)
    ]


def values_on(f, scene, name):
    """Values of a scalar field at the nodes of the facets with a tag, of all ranks."""
    V, dim = f.function_space, scene.mesh.topology.dim
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    return gathered.concatenated(f.x.array[dofs])
