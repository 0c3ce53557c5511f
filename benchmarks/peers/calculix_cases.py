"""A case in CalculiX (Debian's calculix-ccx: SPOOLES is its only solver).

Its users write a deck, and take increments that it may cut, its own criteria of
convergence (half a per cent of the mean force, one of the displacement's change) and
its penalties. It has no other way that would be more alike.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

import calculix_deck as deck
import calculix_results as results
import numpy as np
from peer_case import Case, Effort, Failed, Found

MISSING = "CalculiX is missing (calculix-ccx): its runs are left out"
PROGRAM = shutil.which("ccx")
# Longer runs are ended: seconds of the processor. Those that arrive take a tenth
LONGEST = int(os.environ.get("PEERS_LONGEST", "300"))


class CalculiX:
    """A deck and what ccx makes of it; forms are types of contact."""

    FORMS = tuple(deck.TYPES)

    def __init__(self, case: Case, form: str, alike: bool = True):
        self.case = case
        self._folder = tempfile.TemporaryDirectory(prefix="deck")
        self.job = Path(self._folder.name) / "job"
        self.job.with_suffix(".inp").write_text(deck.write(case, form))

    @property
    def unknowns(self) -> int:
        """Displacements."""
        return int(np.unique(self.case.cells).size * self.case.dim)

    def _read(self, suffix: str) -> str:
        file = self.job.with_suffix(suffix)
        return file.read_text() if file.exists() else ""

    def solve(self) -> Effort:
        """Run ccx on one thread; `seconds` is its processor time, user and system."""
        if PROGRAM is None:
            raise Failed(MISSING)
        one = {name: "1" for name in ("OMP_NUM_THREADS", "CCX_NPROC_STIFFNESS")}
        before = _children()
        done = subprocess.run(
            [PROGRAM, "-i", "job"],
            cwd=self.job.parent,
            env=os.environ | one,
            capture_output=True,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST,) * 2),
        )
        self.seconds = _children() - before
        if done.returncode in (-signal.SIGKILL, -signal.SIGXCPU):
            raise Failed(f"took more than {LONGEST} s")
        found = results.effort(self._read(".cvg"), self._read(".sta"))
        times, _ = results.totals(self._read(".dat"))
        end = self.case.legs[-1][0]
        if not len(times) or times[-1] < end * (1.0 - 1e-6):
            said = [line for line in done.stdout.splitlines() if "*ERROR" in line]
            why = said[-1].strip() if said else "no message"
            reached = times[-1] if len(times) else 0.0
            raise Failed(
                f"ended with {done.returncode} at time {reached:g} after "
                f"{found.iterations} iterations, {found.cutbacks} cutbacks: {why}"
            )
        return found

    def found(self) -> Found:
        """Reactions of all increments, the contact pressures of the last."""
        case, frd = self.case, self.job.with_suffix(".frd")
        times, forces = results.totals(self._read(".dat"))
        nodes, columns, values = results.last_field(frd, "CONTACT")
        p = values[:, columns.index("CPRESS")]
        known, x = results.places(frd)
        at = dict(zip(known, x[:, : case.dim]))
        at_forces = times, np.abs(forces[:, : case.dim])
        placed = np.isin(nodes, known)
        if not placed.any():
            # In the plane, node to surface has nodes in this field without a place
            vertices = case.places[case.vertices[0]]
            return Found(*at_forces, vertices, np.full(len(vertices), np.nan))
        nodes, p = nodes[placed], p[placed]
        x = np.array([at[node] for node in nodes])
        if case.dim == 3:
            # The two bodies may have nodes in one place
            slave = np.isin(nodes, case.vertices[0] + 1)
            x, p = x[slave], p[slave]
        return Found(*at_forces, *case.pressures(x, p))


def _children() -> float:
    """Processor time of processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
