"""Paths that a chosen displacement or the length of the path leads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from ..core import compat
from ..core.compat import Array, Mask
from ..core.convergence.balance import EPS
from ..core.discretization.ranks import largest
from ..core.errors import ConvergenceError, raise_everywhere, require_agreement
from ..core.solvers.solver import forwarded
from ..core.state import State
from ..diagnose.failure import in_use_of, one_of, ways_to_hold
from ..diagnose.lost_contact import loose_bodies
from ..solvers.one_tangent import correct, linearise
from .controls import DisplacementControl, mean_weights
from .load_path import PrescribedPath

# Change of the load factor, as a share of the path, for difference quotients. Only loads
# and prescribed displacements are differentiated, linear in the residual
CHANGE = 1e-6
# Share of the largest displacement below which the loads count as not moving the
# displacement that leads
NO_CHANGE = 1e-12
# Tolerance of the equation that leads, as a share of the step
TOLERANCE = 1e-10

# Of displacement (owned dofs and ghosts) and load factor
Change = tuple[Array, float]


class LedPath(PrescribedPath, ABC):
    """Leads steps by a further equation; the load factor is an unknown. Collective.

    Newton's method goes from u to u - X and from t to t + dt. The equation is
    g X = c + e dt. Each iteration solves three times with one factorised tangent: for
    the residual, for its derivative by the load factor, and for a spring that keeps the
    tangent regular. `trial` is the load factor of the present iterate. It is a solver of
    steps, with the settings of the given one.
    """

    has_parts = False

    tolerances = forwarded("_given", "tolerances", "rtol and atol.")
    max_it = forwarded("_given", "max_it", "Most iterations.")

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.problem = self._given.problem
        self._contact, self._comm = self.problem.contact, self.problem.comm
        self._u, self._n = self._contact.u, self._contact.layout.n_u
        self._change = CHANGE * (self._ends[1] - self._ends[0])
        self.trial = self._before = self.factor
        self._done = 0.0  # `time` at the start, of a path that goes on

    @abstractmethod
    def row(self) -> tuple[Array, float, float]:
        """Return g (owned dofs), e and c of the equation. Collective."""

    @abstractmethod
    def is_met(self) -> bool:
        """Whether the equation is met, to rounding. Collective."""

    def share(self, change: Array, step: float) -> float:
        """Return the share of a correction that is applied. Collective."""
        return 1.0

    def check(self) -> None:
        """Refuse solutions that do not go on along the path. Collective."""

    @property
    def solver(self) -> Any:
        return self

    @property
    def led(self) -> Mask:
        """Whether an owned dof of u leads; an arc's length counts all."""
        weights = self.led_weights
        return np.ones(self._n, dtype=bool) if weights is None else weights != 0.0

    @property
    def next(self) -> float:
        """Load factor at the start of the step, as its end is not known."""
        return self.factor

    @property
    def passed(self) -> float:
        """`time` at the end of the last step."""
        return self.time

    def begin(self) -> None:
        self.trial = self.factor

    def restart(self) -> None:
        self.trial = self.factor
        self._load(self.factor)

    def extrapolate(self, ratio: float) -> None:
        self.trial = self.factor + ratio * (self.factor - self._before)

    def reached(self) -> None:
        self._before, self.factor = self.factor, self.trial

    def describe(self) -> str:
        return f"the step after load factor {self.factor:.6g} failed"

    def remember(self) -> list[float]:
        return [
            *self._ends,
            self.factor,
            *self.sizes.remember()[:4],
            self._before,
            self.passed,
        ]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        begin, end, factor = numbers[:3]
        if len(numbers) < 9 or self._ends != (factor, end):
            return
        self._change = CHANGE * (end - begin)
        self.sizes.recall(numbers[3:7], as_rest=False)
        self._before, self._done = numbers[7:9]

    def _load(self, factor: float) -> None:
        self._apply(factor, factor - self.factor)

    def _rounding(self) -> float:
        """Find the rounding error of displacements. Length. Collective."""
        return 256.0 * EPS * largest(self._comm, np.abs(self._u.x.array))

    def solve(self) -> tuple[int, bool]:
        """Solve from the present displacement, multiplier and load factor."""
        given = self._given
        require_agreement(self._comm, max_it=given.max_it, rtol=given.tolerances)
        iterations: int = given.iterate_by(self._iterate, 4)
        self.check()
        return iterations, True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, *work: PETSc.Vec
    ) -> tuple[int, str | None]:
        """Return the iterations and why they failed, None if they converged."""
        given, convergence = self._given, self.problem.convergence
        rtol, atol = given.tolerances[0], given.force_tolerance
        iteration = 0
        while True:
            self._load(self.trial)
            self.problem.F(x, b)
            # The first residual is no measure: a step starts from a solution
            if iteration:
                convergence.accept()
            if convergence.reached(rtol, atol) and self.is_met():
                return iteration, None
            if convergence.is_stuck:
                return iteration, ", and was stopped"
            if iteration == given.max_it:
                return iteration, ""
            if not self._correct(x, b, *work):
                return iteration, " (the linear solver failed)"
            iteration += 1

    def _correct(self, x: PETSc.Vec, b: PETSc.Vec, *work: PETSc.Vec) -> bool:
        """Move to the next iterate; return False if there is none. Collective.

        The change -X of x has A X = b + dt slope, and g X = c + e dt. A spring s at the
        dof k to which g gives most weight keeps A regular where it is not, at limit
        points and where nothing but contact holds what leads: with z = s A^-1 e_k,
        X = A^-1 b + dt A^-1 slope + X_k z.
        """
        given, n, (slope, b_step, slope_step) = self._given, self._n, work
        self._differentiate(slope, b_step)
        g, by_factor, right = self.row()
        spring = self._spring(g)
        linearise(given, x, spring)
        correct(given, b, b_step)
        correct(given, slope, slope_step)
        slope.set(0.0)
        for row, stiffness in spring.items():
            slope[row] = stiffness
        slope.assemble()
        correct(given, slope, b)
        solved = [v.getArray(readonly=True)[:n] for v in (b_step, slope_step, b)]
        k = [row - self._contact.layout.begin for row in spring]
        # Product with g, and entry at the spring, of each solution
        table = np.array([[g @ v, v[k].sum()] for v in solved])
        self._comm.Allreduce(MPI.IN_PLACE, table)
        if not np.isfinite(table).all():
            return False
        of_b, of_slope, of_spring = table
        system = np.array([of_slope - [by_factor, 0.0], of_spring - [0.0, 1.0]]).T
        weight, way = (largest(self._comm, np.abs(one)) for one in (g, solved[1]))
        scaled = system / np.outer([weight or 1.0, 1.0], [way or 1.0, 1.0])
        if abs(np.linalg.det(scaled)) <= NO_CHANGE:
            raise ConvergenceError(self._why_not_led(g, weight > 0.0))
        step, moved = np.linalg.solve(system, [right, 0.0] - of_b)
        b_step.axpy(step, slope_step)
        b_step.axpy(moved, b)
        share = self.share(b_step.getArray(readonly=True), step)
        x.axpy(-share, b_step)
        self.trial += share * step
        return True

    def _why_not_led(self, g: Array, leads: bool) -> str:
        """Say why the loads do not move the displacement that leads. Collective."""
        blames = "the loads do not move what leads the path"
        loose = loose_bodies(self.problem, g)
        if not loose:
            return (
                f"{blames}: is what was chosen of a loaded body, or touched by one, and "
                "free to move?"
            )
        # The displacement that leads may belong to another body, and hold none of these
        if leads and loose == loose_bodies(self.problem):
            text = f"{blames}: {'; '.join(loose)}"
        else:
            text = f"{'; '.join(loose)}: what leads the path does not hold that"
        return f"{text}. Try {one_of(ways_to_hold(in_use_of(self.problem)))}"

    def _spring(self, g: Array) -> dict[int, float]:
        """Place a spring at the free dof of most weight, on its rank. Collective."""
        weights = np.where(self.problem.constrained, 0.0, np.abs(g))
        mine = float(weights.max(initial=0.0))
        most, rank = self._comm.allreduce((mine, self._comm.rank), op=MPI.MAXLOC)
        if most == 0.0 or rank != self._comm.rank:
            return {}
        k = int(np.argmax(weights))
        return {
            self._contact.layout.begin + k: self._contact.system.stiffness_diagonal[k]
        }

    def _differentiate(self, slope: PETSc.Vec, loads: PETSc.Vec) -> None:
        """Differentiate the last residual by the load factor; overwrite `loads`."""
        motions = [zone.motions for zone in self._contact.zones]
        self.problem.loads(loads)
        was = [one.present() for one in motions]
        self._load(self.trial + self._change)
        moved = not all(np.array_equal(m.present(), w) for m, w in zip(motions, was))
        self.problem.loads(slope)
        self._load(self.trial)
        message = (
            "control leads loads and prescribed displacements, and apply moves a rigid "
            "body: let apply leave bodies where they are, and move what they touch"
        )
        raise_everywhere(self._comm, message if moved else None)
        slope.axpy(-1.0, loads)
        slope.scale(1.0 / self._change)


class DisplacementPath(LedPath):
    """Lead steps by a mean displacement or a functional. Collective."""

    def __init__(self, control: DisplacementControl, *given: Any) -> None:
        super().__init__(*given)
        self._by, self._functional = float(control.by), None
        if isinstance(control.where, ufl.Form):
            test = ufl.TestFunction(self._u.function_space)
            slope = ufl.derivative(control.where, self._u, test)
            self._functional = compat.form(control.where), compat.form(slope)
        else:
            self._weights = mean_weights(control, self._u)
        self._begin = self._target = self.controlled

    @property
    def controlled(self) -> float:
        """Chosen displacement at present. Length. Collective."""
        if self._functional is None:
            mine = self._weights @ self._u.x.array[: self._n]
        else:
            mine = fem.assemble_scalar(self._functional[0])
        return float(self._comm.allreduce(float(mine)))

    @property
    def led_weights(self) -> Array:
        """Derivative of the chosen displacement by the owned dofs. Collective."""
        if self._functional is None:
            return self._weights
        dofmap = self._u.function_space.dofmap
        r = compat.create_la_vector(dofmap.index_map, dofmap.index_map_bs)
        compat.assemble_residual(r.array, self._functional[1])
        compat.scatter_reverse_add(r)
        return r.array[: self._n].copy()

    @property
    def time(self) -> float:
        """Share of the whole growth of the displacement."""
        return self._done + (1.0 - self._done) * self.sizes.share

    @property
    def passed(self) -> float:
        return self._done + (1.0 - self._done) * self.sizes.done

    def begin(self) -> None:
        super().begin()
        self._target = self._begin + self.sizes.share * self._by

    def row(self) -> tuple[Array, float, float]:
        return self.led_weights, 0.0, self.controlled - self._target

    def is_met(self) -> bool:
        weight = float(self._comm.allreduce(np.abs(self.led_weights).sum()))
        allowed = (
            TOLERANCE * abs(self.sizes.part * self._by) + weight * self._rounding()
        )
        return abs(self.controlled - self._target) <= allowed
