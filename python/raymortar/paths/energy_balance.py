"""Energy balance of a step, which tells a path of equilibria from a jump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.interface.point_results import OPEN, pressures
from ..core.interface.zone_data import ZoneData, mean_facet_size
from ..core.options.methods import Penalty
from ..core.problem import CoupledProblem
from ..core.state import State
from ..records.patch_columns import rigid_bodies
from ..results.sums import resultant_on, slip_work, work_on_gaps
from .load_path import PrescribedPath

# Energy that may be missing, over all energies of the step. Where forces grow with
# displacements none is. A die that is drawn over a slab lacks up to 0.035, though its
# steps end where eight times as many do: friction's work takes tractions of their ends
MISSING = 0.05
# With multipliers gaps are zero in the mean only, as those of a round tool over straight
# facets. Tractions then work on the remaining gaps, and forces ripple. Over the integral
# of |t_n g| at both ends a rolling wheel lacks up to 0.15, of coarse and fine facets and
# in small and large steps; a hook whose nose is one facet lacks up to 0.28, half of all
# energies of its steps. A disc that turns against its moment lacks all of them
RIPPLE, MOST_RIPPLE = 0.3, 0.55
# Energy left over, from all energies on which a snap is sure. Smooth steps stay below a
# fiftieth
FREED = 0.1

# Size of a step, over the energy that the bodies hold, below which all is rounding
NOTHING = 1e-9
# Strain that is rounding error
NO_STRAIN = 1e-9
# Force on a facet, of that at the step's end, up to which nothing has pressed it before
UNPRESSED = 1e-6

# Gauss points on the line from one state to the other, and their weights. They are exact
# for polynomial forces of degree 5
_ROOT = 0.5 * np.sqrt(0.6)
PLACES, WEIGHTS = (0.5 - _ROOT, 0.5, 0.5 + _ROOT), (5 / 18, 8 / 18, 5 / 18)


@dataclass(frozen=True)
class Balance:
    """Energies of a step.

    `most` and `least` are bounds of the energy that the step sets free: the work of
    loads, supports and tools, less the growth of stored energy and the work of friction.
    On a path of equilibria it is 0, which is then between both. `size` is the sum of the
    amounts of all energies, `ripple` the integral of |t_n g| at both ends, where
    multipliers leave gaps, and `held` the work that the forces at the step's end would do
    on all displacements. Energy up to `rounding` is none.
    """

    most: float
    least: float
    size: float
    ripple: float
    held: float
    rounding: float = 0.0

    @property
    def lacks_energy(self) -> bool:
        """Whether the step needs energy that nothing supplies."""
        allowed = min(
            MISSING * self.size + RIPPLE * self.ripple, MOST_RIPPLE * self.size
        )
        allowed = max(allowed, NOTHING * self.held)
        return not self.most >= -allowed  # nor if it is no number

    @property
    def has_snapped(self) -> bool:
        """Whether energy is left over at the loads of the step's start already. A snap
        under larger loads may leave none."""
        clear = max(FREED * self.size, RIPPLE * self.ripple, self.rounding)
        return self.least > clear

    @property
    def released(self) -> tuple[float, float]:
        """Bounds of the energy that a snap within the step has set free."""
        return max(self.least, 0.0), max(self.most, 0.0)

    def describe_snap(self, factor: float) -> str:
        """Tell of a snap that a step up to a load factor has passed."""
        least, most = self.released
        return (
            f"a snap was passed before load factor {factor:.6g}: it sets an energy from "
            f"{least:.3g} to {most:.3g} free, and its end is one of several. Take smaller "
            "steps, or control="
        )


@dataclass(frozen=True)
class _Facets:
    """Slave facets of a zone on this rank in one state, (facets,) each.

    Force of contact along the normal; means of the gap, with the offset, and of the
    offset. Length.
    """

    force: Array
    gap: Array
    offset: Array
    has_multiplier: bool


@dataclass(frozen=True)
class _End:
    """Forces, places and energies at one end of a step.

    `unbalanced` has what the solve left of forces, in absolute value.
    """

    volume: Array
    tractions: Array
    unbalanced: Array
    supplied: list[tuple[Array, Array]]
    stored: float
    ripple: float
    facets: list[_Facets]


def balance_of_step(
    problem: CoupledProblem, path: PrescribedPath, begin: State
) -> Balance:
    """Balance the energies of the step from a state to the present one. Collective.

    Stored energy grows by the work of the form's forces along the straight line between
    both states. All other work, that of interferences which grow among it, is bounded by
    that of the forces at either end: they lie between, where loads and forces grow or
    fall throughout. The path sets the loads of both ends.
    """
    contact: Any = problem.contact
    end = contact.state()
    u = contact.states.u_of(end)
    du = (u - contact.states.u_of(begin))[: contact.layout.n_u]
    path.set_first_loads()
    # A step that has carried bodies far faces what it has met there
    seen = [zone.opposite for zone in contact.zones]
    contact.restore(begin)
    first = _end(problem, of_begin=True)
    path.begin()
    loads = float((first.volume - _volume_forces(problem)) @ du)
    potential = float(_work_of_form(problem, begin, end) @ du)
    contact.restore(end)
    for zone, opposite in zip(contact.zones, seen):
        zone.opposite = opposite
    last = _end(problem)
    works = [(-potential - loads, -potential)]
    for a, b in zip(first.facets, last.facets):
        grown = a.offset - b.offset  # interferences
        works.append((float(a.force @ grown), float(b.force @ grown)))
        if a.has_multiplier:
            # Surfaces that lay in each other without a force, as meshes and tools may
            # where a path starts. What penalties store there counts by itself
            new = np.abs(a.force) <= UNPRESSED * np.abs(b.force)
            works.append((0.0, float(b.force[new] @ np.maximum(-a.gap[new], 0.0))))
            # Surfaces that have worn since they were pressed: what closes the gap is spent
            worn = np.where(new, 0.0, np.maximum(a.gap, 0.0))
            works.append((-float(b.force @ worn), 0.0))
    for (force, place), (new_force, new_place) in zip(first.supplied, last.supplied):
        way = new_place - place
        works.append((float(force @ way), float(new_force @ way)))
    through_contact = float(last.tractions @ du)
    carried = float(np.abs(last.tractions) @ np.abs(u[: len(du)]))
    table = problem.comm.allreduce(np.array([*works, (through_contact,) * 2]))
    left = problem.comm.allreduce(float((first.unbalanced + last.unbalanced) @ abs(du)))
    frictional = [one for one in contact.contacts if one.friction is not None]
    taken = sum(max(slip_work(one.surfaces.zones), 0.0) for one in frictional)
    taken += last.stored - first.stored
    return Balance(
        most=float(table[:-1].max(axis=1).sum()) - taken,
        least=float(table[:-1].min(axis=1).sum()) - taken,
        size=float(np.abs(table).max(axis=1).sum()) + abs(taken),
        ripple=first.ripple + last.ripple,
        held=problem.comm.allreduce(carried),
        rounding=left + max(map(_rounding, contact.parts)),
    )


def _rounding(part: Any) -> float:
    """Energy of a facet of a contact under a strain that is rounding error. Collective."""
    size, dim = mean_facet_size(part.zones), part.zones[0].facets.slave_surface.gdim
    return float(part.gamma_scale * size ** (dim + 1) * NO_STRAIN**2)


def _end(problem: CoupledProblem, of_begin: bool = False) -> _End:
    """Look at one end of a step, whose loads and state are set. Collective."""
    contact, volume = problem.contact, _volume_forces(problem)
    residual = problem.forces()
    tractions = residual - volume
    held = np.where(problem.constrained, residual, 0.0)
    supplied = _supplied(problem, held, of_begin)
    unbalanced = np.abs(residual - held)
    stored, ripple, facets = 0.0, 0.0, []
    for one in contact.contacts:
        # Energy in springs of friction is in the work of slips
        stored += one.stored_energy("total" if one.friction is None else "normal")
        if one.bond is not None:
            stored += one.bond.stored() + one.bond.dissipated()
        if one.tied is None:
            # An exact penalty has the tractions of a multiplier
            is_exact = isinstance(one.method, Penalty) and one.method.exact
            closes = one.multiplier is not None or is_exact
            if closes:
                ripple += work_on_gaps(one.zones)
            for zone in one.zones:
                facets.append(_facets(zone, closes))
    return _End(volume, tractions, unbalanced, supplied, stored, ripple, facets)


def _facets(zone: ZoneData, has_multiplier: bool) -> _Facets:
    """Sum points to the present slave facets of a zone."""
    points, count = zone.points(), len(zone.facets.slave_surface.facet_ids)
    hit = points["status"] >= OPEN
    facet, weight = points["slave"][hit], points["weight"][hit]
    force, gap, area = (
        np.bincount(facet, weight * values[hit], count).astype(float)
        for values in (pressures(points), points["gap"], np.ones(len(hit)))
    )
    mean = np.divide(gap, area, out=np.zeros(count), where=area > 0.0)
    offset = zone.own_offset
    own = np.zeros(count) if offset is None else offset.mean(axis=1)
    return _Facets(force, mean, own, has_multiplier)


def _volume_forces(problem: CoupledProblem) -> Array:
    """Assemble the residual of the user's form at owned dofs of u. Collective."""
    return np.asarray(
        problem.volume.forces(problem.bcs)[problem.contact.unknowns.u_owned]
    )


def _work_of_form(problem: CoupledProblem, begin: State, end: State) -> Array:
    """Average the form's forces between two states; leave u elsewhere. Collective."""
    unknowns, mean = problem.contact.unknowns, np.zeros(problem.contact.layout.n_u)
    a, b = map(problem.contact.states.values_of, (begin, end))
    for place, weight in zip(PLACES, WEIGHTS):
        unknowns.set_values(a + place * (b - a))
        mean += weight * _volume_forces(problem)
    return mean


def _supplied(
    problem: CoupledProblem, held: Array, of_begin: bool
) -> list[tuple[Array, Array]]:
    """Find forces from outside and their places, on this rank, given the forces of
    supports. Collective.

    They are those of supports, of loads on free rigid bodies and of moved tools. Where a
    step begins, tools are where the accepted step left them: they may have been moved
    since.
    """
    contact = problem.contact
    # Values that all ranks have alike count once
    once = float(problem.comm.rank == 0)
    loads, tools = [], []
    for body in contact.layout.bodies:
        pushed, lever = body.pushed()[0], body.freedom.lever or 1.0
        load = np.where(body.freedom.is_turn, lever * pushed, pushed)
        loads.append((once * load, body.freedom.totals))
    for body in rigid_bodies(contact.zones):
        on, load = resultant_on(contact.zones, body), np.zeros(6)
        load[: len(on.force)] = on.force
        load[6 - np.size(on.moment) :] = on.moment
        zone = next(zone for zone in contact.zones if body in zone.facets.bodies)
        motion = (zone.motions.accepted(body) if of_begin else body.motion())[:6].copy()
        motion[:3] -= body.cpp.translation()
        tools.append((-once * load, motion))
    found = [(held, contact.u.x.array[: contact.layout.n_u].copy())]
    for pairs in filter(None, (loads, tools)):
        forces, places = (np.concatenate(column) for column in zip(*pairs))
        found.append((forces, places))
    return found
