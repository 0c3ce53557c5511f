"""Tangents against differences of the residual: Taylor remainders, columns.

A point that meets another facet, opens or slips on the way makes a kink, not an error
of the tangent: states with one nearby are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import gathered
import numpy as np
import states
from problems import COMM

from raymortar.core.discretization.ranks import marked_everywhere

DECADES = 4
DIFFERENCE_STEP = 1e-5
COLUMN_TOLERANCE = 1e-7
MAX_COLUMNS = 40
# Largest steps to try: vertices come closer than facets' sizes
FIRST_STEPS = 10.0 ** np.array([-2.5, -3.0, -3.5, -4.0])
SLOPE_TOLERANCE = 0.05
SEEDS = range(60)


class Branch:
    """What must not change along a smooth branch: hits and statuses of the points."""

    def __init__(self, contact):
        points = gathered.points(contact)
        self.master, self.status = points["master"], points["status"]
        self.nodes = []
        if contact.method.condition == "nodes":
            self.nodes = [zone.cpp.nodes()["status"] for zone in contact.zones]

    def holds(self, contact):
        now = type(self)(contact)
        nodes = all(map(np.array_equal, self.nodes, now.nodes))
        return (
            np.array_equal(self.master, now.master)
            and np.array_equal(self.status, now.status)
            and gathered.everywhere(nodes)
        )


def taylor_remainders(
    contact, K, U, R, direction, steps, branch=Branch, rays_only=True
):
    """||R(U + e d) - R(U) - e K d|| per step; None where a point changes branch."""
    branch, remainders = branch(contact), []
    slope = K @ direction
    for e in steps:
        change = states.residual_at(contact, U + e * direction, rays_only) - R
        if not branch.holds(contact):
            return None
        remainders.append(np.linalg.norm(change - e * slope))
    return np.array(remainders)


def remainders_in_petsc(problem, x, direction, steps):
    """The same of a problem's F and J at a vector x, per step. Collective."""
    A = problem.create_matrix()
    at, slope, change = (problem.create_vector() for _ in range(3))
    problem.F(x, at)
    problem.J(x, A)
    A.mult(direction, slope)
    remainders = []
    for e in steps:
        moved = x.copy()
        moved.axpy(e, direction)
        problem.F(moved, change)
        change.axpy(-1.0, at)
        change.axpy(-e, slope)
        remainders.append(change.norm())
    return np.array(remainders)


def slopes(steps, remainders):
    """Slope fitted over all steps, and that of every decade."""
    x, y = np.log10(steps), np.log10(remainders)
    per_decade = (y[2:] - y[:-2]) / (x[2:] - x[:-2])
    return np.array([np.polyfit(x, y, 1)[0], *per_decade])


def surface_unknowns(contact):
    """Unknowns on the contact surfaces, multipliers included."""
    facets, V = contact.zones[0].facets, contact.u.function_space
    dofs = np.union1d(facets.slave_surface.dofs, facets.master_surface.dofs)
    near = np.repeat(gathered.owned(V, marked_everywhere(V, dofs)), V.mesh.geometry.dim)
    multipliers = COMM.allreduce(contact.layout.size) - len(near)
    return np.flatnonzero(np.append(near, np.ones(multipliers, dtype=bool)))


def check_columns(contact, form, seed=0):
    """Largest error of the tangent's columns, each relative to its largest entry.

    What the rounding of the residual makes of the differences is taken off: it shows
    in dofs that hardly reach into the contact.

    Unknowns off the contact surfaces have zero columns; of the others a random
    selection is compared with central differences.
    """
    contact.update()
    K, U = states.tangent(contact, form), states.unknowns(contact)
    R = states.assembled(contact)
    branch = Branch(contact)
    rng = np.random.default_rng(seed)
    used = surface_unknowns(contact)
    moved = U + 1e-2 * rng.normal(size=U.size)
    moved[used] = U[used]
    gathered.assert_same(states.residual_at(contact, moved), R)
    if len(used) > MAX_COLUMNS:
        used = rng.choice(used, MAX_COLUMNS, replace=False)
    errors, h = [], DIFFERENCE_STEP
    rounding = 4.0 * np.finfo(float).eps * np.abs(R).max() / h
    for j in used:
        e = np.zeros(U.size)
        e[j] = h
        plus = states.residual_at(contact, U + e)
        assert branch.holds(contact)
        minus = states.residual_at(contact, U - e)
        assert branch.holds(contact)
        error = np.abs((plus - minus) / (2.0 * h) - K[:, j]).max() - rounding
        # Dofs that meet open points only may have zero columns: exactly
        errors.append(error / np.abs(K[:, j]).max() if error > 0.0 else 0.0)
    return max(errors)


class Topology(Branch):
    """Hits, statuses, and what each segment is made of."""

    def __init__(self, contact):
        super().__init__(contact)
        s = gathered.dictionary(contact.zones[0].cpp.segments())
        self.segments = [s[k] for k in ("slave", "master", "offsets", "motion")]

    def holds(self, contact):
        now = type(self)(contact)
        same = zip(self.segments, now.segments)
        return super().holds(contact) and all(np.array_equal(a, b) for a, b in same)


def all_hit_their_own(contact):
    """Whether no point lies between the chord of a segment and its true edge."""
    p = gathered.points(contact)
    return np.array_equal(p["master"][p["seed"] >= 0], p["seed"][p["seed"] >= 0])


def remainders_of(contact, K, seed, first_steps=FIRST_STEPS, branch=Topology):
    """Steps and Taylor remainders of the re-paired residual, with the topology, or the
    branch that is given, held; None where it is not."""
    U, R = states.unknowns(contact), states.assembled(contact)
    direction = np.random.default_rng(seed + 1000).normal(size=U.size)
    for first in first_steps:
        steps = first * 10.0 ** -np.arange(0.0, DECADES - 0.9, 0.5)
        remainders = taylor_remainders(
            contact, K, U, R, direction, steps, branch, rays_only=False
        )
        states.residual_at(contact, U, rays_only=False)
        if remainders is not None:
            return steps, remainders
    return None


@dataclass
class Pair:
    """The same contact with both tangents."""

    fixed: object
    full: object

    def tangents(self, form):
        return [states.tangent(contact, form) for contact in (self.fixed, self.full)]


def contact_pairs(scene, case, **options):
    """What makes frictionless contacts of both tangents, for `quiet_slopes`."""

    def make(seed):
        return Pair(
            *(
                states.make_contact(scene, case, tangent=t, **options)
                for t in ("fixed", "full")
            )
        )

    return make


def quiet_slopes(make, prepare, wanted=all_hit_their_own, first_steps=FIRST_STEPS):
    """Slopes with the fixed and the full tangent, at a state with no kink nearby."""
    for seed in SEEDS:
        pair = make(seed)
        if (
            pair is None
            or not prepare(pair.fixed, seed)
            or not prepare(pair.full, seed)
        ):
            continue
        if not wanted(pair.full):
            continue
        form = states.mass_form(pair.full.u.function_space)
        fixed, full = pair.tangents(form)
        found = remainders_of(pair.full, full, seed, first_steps)
        if found is None:
            continue
        of_fixed = remainders_of(pair.full, fixed, seed, first_steps)
        return slopes(*found), slopes(*of_fixed)
    raise AssertionError("no random state without a kink nearby")


def is_second_order(found):
    return np.all(np.abs(found - 2.0) <= SLOPE_TOLERANCE)


def is_first_order(found):
    """In the limit: the slopes of the smallest steps."""
    return np.all(np.abs(found[-2:] - 1.0) <= SLOPE_TOLERANCE)
