"""Solves under other loads whose steps nobody accepts, which friction takes as one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from mpi4py import MPI

import numpy as np
import ufl

from ..compat import Array
from ..errors import warn
from ..interface.point_results import CLOSED
from ..problem import CoupledProblem

# Solves under other loads from one state: two may be a load and the way to it
SEVERAL = 3


@dataclass
class _Solves:
    """Solves of a problem since the last step that was accepted, or gone back to."""

    begin: tuple[int, ...]
    loads: Array
    count: int = 1
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
        _SOLVES[problem] = _Solves(begin, loads, told=told)
        return
    same = np.array_equal(loads, known.loads)
    if known.told or problem.comm.allreduce(same, op=MPI.LAND):
        return
    known.loads, known.count = loads, known.count + 1
    points = [zone.points()["status"] for one in rubbed for zone in one.zones]
    closed = any(bool(np.any(status >= CLOSED)) for status in points)
    if known.count < SEVERAL or not problem.comm.allreduce(closed, op=MPI.LOR):
        return
    known.told = True
    warn(
        f"{known.count} solves under other loads without contact.advance(): friction "
        "takes each as one step from the accepted state. Call contact.advance() after "
        "each solve of a path",
        5,
    )


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
