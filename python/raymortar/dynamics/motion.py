"""Displacements, velocities and accelerations of accepted steps, and how they go on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array, Mask
from ..core.discretization.ranks import destroy
from ..core.discretization.unknowns import Lacking
from ..core.errors import ConvergenceError, raise_everywhere
from ..core.problem import CoupledProblem
from ..core.state import Quantity, of_function
from ..core.terms import Term
from ..mass.inertia import Inertia, owned_values
from .rest import conjugate_gradients
from .schemes import (
    GeneralizedAlpha,
    Midpoint,
    Scheme,
    StepEquation,
    end_of_step,
    velocity_in_step,
)


@dataclass(frozen=True)
class End:
    """Owned unknowns for which a step was solved and at its end, velocities and
    accelerations there, (n,) each."""

    solved: Array
    u: Array
    v: Array
    a: Array


class Motion:
    """Velocities, accelerations and forces that a step starts from. Collective.

    Nothing of it changes until a step is accepted. Velocities and accelerations of
    massless nodes are those of the nodes that stand for them.

    Parameters
    ----------
    inertia
        Inertia of the problem's bodies.
    scheme
        Time integration scheme.

    Attributes
    ----------
    velocity, acceleration, static, middle
        Functions in the spaces of the unknowns: v and a at the accepted step, forces
        without inertia there, damping included (`GeneralizedAlpha`), and the middle of the last step
        (`Midpoint`).
    equation
        Equation of the step that was begun.
    dt, last
        Size of the step that was begun, and of the accepted one before (0: none).
    rate
        Derivative of the velocity in the step that was begun by the unknowns.
    begun
        Owned unknowns at the accepted step, (n,).
    unit_forces
        Force of inertia and damping that a unit of each owned unknown takes alone in the
        step that was begun, (n,).
    fastest
        Largest norm of velocities so far, by `size`.
    was_read
        Whether velocities are those of a state that was restored.
    """

    def __init__(self, inertia: Inertia, scheme: Scheme) -> None:
        self.inertia, self.scheme = inertia, scheme
        self._unknowns = inertia.contact.unknowns
        self.velocity = self.functions("velocity")
        self.acceleration = self.functions("acceleration")
        self.static = self.functions("static forces")
        self.middle = self.functions("middle")
        self.equation = StepEquation(0.0, 0.0, 0.0, 0.0, 0.0)
        self.dt = self.last = self.fastest = self.rate = 0.0
        self._shift = self._drift = self.begun = self.unit_forces = np.zeros(0)
        self.was_read = False

    def functions(self, name: str) -> list[Function]:
        """Zero Functions in the spaces of the unknowns."""
        functions = self._unknowns.functions
        one = len(functions) == 1
        return [
            Function(f.function_space, name=name if one else f"{name} of {f.name}")
            for f in functions
        ]

    @property
    def fields(self) -> list[Function]:
        """Functions that a step starts from besides the unknowns."""
        found = [*self.velocity, *self.acceleration]
        if isinstance(self.scheme, GeneralizedAlpha):
            found += self.static
        return found + self.middle * isinstance(self.scheme, Midpoint)

    def quantities(self) -> Iterator[Quantity]:
        """Yield `fields`, the size of the accepted step and `fastest`."""
        for f in self.fields:
            yield of_function(f.name, f)

        def write(values: Array) -> None:
            self.last, self.fastest = values.tolist()
            self.was_read = True

        yield Quantity("speed", lambda: np.array([self.last, self.fastest]), write)

    def values(self, of: Sequence[Function]) -> Array:
        """Owned values of Functions, one after the other, (n,)."""
        sizes = np.diff(self._unknowns.owned_starts)
        return np.concatenate([f.x.array[:n] for f, n in zip(of, sizes)])

    def set(self, of: Sequence[Function], values: Array) -> None:
        """Set owned values of Functions and their ghosts. Collective."""
        starts = self._unknowns.owned_starts
        for f, begin, end in zip(of, starts, starts[1:]):
            f.x.array[: end - begin] = values[begin:end]
            f.x.scatter_forward()

    @contextmanager
    def at(self, values: Array) -> Iterator[None]:
        """Give the unknowns other owned values, (n,), for a while. Collective."""
        with self._unknowns.lent():
            self.set(self._unknowns.functions, values)
            self._unknowns.pull()
            yield

    # Start

    def set_velocity(self, given: Sequence[Function]) -> None:
        """Take the velocities that motion starts with. Collective."""
        values = owned_values(self._unknowns, given, "velocity")
        self.set(self.velocity, self.inertia.smooth(values))

    def set_acceleration(self, static: Array, fixed: Mask) -> None:
        """Find the accelerations that motion starts with, from forces without inertia
        and damping, (n,), where unknowns are not prescribed [theory (6.8)]. Collective.
        """
        comm, n = self._unknowns.comm, len(static)
        massive = self.inertia.is_massive & ~fixed
        # Forces on massless nodes are passed on, so that no momentum is lost
        pushed = self.inertia.gather(np.where(fixed, 0.0, -static))
        pushed -= self.inertia.damped(self.values(self.velocity))
        # Singular, but nothing pushes where it is: there a stays zero
        A = self.inertia.only_between(massive)
        x, b = A.createVecs()
        b.array[:] = 0.0
        b.array[:n] = np.where(massive, pushed, 0.0)
        ksp = conjugate_gradients(A)
        ksp.solve(b, x)
        found, reason = x.array_r[:n].copy(), ksp.getConvergedReason()
        destroy(ksp, A, x, b)
        text = "the initial accelerations have not been found: is some mass negative?"
        raise_everywhere(comm, text if reason < 0 else None, ConvergenceError)
        self.set(self.acceleration, self.inertia.smooth(found))
        self.set(self.static, -self.inertia.times(found))

    # Steps

    def begin(self, dt: float) -> None:
        """Begin a step from the present unknowns, which are the accepted ones.
        Collective."""
        self.dt, self.equation = dt, self.scheme.equation(dt)
        one, self.begun = self.equation, self._unknowns.owned_values()
        begun, v, a = self._begin()
        self._shift = one.shift(begun, v, a)
        self.rate, start = velocity_in_step(self.scheme, dt, v, a)
        self._drift = start - self.rate * begun
        self.unit_forces = one.factor * self.inertia.diagonal()
        self.unit_forces += self.rate * self.inertia.damping_diagonal()

    def forces(self, values: Array) -> Array:
        """Forces of inertia, of damping and of accepted steps, at values of the owned
        unknowns, (n,) [theory (6.6), (6.20)]. Collective."""
        found = self.inertia.times(self.equation.factor * values + self._shift)
        found += self.damping(values)
        if self.equation.kept:
            found += self.equation.kept * self.values(self.static)
        return found

    def damping(self, values: Array) -> Array:
        """Forces of damping at values of the owned unknowns for which the step is
        solved, (n,) [theory (6.20)]. Collective."""
        if not self.inertia.is_damped:
            return np.zeros(len(values))
        return self.inertia.damped(self.rate * values + self._drift)

    def damping_now(self) -> Array:
        """Forces of damping at the present unknowns, for which the step was solved, (n,).
        Collective."""
        return self.damping(self._unknowns.owned_values())

    def inertia_now(self) -> Array:
        """Forces of inertia at the present unknowns, for which the step was solved,
        (n,). Collective."""
        values = self._unknowns.owned_values()
        if isinstance(self.scheme, Midpoint):
            return self.inertia.times(self.equation.factor * values + self._shift)
        return self.inertia.times(self.end().a)

    def end(self) -> End:
        """Find the end of the solved step, which the present unknowns are, or the
        middle of which [theory (6.7), (6.9)]. Collective."""
        values = self._unknowns.owned_values()
        end, v, a = end_of_step(self.scheme, self.dt, self._begin(), values)
        if isinstance(self.scheme, Midpoint) and self.last > 0.0:
            # Values without mass have no velocity of their own, and go on as their last
            # two middles [theory (6.10)]
            on = self.dt / (self.dt + self.last)
            straight = values + on * (values - self.values(self.middle))
            end = np.where(self.inertia.is_massive, end, straight)
        return End(values, end, self.inertia.smooth(v), self.inertia.smooth(a))

    def _begin(self) -> tuple[Array, Array, Array]:
        """Values, velocities and accelerations at the accepted step, (n,) each."""
        v, a = self.values(self.velocity), self.values(self.acceleration)
        return self.begun, v, a

    def accept(self, end: End, prescribed: tuple[Mask, Array]) -> None:
        """Go over to the end of the solved step, of `end`. Collective.

        Parameters
        ----------
        end
            End of the step.
        prescribed
            Whether conditions prescribe an owned unknown, and its value at the end of
            the step, (n,).
        """
        solved = end.solved
        self.set(self.static, self.damping(solved) - self.forces(solved))
        self.set(self.velocity, end.v)
        self.set(self.acceleration, end.a)
        if isinstance(self.scheme, Midpoint):
            self.set(self.middle, end.solved)
            self.set(self._unknowns.functions, np.where(*prescribed, end.u))
            self._unknowns.pull()
        self.last = self.dt
        self.fastest = max(self.fastest, self.size(end.v))

    def error(self, end: End) -> float:
        """Estimate the local error of the displacement at the end of a step, over its
        motion by the largest velocity: the mean of all mass. Collective."""
        share = abs(self.scheme.beta - 1.0 / 6.0)
        wrong = share * self.dt**2 * (end.a - self.values(self.acceleration))
        moved = self.dt * max(self.size(end.v), self.fastest)
        return self.size(wrong) / moved if moved > 0.0 else 0.0

    def size(self, values: Array) -> float:
        """Norm of values of the owned unknowns by the mass. Collective."""
        square = float(values @ self.inertia.times(values))
        return float(np.sqrt(max(self._unknowns.comm.allreduce(square), 0.0)))


_PART = PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN
_OTHER = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN


class InertiaTerm(Term):
    """Forces of inertia and damping among the equations of a problem. Collective.

    Attributes
    ----------
    tangent, revision
        Sum of the kept tangent of linear forms and of inertia and damping between free
        unknowns, and the number of such sums so far, see `CoupledProblem.kept`.
    """

    spoken = "forces of inertia"
    is_linear = True

    def __init__(self, problem: CoupledProblem, motion: Motion) -> None:
        self._problem, self._motion = problem, motion
        self.tangent: Any = None
        self._of: tuple[Any, ...] = ()
        self.revision = 0
        motion.inertia.begin(problem.prescribed)
        for M in (motion.inertia.matrix, motion.inertia.damping_matrix):
            if M is not None:
                problem.make_room_for(M)

    def acting(self) -> AbstractContextManager[None]:
        """Put inertia into the problem."""
        return self._problem.extended_by(self)

    @property
    def unit_forces(self) -> Array:  # type: ignore[override]
        """Force of inertia and damping that a unit of each owned unknown of the forms
        takes, (n,)."""
        return self._motion.unit_forces

    def residual(self, bcs: Sequence[Any], lacking: Lacking) -> Array:
        """Forces of inertia and damping where the unknowns meet the conditions, (n,)."""
        unknowns = self._problem.contact.unknowns
        values = unknowns.owned_values() + unknowns.owned_part(lacking.increment)
        return self._motion.forces(values)

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Forces of inertia and damping where the step was solved, (n,)."""
        return self._motion.inertia_now() + self._motion.damping_now()

    def add_matrices(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the derivative between free unknowns."""
        for factor, M in self._parts(bcs):
            A.axpy(factor, M, _PART)

    def _parts(self, bcs: Sequence[Any]) -> list[tuple[float, PETSc.Mat]]:
        """Mass and damping between free unknowns, each with its factor in the step."""
        motion = self._motion
        fixed = self._problem.contact.unknowns.owned_prescribed(bcs)
        found = motion.inertia.between_free(fixed)
        return list(zip((motion.equation.factor, motion.rate), found))

    def keep(self, kept: Any) -> Any:
        """The keeper of the tangent with inertia: this object."""
        bcs = self._problem.bcs
        kept.renew(self._problem.contact.unknowns.owned_prescribed(bcs))
        parts = self._parts(bcs)
        of = kept.revision, self._motion.inertia.revision, *(f for f, _ in parts)
        if of != self._of:
            destroy(self.tangent)
            self._of, self.tangent = of, kept.tangent.copy()
            for factor, M in parts:
                self.tangent.axpy(factor, M, _OTHER)
            self.revision += 1
        return self
