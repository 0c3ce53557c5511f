"""Energy balance of a step, which tells a path of equilibria from a jump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compat import Array
from ..interface.point_results import OPEN, pressures, resultant_on
from ..interface.state import State
from ..results.energies import work_on_gaps

if TYPE_CHECKING:
    from ..interface.zones import ZoneData
    from ..problem import CoupledProblem
    from ..rigid.body import Body

# Energy that may be missing, over all energies of the step. Where forces grow with
# displacements none is
MISSING = 0.02
# With multipliers gaps are zero in the mean only, as those of a round tool over straight
# facets. Tractions then work on the remaining gaps, and forces ripple. Over the integral
# of |t_n g| at both ends a rolling wheel lacks up to 0.15, of coarse and fine facets and
# in small and large steps; a hook whose nose is one facet lacks up to 0.28, half of all
# energies of its steps. A disc that turns against its moment lacks all of them
RIPPLE, MOST_RIPPLE = 0.3, 0.55
# Energy that is set free in a snap, over all energies. Smooth steps stay below a fiftieth
FREED = 0.1

# Size of a step, over the energy that the bodies hold, below which all is rounding
NOTHING = 1e-9
# Force on a facet, of that at the step's end, up to which nothing has pressed it before
UNPRESSED = 1e-6

# Gauss points on the line from one state to the other, and their weights. They are exact
# for polynomial forces of degree 5
_ROOT = 0.5 * np.sqrt(0.6)
PLACES, WEIGHTS = (0.5 - _ROOT, 0.5, 0.5 + _ROOT), (5 / 18, 8 / 18, 5 / 18)


@dataclass(frozen=True)
class Balance:
    """Energies of a step.

    Attributes
    ----------
    most, least
        Bounds of the energy that the step sets free: the work of loads, supports and
        tools, less the growth of stored energy and the work of friction. On a path of
        equilibria it is 0, which is then between both.
    size
        Sum of the amounts of all energies.
    ripple
        Integral of |t_n g| at both ends, where multipliers leave gaps.
    held
        Work that the forces at the step's end would do on all displacements.
    """

    most: float
    least: float
    size: float
    ripple: float
    held: float

    @property
    def lacks_energy(self) -> bool:
        """Whether the step needs energy that nothing supplies."""
        allowed = min(
            MISSING * self.size + RIPPLE * self.ripple, MOST_RIPPLE * self.size
        )
        allowed = max(allowed, NOTHING * self.held)
        return not self.most >= -allowed  # nor if it is no number

    @property
    def released(self) -> float:
        """Energy that a snap has set free at least, 0 where there is none."""
        clear = max(FREED * self.size, RIPPLE * self.ripple)
        return self.least if self.least > clear else 0.0


@dataclass(frozen=True)
class _Supplied:
    """Forces from outside in one state, and where they act, on this rank.

    Attributes
    ----------
    forces, places
        Of supports, of loads on free rigid bodies and of moved tools, by kind.
    contact
        Contact forces at owned dofs of u.
    """

    forces: tuple[Array, ...]
    places: tuple[Array, ...]
    contact: Array


@dataclass(frozen=True)
class _Facets:
    """Slave facets of a zone on this rank in one state, (facets,) each.

    Attributes
    ----------
    force
        Of contact along its normal.
    gap, offset
        Means over the facet of the gap, with the offset, and of the offset. Length.
    """

    force: Array
    gap: Array
    offset: Array


def balance_of_step(problem: CoupledProblem, path: Any, begin: State) -> Balance:
    """Balance of the step from a state to the present one. Collective.

    Stored energy grows by the work of the form's forces along the straight line between
    both states. All other work, that of interferences which grow among it, is bounded by
    that of the forces at either end: they lie between, where loads and forces grow or
    fall throughout.

    Parameters
    ----------
    problem
        Of one displacement.
    path
        `PrescribedPath`, which sets the loads of both ends.
    begin
        Where the step began.
    """
    contact: Any = problem.contact
    end = contact.state()
    n = contact.layout.n_u
    du = (end.u - begin.u)[:n]
    path.set_first_loads()
    contact.restore(begin)
    first, volume = _supplied(problem, of_begin=True), _volume_forces(problem)
    held, ripple, was = _stored(problem), _ripple(problem), _facets(problem)
    path.begin()
    loads = float((volume - _volume_forces(problem)) @ du)
    potential = _work_of_form(problem, begin, end) @ du
    contact.restore(end)
    last, now = _supplied(problem), _facets(problem)
    works = [(float(-potential - loads), float(-potential))]
    works += _works_on_offsets(was, now) + _works_on_overlaps(problem, was, now)
    for f0, f1, x0, x1 in zip(first.forces, last.forces, first.places, last.places):
        works.append((float(f0 @ (x1 - x0)), float(f1 @ (x1 - x0))))
    through_contact = float(last.contact @ du)
    carried = float(np.abs(last.contact) @ np.abs(end.u[:n]))
    table = problem.comm.allreduce(np.array([*works, (through_contact,) * 2]))
    taken = sum(max(one.friction_work(), 0.0) for one in contact.contacts)
    taken += _stored(problem) - held
    return Balance(
        most=float(table[:-1].max(axis=1).sum()) - taken,
        least=float(table[:-1].min(axis=1).sum()) - taken,
        size=float(np.abs(table).max(axis=1).sum()) + abs(taken),
        ripple=ripple + _ripple(problem),
        held=problem.comm.allreduce(carried),
    )


def _stored(problem: CoupledProblem) -> float:
    """Energy in penalties. That in friction springs is part of the work of friction.
    Collective."""
    return sum(
        one.stored_energy("total" if one.friction is None else "normal")
        for one in problem.contact.contacts
    )


def _ripple(problem: CoupledProblem) -> float:
    """Integral of |t_n g|, of contacts with multipliers. Collective."""
    return sum(
        work_on_gaps(one.zones, problem.comm)
        for one in problem.contact.contacts
        if one.multiplier is not None and one.tied is None
    )


def _facets(problem: CoupledProblem) -> list[_Facets]:
    """Present slave facets of all zones, but those of ties."""
    return [
        _of_zone(zone)
        for one in problem.contact.contacts
        if one.tied is None
        for zone in one.zones
    ]


def _of_zone(zone: ZoneData) -> _Facets:
    points, count = zone.points(), len(zone.facets.slave_surface.facet_ids)
    hit = points["status"] >= OPEN
    facet, weight = points["slave"][hit], points["weight"][hit]
    force, gap, area = (
        np.bincount(facet, weight * values[hit], count).astype(float)
        for values in (pressures(points), points["gap"], np.ones(len(hit)))
    )
    mean = np.divide(gap, area, out=np.zeros(count), where=area > 0.0)
    offset = zone.whole_offset
    own = np.zeros(count) if offset is None else offset.mean(axis=1)
    return _Facets(force, mean, own)


def _works_on_offsets(was: list[_Facets], now: list[_Facets]) -> list[Any]:
    """Works of interferences that have grown, by the forces of both ends."""
    works = []
    for a, b in zip(was, now):
        grown = a.offset - b.offset
        works.append((float(a.force @ grown), float(b.force @ grown)))
    return works


def _works_on_overlaps(
    problem: CoupledProblem, was: list[_Facets], now: list[_Facets]
) -> list[Any]:
    """Works of surfaces that lay in each other without a force, as meshes and tools may
    where a path starts. What penalties store there counts by itself."""
    works, each = [], iter(zip(was, now))
    for one in problem.contact.contacts:
        for _, (a, b) in zip(one.zones if one.tied is None else (), each):
            if one.multiplier is None:
                continue
            new = np.abs(a.force) <= UNPRESSED * np.abs(b.force)
            works.append((0.0, float(b.force[new] @ np.maximum(-a.gap[new], 0.0))))
    return works


def _volume_forces(problem: CoupledProblem) -> Array:
    """Residual of the user's form at owned dofs of u. Collective."""
    forces: Array = problem.volume.forces(problem.bcs)[problem.contact.host.u_owned]
    return forces


def _work_of_form(problem: CoupledProblem, begin: State, end: State) -> Array:
    """Mean of the form's forces on the line between two states. The unknowns are
    elsewhere afterwards. Collective."""
    host, mean = problem.contact.host, np.zeros(problem.contact.layout.n_u)
    a, b = (one.u if one.unknowns is None else one.unknowns for one in (begin, end))
    for place, weight in zip(PLACES, WEIGHTS):
        host.set_values(a + place * (b - a))
        mean += weight * _volume_forces(problem)
    return mean


def _supplied(problem: CoupledProblem, of_begin: bool = False) -> _Supplied:
    """Forces from outside in the present state; where a step begins tools are where the
    accepted step left them, as they may have been moved since. Collective."""
    contact, vector = problem.contact, problem.create_vector()
    contact.assemble_vector(vector)
    vector.assemble()
    rows = vector.getArray(readonly=True)[: contact.layout.n][contact.host.u_owned]
    vector.destroy()
    held = np.where(problem.constrained, rows + _volume_forces(problem), 0.0)
    bodies = dict.fromkeys(b for zone in contact.zones for b in zone.facets.bodies)
    tools = [_drive(problem, body, of_begin) for body in bodies]
    # Values that all ranks have alike count once
    once = float(problem.comm.rank == 0)
    loads = [_load(body) for body in contact.layout.bodies]
    totals = [body.freedom.totals for body in contact.layout.bodies]
    none = np.zeros(0)
    forces = (
        held,
        once * np.concatenate([none, *loads]),
        once * np.concatenate([none, *(force for force, _ in tools)]),
    )
    places = (
        contact.u.x.array[: contact.layout.n_u].copy(),
        np.concatenate([none, *totals]),
        np.concatenate([none, *(place for _, place in tools)]),
    )
    return _Supplied(forces, places, rows)


def _load(body: Body) -> Array:
    """Forces and moments of loads and springs along the unknowns of a free body."""
    pushed, lever = body.pushed()[0], body.freedom.lever or 1.0
    return np.where(body.freedom.is_turn, lever * pushed, pushed)


def _drive(problem: CoupledProblem, body: Body, of_begin: bool) -> tuple[Array, Array]:
    """Force and moment that hold a tool against contact, (6,), and its prescribed
    translation and rotation, or those of the accepted step. Collective."""
    found, gdim = resultant_on(problem.contact.zones, body, problem.comm), 3
    force, moment = np.zeros(3), np.zeros(3)
    force[: len(found.force)] = found.force
    moment[gdim - np.size(found.moment) :] = found.moment
    motion = body.motion()
    if of_begin:
        zones = problem.contact.zones
        motion = next(z for z in zones if body in z.facets.bodies).motions.accepted(
            body
        )
    moved = motion[:3] - body.freedom.translation
    return -np.concatenate([force, moment]), np.concatenate([moved, motion[3:6]])
