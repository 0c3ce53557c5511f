"""The user's forms with inertia, in place of a problem's volume within a time step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from ..compat import Array, Mask
from ..problem import CoupledProblem
from .motion import Motion

_PART = PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN
_OTHER = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN


class MovingVolume:
    """Residual and tangent of a problem's forms and of inertia. Collective.

    It answers what `Volume` answers, and asks that for the forms.

    Parameters
    ----------
    problem
        Problem whose matrices get room for inertia.
    motion
        Motion whose step is solved.
    """

    def __init__(self, problem: CoupledProblem, motion: Motion) -> None:
        self._problem: Any = problem
        self._motion, self.given = motion, self._problem.volume
        self.L, self.a, self.updated = self.given.L, self.given.a, self.given.updated
        self.has_several = self.given.has_several
        self._sum: Any = None
        self._of: tuple[Any, ...] = ()
        self.revision = 0
        problem.make_room_for(motion.inertia.matrix)

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Put inertia into the problem."""
        self._problem.volume = self
        try:
            yield
        finally:
            self._problem.volume = self.given

    @property
    def is_linear(self) -> bool:
        """Whether all of the tangent is kept."""
        return self.given.is_linear

    @property
    def kept(self) -> Any:
        """The keeper of a linear tangent: this object, or None."""
        return self if self.is_linear else None

    @property
    def tangent(self) -> PETSc.Mat:
        """Sum of the kept tangent and of inertia between free unknowns."""
        return self._sum

    def with_form_of_u(self, L: Any, a: Any) -> tuple[Any, Any]:
        """Replace the forms in the displacement's test function by L and a."""
        return self.given.with_form_of_u(L, a)

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Residual at the present state, with inertia where the step was solved.
        Collective."""
        found = self.given.forces(bcs)
        found += self._motion.inertia_now()
        return found

    @property
    def inertia_terms(self) -> Array | None:
        """Force of inertia that a unit of each owned unknown of the forms takes, (n,)."""
        return self._motion.unit_forces

    def residual(self, bcs: Sequence[Any], increment: Array | None) -> Array:
        """Residual of the owned unknowns, with the effect of prescribed increments if
        they are given. Collective."""
        unknowns = self._problem.contact.unknowns
        values = unknowns.owned_values()
        if increment is not None:
            values += unknowns.owned_part(increment)
        found = self.given.residual(bcs, increment)
        found += self._motion.forces(values)
        return found

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, with ones for constrained unknowns. Collective."""
        fixed = self._problem.contact.unknowns.owned_prescribed(bcs)
        M, factor = self._motion.inertia.between_free(fixed), self._factor
        if not self.is_linear:
            A.axpy(factor, M, _PART)
            self.given.add_tangent(A, bcs)
            return
        self._add_up(M, factor, fixed)
        A.axpy(1.0, self._sum, _PART)

    @property
    def _factor(self) -> float:
        """Factor of the mass in the tangent."""
        return self._motion.equation.factor

    def _add_up(self, M: PETSc.Mat, factor: float, fixed: Mask) -> None:
        """Add inertia to the kept tangent, unless nothing has changed."""
        kept = self.given.kept
        kept.renew(fixed)
        of = kept.revision, self._motion.inertia.revision, factor
        if of == self._of:
            return
        if self._sum is not None:
            self._sum.destroy()
        self._of, self._sum = of, kept.tangent.copy()
        self._sum.axpy(factor, M, _OTHER)
        self.revision += 1
