"""Solves under other loads whose steps nobody accepts, which friction takes as one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from mpi4py import MPI

import numpy as np
import ufl

from ..core.compat import Array
from ..core.contact import Contact
from ..core.errors import warn
from ..core.interface.point_results import CLOSED, Status
from ..core.problem import CoupledProblem

# Solves under other loads from one state: two may be a load and the way to it
SEVERAL = 3
# Part of the forces on slipping points from which the way matters: what sticks is the
# same however it came
SLIPPING = 0.05


@dataclass
class _Solves:
    """Solves that slip since the last step that was accepted, or gone back to."""

    begin: tuple[int, ...]
    loads: Array
    count: int = 0
    told: bool = False


_SOLVES: WeakKeyDictionary[CoupledProblem, _Solves] = WeakKeyDictionary()


def warn_of_unaccepted_solves(problem: CoupledProblem) -> None:
    """Warn once of solves under other loads, with friction, from one accepted state.

    It is called after a converged solve that is no part of a path. Collective.
    """
    contact = problem.contact
    rubbed = [one for one in contact.contacts if one.friction is not None]
    if not rubbed:
        return
    parts = [part.present for part in contact.parts]
    begin = tuple(n for one in parts for n in (one.steps, one.returns))
    loads, known = np.concatenate([*_loads(problem)]), _SOLVES.get(problem)
    if known is None or known.begin != begin:
        told = known is not None and known.told
        known = _SOLVES[problem] = _Solves(begin, np.empty(0), told=told)
    same = np.array_equal(loads, known.loads)
    if known.told or problem.comm.allreduce(same, op=MPI.LAND):
        return
    known.loads = loads
    known.count += _slip(problem, rubbed)
    if known.count < SEVERAL:
        return
    known.told = True
    warn(
        f"{known.count} solves under other loads without contact.advance(): friction "
        "takes each as one step from the accepted state. Call contact.advance() after "
        "each solve of a path",
    )


def _slip(problem: CoupledProblem, rubbed: Sequence[Contact]) -> bool:
    """Whether contacts with friction slip by enough to matter. Collective."""
    sums = np.zeros(2)
    for zone in (zone for one in rubbed for zone in one.zones):
        points = zone.points()
        force, status = np.abs(points["weight"] * points["pressure"]), points["status"]
        sums += force[status == Status.SLIP].sum(), force[status >= CLOSED].sum()
    slips, closed = problem.comm.allreduce(sums)
    return bool(slips > SLIPPING * closed)


def _loads(problem: CoupledProblem) -> Iterator[Array]:
    """Yield what loads a problem: prescribed values, constants, motions of tools."""
    marked, values = problem.contact.unknowns.prescribed(problem.bcs)
    yield values[marked == 1]
    given = problem.forms[0]
    for form in given if isinstance(given, (list, tuple)) else [given]:
        if isinstance(form, ufl.Form):
            for constant in form.constants():
                yield np.ravel(constant.value)
    for zone in problem.contact.zones:
        yield np.ravel(zone.motions.present())
