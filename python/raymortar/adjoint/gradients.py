"""The gradient of a functional at a converged state, and what makes one of a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from weakref import WeakKeyDictionary

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..condensed.condensed_problem import CondensedProblem
from ..core.compat import Array
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError, SetUpError, require_agreement, together, warn
from ..core.problem import CoupledProblem
from .controls import Control, as_control
from .forms import actions, all_forms, values_of_adjoint
from .functionals import Functional, as_functional
from .kinks import at_kink
from .linear import Linearised

# Kinks of problems that have been told
_told: WeakKeyDictionary[Any, set[str]] = WeakKeyDictionary()


def gradient(J: Any, problem: Any, controls: Any) -> Any:
    """Differentiate a functional at the present state of a problem. Collective.

    Call it after a solve and before ``contact.advance()``. One transposed solve
    gives the derivatives by all controls: dJ/dm = J_m - lam^T F_m [theory (8.3)].

    Parameters
    ----------
    J
        Functional in UFL, of unknowns and coefficients; or one of this package, such as
        `force`.
    problem
        `NonlinearProblem` or `CondensedProblem`.
    controls
        List of Constants and Functions of the forms or of J, and of `offset`,
        `friction`, `gamma`, `radius`, `place`, `coordinates`; or a single one.

    Returns
    -------
    A list by control (of a single one not in a list): a number or an array for a
    Constant, for a Function a Function of its space, whose dofs are the derivatives by
    its dofs.

    Raises
    ------
    ContactError
        For a functional or a control that has no derivative here.
    SetUpError
        If the present state does not solve the problem.
    """
    problem, functional, those = checked(problem, J, controls)
    _refuse_accepted(problem)
    found = [one.start(problem) for one in those]
    at = Linearised(problem)
    at.require_converged()
    check_state(problem, those)
    right = functional.by_unknowns(at)
    add_derivatives(at, functional, right, those, found).destroy()
    destroy(right)
    at.destroy()
    return results(controls, those, found)


def checked(
    problem: Any, J: Any, controls: Any
) -> tuple[CoupledProblem, Functional, list[Control]]:
    """Check the arguments of a gradient. Collective."""
    problem = problem.coupled if isinstance(problem, CondensedProblem) else problem
    if not isinstance(problem, CoupledProblem):
        raise ContactError(
            "problem must be a NonlinearProblem or a CondensedProblem, not "
            f"{type(problem).__name__}"
        )
    several = isinstance(controls, (list, tuple))
    with together(problem.comm):
        functional = as_functional(J)
        those = [as_control(one) for one in (controls if several else [controls])]
        for one in those:
            if any(one.is_value_of(bc) for bc in problem.bcs):
                raise ContactError(
                    "controls: a value of a Dirichlet condition has no derivative here"
                )
        for contact in functional.contacts:
            if not any(contact is one for one in problem.contact.contacts):
                raise ContactError("J is of a contact that is none of the problem's")
        refuse(problem)
        for one in those:
            one.check(problem, all_forms(problem, functional))
    require_agreement(problem.comm, controls=[type(one).__name__ for one in those])
    return problem, functional, those


def refuse(problem: CoupledProblem) -> None:
    """Raise for what has derivatives that are not known here."""
    if problem.volume.updated is not None:
        raise SetUpError(
            "adjoint: update= sets coefficients of the forms, whose derivatives UFL does "
            "not see"
        )
    if problem.constraints is not None:
        raise SetUpError("adjoint: constraints= have no derivative here")
    if problem.terms:
        raise SetUpError(
            f"adjoint: the problem has {problem.terms[0].spoken}, which have no "
            "derivative here"
        )
    if problem.contact.layout.bodies:
        raise SetUpError("adjoint: a rigid body that is free has no derivative here")
    for contact in problem.contact.contacts:
        if contact.tied is not None:
            raise SetUpError("adjoint: a Tie has no derivative here")
        if contact.tangent == "fixed":
            raise SetUpError("adjoint: tangent='fixed' is not the whole derivative")
        if getattr(contact.method, "exact", False):
            raise SetUpError("adjoint: Penalty(exact=True) has no derivative here")


def _refuse_accepted(problem: CoupledProblem) -> None:
    """Raise where friction begins anew from the present state. Collective."""
    for contact in problem.contact.contacts:
        if contact.friction is None:
            continue
        (part,) = contact.parts
        present: Any = part.present
        has_begun = present.steps > 0 and np.array_equal(
            contact.u.x.array, present.u_old
        )
        if problem.comm.allreduce(has_begun, op=MPI.LAND):
            raise SetUpError(
                "adjoint: the step has been accepted, and friction begins anew from it: "
                "call gradient before contact.advance()"
            )


def add_derivatives(
    at: Linearised,
    functional: Functional,
    right: PETSc.Vec,
    controls: Sequence[Control],
    found: Sequence[Array],
) -> PETSc.Vec:
    """Solve for the adjoint, and add derivatives by the controls to `found`; return
    contact's weights [theory (8.4)]. Collective."""
    problem = at.problem
    lam = at.solve(right)
    parts = [(one, -1.0) for one in actions(problem, values_of_adjoint(problem, lam))]
    forms, factors = zip(*parts, *functional.forms)
    e = functional.weights(problem)
    lam.axpy(-1.0, e)
    at.weigh(lam)
    for one, so_far in zip(controls, found):
        so_far += one.by_forms(forms, factors)
        so_far -= one.by_contact(at)
    e.destroy()
    return lam


def results(given: Any, controls: Sequence[Control], found: Sequence[Array]) -> Any:
    """Return one result for each control, or the only one where no list was given."""
    all_of_them = [one.result(values) for one, values in zip(controls, found)]
    return all_of_them if isinstance(given, (list, tuple)) else all_of_them[0]


def check_state(problem: CoupledProblem, controls: Sequence[Control]) -> None:
    """Raise where a derivative is not known, and warn once of a problem where there is
    none. Collective."""
    with together(problem.comm):
        for one in controls:
            one.check_state(problem)
    texts = [at_kink(problem), *(one.kink() for one in controls)]
    told = _told.setdefault(problem, set())
    for text in dict.fromkeys(sum(problem.comm.allgather(texts), [])):
        if text is not None and text not in told:
            told.add(text)
            warn(text)
