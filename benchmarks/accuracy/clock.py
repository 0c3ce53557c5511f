"""Seconds of a solve by stage: pairing, integration, assembly, linear solver.

Stages are timed where raymortar's and PETSc's own clocks are, in wall time. On a
machine with other work that is more than a program needs; the total is taken in
processor time, and shared out among the stages as the wall time is.
"""

from __future__ import annotations

import time
from unittest import mock

from petsc4py import PETSc

import raymortar

STAGES = ("pairing", "integration", "assembly", "solve")
_FACTORISE = ("MatLUFactorSym", "MatLUFactorNum", "MatSolve")
# Of a zone's statistics, which are those of its last pairing
_PAIRING = ("seconds_halo", "seconds_candidates")
_INTEGRATION = ("seconds_segments", "seconds_rays")


class Clock:
    """Times what runs inside a with block.

    Attributes
    ----------
    seconds
        Processor time in all, and of each of `STAGES`; after the block.

    Notes
    -----
    "pairing" finds candidates, "integration" clips segments and casts rays, "assembly"
    is the rest: blocks of contact, the volume's forms, Python.
    """

    def __enter__(self):
        if not PETSc.Log.isActive():
            PETSc.Log.begin()
        self._wall = dict.fromkeys(STAGES, 0.0)
        update = raymortar.Contact.update

        def timed(contact, *args, **options):
            update(contact, *args, **options)
            for zone in contact.zones:
                statistics = zone.cpp.statistics()
                self._wall["pairing"] += sum(statistics[k] for k in _PAIRING)
                self._wall["integration"] += sum(statistics[k] for k in _INTEGRATION)

        self._patch = mock.patch.object(raymortar.Contact, "update", timed)
        self._patch.start()
        self._solve = _factorising()
        self._start = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_):
        wall = time.perf_counter() - self._start[0]
        total = time.process_time() - self._start[1]
        self._patch.stop()
        self._wall["solve"] = _factorising() - self._solve
        self._wall["assembly"] = max(0.0, wall - sum(self._wall.values()))
        share = {stage: seconds / wall for stage, seconds in self._wall.items()}
        self.seconds = {"seconds": total}
        self.seconds |= {stage: share[stage] * total for stage in STAGES}


def _factorising() -> float:
    """Seconds that PETSc has spent in the direct solver."""
    return sum(PETSc.Log.Event(name).getPerfInfo()["time"] for name in _FACTORISE)
