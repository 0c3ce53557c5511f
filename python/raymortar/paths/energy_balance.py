"""Energy balance of a step, which tells a path of equilibria from a jump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compat import Array
from ..interface.state import State
from ..results.sums import resultant_on, work_on_gaps

if TYPE_CHECKING:
    from ..problem import CoupledProblem
    from ..rigid.body import Body

# Energy that may be missing, over all energies of the step. Where forces grow with
# displacements none is
MISSING = 0.02
# With multipliers gaps are zero in the mean only, as those of a round tool over straight
# facets. Tractions then work on what is left of them: forces ripple. Over the integral of
# |t_n g| at both ends a wheel that rolls lacks up to 0.15, of coarse and fine facets and
# in small and large steps. No more than a tenth of all energies is let pass
RIPPLE, MOST_RIPPLE = 0.25, 0.1
# Energy that is set free in a snap, over all energies. Smooth steps stay below a fiftieth
FREED = 0.1

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
    """

    most: float
    least: float
    size: float
    ripple: float

    @property
    def lacks_energy(self) -> bool:
        """Whether the step needs energy that nothing supplies."""
        allowed = min(
            MISSING * self.size + RIPPLE * self.ripple, MOST_RIPPLE * self.size
        )
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


def balance_of_step(problem: CoupledProblem, path: Any, begin: State) -> Balance:
    """Balance of the step from a state to the present one. Collective.

    Stored energy grows by the work of the form's forces along the straight line between
    both states. All other work is bounded by that of the forces at either end: they lie
    between, where loads and forces grow or fall throughout.

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
    first, volume = _supplied(problem), _volume_forces(problem)
    held, ripple = _stored(problem), _ripple(problem)
    path.begin()
    loads = float((volume - _volume_forces(problem)) @ du)
    potential = _work_of_form(problem, begin, end) @ du
    contact.restore(end)
    last = _supplied(problem)
    works = [(float(-potential - loads), float(-potential))]
    for f0, f1, x0, x1 in zip(first.forces, last.forces, first.places, last.places):
        works.append((float(f0 @ (x1 - x0)), float(f1 @ (x1 - x0))))
    through_contact = float(last.contact @ du)
    table = problem.comm.allreduce(np.array([*works, (through_contact,) * 2]))
    taken = sum(max(one.friction_work(), 0.0) for one in contact.contacts)
    taken += _stored(problem) - held
    return Balance(
        most=float(table[:-1].max(axis=1).sum()) - taken,
        least=float(table[:-1].min(axis=1).sum()) - taken,
        size=float(np.abs(table).max(axis=1).sum()) + abs(taken),
        ripple=ripple + _ripple(problem),
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


def _supplied(problem: CoupledProblem) -> _Supplied:
    """Forces from outside in the present state. Collective."""
    contact, vector = problem.contact, problem.create_vector()
    contact.assemble_vector(vector)
    vector.assemble()
    rows = vector.getArray(readonly=True)[: contact.layout.n][contact.host.u_owned]
    vector.destroy()
    held = np.where(problem.constrained, rows + _volume_forces(problem), 0.0)
    bodies = dict.fromkeys(b for zone in contact.zones for b in zone.facets.bodies)
    tools = [_drive(problem, body) for body in bodies]
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


def _drive(problem: CoupledProblem, body: Body) -> tuple[Array, Array]:
    """Force and moment that hold a tool against contact, (6,), and its prescribed
    translation and rotation. Collective."""
    found, gdim = resultant_on(problem.contact.zones, body, problem.comm), 3
    force, moment = np.zeros(3), np.zeros(3)
    force[: len(found.force)] = found.force
    moment[gdim - np.size(found.moment) :] = found.moment
    motion = body.motion()
    moved = motion[:3] - body.freedom.translation
    return -np.concatenate([force, moment]), np.concatenate([moved, motion[3:6]])
