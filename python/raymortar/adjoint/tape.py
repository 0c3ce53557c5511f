"""Gradients along a path: accepted steps are recorded, and gone through backwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError, SetUpError, raise_everywhere, together
from ..core.state import State
from ..paths.load_steps import LoadSteps
from .forms import residuals
from .functionals import Functional, Sum, as_functional
from .gradients import add_derivatives, check_state, checked, refuse, results
from .linear import Linearised


@dataclass
class Record:
    """An accepted step: the state after it, and what its solve depended on."""

    state: State
    data: list[tuple[Any, Array]]  # Functions and Constants of the forms, values
    motions: list[tuple[Any, Array, Array]]  # bodies, their translations and rotations

    def set_data(self) -> None:
        """Set all that the solve depended on besides the state."""
        for array, values in self.data:
            array[...] = values
        for body, moved, turned in self.motions:
            body.cpp.moved, body.cpp.turned = moved, turned


class Tape:
    """Records the steps of a path, for gradients of sums over its steps. Collective.

    Parameters
    ----------
    steps
        `LoadSteps`, whose accepted steps are recorded: iterate over the tape, or call
        `run`, in their place. Or a problem: call `record` after each
        ``contact.advance()``.

    Attributes
    ----------
    problem
        The problem.

    Raises
    ------
    SetUpError
        With friction and a multiplier at points: take `Penalty` or
        ``AugmentedLagrangian(condition="nodes")``.

    Examples
    --------
    >>> tape = adjoint.Tape(LoadSteps(solver, apply, steps=10))
    >>> tape.run()
    >>> f = adjoint.force(contact, axis=0)
    >>> error = tape.values(f) - measured
    >>> g = tape.gradient(f, [E, adjoint.friction(contact)], weights=error)
    """

    def __init__(self, steps: Any) -> None:
        self._steps = steps if isinstance(steps, LoadSteps) else None
        problem = steps.solver.problem if self._steps is not None else steps
        self.problem = getattr(problem, "coupled", problem)
        if not hasattr(self.problem, "contact"):
            raise ContactError(f"steps must be LoadSteps or a problem, not {steps!r}")
        with together(self.problem.comm):
            refuse(self.problem)
            if self._steps is not None and self._steps.control is not None:
                raise ContactError(
                    f"Tape: {type(self._steps.control).__name__} makes the load factor "
                    "an unknown, which has no derivative here"
                )
        self._records = [self._present()]

    def __len__(self) -> int:
        return len(self._records) - 1

    def __iter__(self) -> Iterator[Any]:
        """Solve step by step, and record each step before it is yielded."""
        if self._steps is None:
            raise ContactError("the tape has no LoadSteps: call record after each step")
        for step in self._steps:
            self.record()
            yield step

    def run(self) -> list[Any]:
        """Solve and record all steps."""
        return list(self)

    def record(self) -> None:
        """Record the step that has just been accepted."""
        self._require_slips_alone()
        self._records.append(self._present())

    def values(self, J: Any) -> Array:
        """Values of a functional at the ends of all steps, (steps,); of a list of them
        (functionals, steps). Collective."""
        functionals = _functionals(J)
        end, found = self.problem.contact.states.state(), []
        for n in range(1, len(self._records)):
            self._go_to(n)
            found.append([one.value(self.problem) for one in functionals])
        self._leave(end)
        table = np.array(found).reshape(-1, len(functionals)).T
        return table if isinstance(J, (list, tuple)) else table[0]

    def gradient(self, J: Any, controls: Any, weights: Any = None) -> Any:
        """Differentiate the sum over all steps of a weight times a functional.

        Parameters
        ----------
        J
            Functional, as for `adjoint.gradient`, taken at the end of each step; or a
            list of them.
        controls
            As for `adjoint.gradient`. They are the same in all steps.
        weights
            Weight of each step, as `values` has them; None: the last step alone counts.

        Returns
        -------
        As `adjoint.gradient`.
        """
        functionals = _functionals(J)
        factors = self._checked_weights(weights, len(functionals))
        whole = Sum(functionals, [1.0] * len(functionals))
        problem, _, those = checked(self.problem, whole, controls)
        found = [one.start(problem) for one in those]
        end, carried, springs = problem.contact.states.state(), None, None
        for n in reversed(range(1, len(self._records))):
            self._go_to(n)
            at = Linearised(problem)
            check_state(problem, those)
            part = Sum(functionals, factors[:, n - 1].tolist())
            right = part.by_unknowns(at)
            if carried is not None and springs is not None:
                right.axpy(-1.0, carried)
                carried.destroy()
                at.springs = springs
                more = problem.create_vector()
                at.take_springs(more, problem.contact.zones, "unknowns")
                right.axpy(-1.0, more)
                more.destroy()
            weighed = add_derivatives(at, part, right, those, found)
            # Slips are measured from the accepted step [theory (8.5)]
            carried = at.by_parameter(problem.contact.zones, "old")
            springs = at.springs_back()
            destroy(weighed, right)
            at.destroy()
        if carried is not None:
            carried.destroy()
        self._leave(end)
        return results(controls, those, found)

    # States

    def _present(self) -> Record:
        """Copy the state, and what a solve takes besides."""
        problem = self.problem
        unknowns, data = problem.contact.unknowns.functions, []
        for form in (form for form in residuals(problem) if form is not None):
            for f in form.coefficients():
                if not any(f is one for one in unknowns):
                    data.append((f.x.array, f.x.array.copy()))
            data += [(c.value, np.array(c.value)) for c in form.constants()]
        bodies = dict.fromkeys(
            b for z in problem.contact.zones for b in z.facets.bodies
        )
        motions = [(b, b.cpp.moved.copy(), b.cpp.turned.copy()) for b in bodies]
        return Record(problem.contact.states.state(), data, motions)

    def _go_to(self, n: int) -> None:
        """Go to the end of a step, before it was accepted. Collective."""
        record, states = self._records[n], self.problem.contact.states
        record.set_data()
        unknown = {one.name for one in states.changing()}
        both = self._records[n - 1].state, record.state
        found = {k: both[k in unknown].get(k) for k in {**both[0], **both[1]}}
        states.restore(State((k, v) for k, v in found.items() if v is not None))

    def _leave(self, state: State) -> None:
        """Go back to the end of the path. Collective."""
        self._records[-1].set_data()
        self.problem.contact.states.restore(state)

    def _require_slips_alone(self) -> None:
        """Raise where a step hands on more than positions. Collective."""
        message = None
        for one in self.problem.contact.contacts:
            spoken = " and ".join(zone.facets.spoken for zone in one.zones)
            if getattr(one.friction, "elastic_slip", 0.0) > 0.0:
                message = (
                    f"Tape: elastic_slip of {spoken} is kept from step to step, which "
                    "has no derivative here: leave it out of Coulomb"
                )
            if "slip" in getattr(one.friction, "arguments", ()):
                message = (
                    f"Tape: the bound of friction of {spoken} depends on the slip of "
                    "all steps, which has no derivative here: leave out the argument slip"
                )
        for zone in self.problem.contact.zones:
            held, points = zone.traction_old, zone.spring_points
            if zone.frictional and zone.cpp.unfelt().any():
                message = (
                    f"Tape: both sides of {zone.facets.spoken} are held somewhere along "
                    "the surface, where friction carries on from the accepted step, "
                    "which has no derivative here"
                )
            if zone.frictional and _holds(held) and (points is None or not len(points)):
                message = (
                    f"Tape: {zone.facets.spoken} hands on lengths from step to step, by "
                    "which a multiplier's friction lags, which have no derivative here: "
                    "take Penalty or AugmentedLagrangian(condition='nodes')"
                )
        raise_everywhere(self.problem.comm, message, SetUpError)

    def _checked_weights(self, weights: Any, functionals: int) -> Array:
        """Weights by functional and step."""
        count = len(self)
        if weights is None:
            return np.tile(np.eye(count)[-1:], (functionals, 1))
        found = np.asarray(weights, dtype=np.float64)
        if found.size != functionals * count or found.shape[-1] != count:
            raise ContactError(
                f"weights of shape {found.shape} must be as values(J) is, of "
                f"{functionals} functionals and {count} steps"
            )
        return found.reshape(functionals, count)


def _holds(springs: Array | None) -> bool:
    """Whether springs hold anything."""
    return springs is not None and bool(np.abs(springs).max(initial=0.0) > 0.0)


def _functionals(J: Any) -> list[Functional]:
    """One functional, or several, as a list."""
    return [as_functional(one) for one in (J if isinstance(J, (list, tuple)) else [J])]
