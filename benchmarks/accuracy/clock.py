"""Seconds of a solve by stage: pairing, integration, assembly, volume, linear solver.

Stages are timed where raymortar's and PETSc's own clocks are, in wall time. On a
machine with other work that is more than a program needs; the total is taken in
processor time, and shared out among the stages as the wall time is.
"""

from __future__ import annotations

import contextlib
import time
from unittest import mock

from petsc4py import PETSc

from raymortar.core.system.coupled import CoupledSystem

STAGES = ("pairing", "integration", "assembly", "volume", "solve")
_FACTORISE = ("MatLUFactorSym", "MatLUFactorNum", "MatSolve")
# Stage of each clock of a zone, and the count that tells whether it has run anew
_CLOCKS = {
    "seconds_halo": ("pairing", "halo_builds"),
    "seconds_candidates": ("pairing", "candidate_builds"),
    "seconds_segments": ("integration", "pairings"),
    "seconds_rays": ("integration", "pairings"),
}
_BLOCKS = ("assemble_residual", "add_tangent")


class Clock:
    """Times what runs inside a with block.

    Attributes
    ----------
    seconds
        Processor time in all, and of each of `STAGES`; after the block.

    Notes
    -----
    "pairing" finds candidates, "integration" clips segments and casts rays, "assembly"
    is that of contact's blocks and of the residual's norms, "volume" the rest: the volume's forms, and Python.
    """

    def __enter__(self):
        if not PETSc.Log.isActive():
            PETSc.Log.begin()
        self._wall = dict.fromkeys(STAGES, 0.0)
        self._patches = contextlib.ExitStack()
        self._replace("_pair", self._pairing)
        for name in _BLOCKS:
            self._replace(name, self._assembly)
        self._solve = _factorising()
        self._start = time.perf_counter(), time.process_time()
        return self

    def _replace(self, name, wrap):
        """Have a method of all coupled systems timed."""
        timed = wrap(getattr(CoupledSystem, name))
        patch = mock.patch.object(CoupledSystem, name, timed)
        self._patches.enter_context(patch)

    def _pairing(self, pair):
        def timed(contact, *args):
            before = [zone.cpp.statistics() for zone in contact.zones]
            pair(contact, *args)
            for zone, old in zip(contact.zones, before):
                new = zone.cpp.statistics()
                for clock, (stage, count) in _CLOCKS.items():
                    if new[count] > old[count]:
                        self._wall[stage] += new[clock]

        return timed

    def _assembly(self, method):
        def timed(*args, **options):
            start = time.perf_counter()
            found = method(*args, **options)
            self._wall["assembly"] += time.perf_counter() - start
            return found

        return timed

    def __exit__(self, *_):
        wall = time.perf_counter() - self._start[0]
        total = time.process_time() - self._start[1]
        self._patches.close()
        self._wall["solve"] = _factorising() - self._solve
        self._wall["volume"] = max(0.0, wall - sum(self._wall.values()))
        share = {stage: seconds / wall for stage, seconds in self._wall.items()}
        self.seconds = {"seconds": total}
        self.seconds |= {stage: share[stage] * total for stage in STAGES}


def _factorising() -> float:
    """Seconds that PETSc has spent in the direct solver."""
    return sum(PETSc.Log.Event(name).getPerfInfo()["time"] for name in _FACTORISE)
