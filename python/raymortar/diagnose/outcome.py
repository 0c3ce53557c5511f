"""Judge the end of a solve: an error if it failed, warnings if it is doubtful."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..core.errors import (
    BodyLeft,
    ContactLost,
    ConvergenceError,
    raise_everywhere,
    warn,
)
from ..core.finding import Finding
from ..core.interaction import Interaction
from ..core.problem import CoupledProblem
from ..rigid.turning import LARGEST_TURN
from .failure import describe, part_of
from .findings import DEEP, deepest_on_tools, findings
from .lost_contact import lost_contact
from .missed import warn_of_missed_masters
from .unaccepted import warn_of_unaccepted_solves

# Factor by which a doubt must be worse to be warned of again
WORSE = 2.0
SMALLER = "Take smaller steps"
# Sentences told of the ends of a problem's paths
_TOLD: WeakKeyDictionary[CoupledProblem, set[Any]] = WeakKeyDictionary()


def require_convergence(problem: CoupledProblem, converged: bool, reason: str) -> None:
    """Raise on every rank if a solve has failed; warn if its result is doubtful, but
    for load steps, which look at accepted steps themselves. Collective."""
    if not converged:
        message = f"Newton did not converge {reason}: {describe(problem)}"
        left = (
            problem.contact.layout.bodies
            and problem.contact.system.free_bodies.any_left()
        )
        kind = BodyLeft if left else ConvergenceError
        raise_everywhere(problem.comm, message, kind)
    turned = _turned_too_far(problem.contact)
    if turned is not None:
        message = f"Newton converged, but {turned}"
        raise_everywhere(problem.comm, message, ConvergenceError)
    if part_of(problem).get("steps"):
        return
    doubts = Doubts(problem)
    doubts.look()
    doubts.end()
    loss = lost_contact(problem)
    if loss is None:
        warn_of_missed_masters(problem)
    else:
        text = f"converged, but contact is lost: {loss}. {SMALLER}"
        warn(text)
    warn_of_unaccepted_solves(problem)


def check(problem: CoupledProblem) -> list[Finding]:
    """Find all that is doubtful about the present state, see `NonlinearProblem.check`.
    Collective."""
    found = list(findings(problem))
    loss = lost_contact(problem)
    if loss is not None:
        found.append(Finding("", (), f"contact is lost: {loss}", SMALLER, 1.0))
    return found


class Doubts:
    """Finds doubtful states of a problem, warns of those in which figures are wrong, and
    refuses steps into tools. Collective.

    The problem's contact is in an accepted state.
    """

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem, self._warned = problem, dict[Any, float]()
        self._forces, self._late = dict[Any, float](), dict[Any, Finding | None]()
        self._accepted = self._found = deepest_on_tools(problem.contact)[0]

    def require_gradual(self) -> None:
        """Refuse a step that takes points much deeper into a tool, by `DEEP`.

        The state may be an equilibrium, but one that the path jumps to: half through
        the tool, with a part of the force.
        """
        self._found, text = deepest_on_tools(self._problem.contact)
        if self._found > self._accepted + DEEP:
            raise ContactLost(f"a rigid body jumps into its slave: {text}")

    def look(self) -> list[Finding]:
        """Find doubts about the present state, now accepted, and warn of some: of the
        same again if it is worse by `WORSE`. Collective."""
        self._accepted = self._found
        found = list(findings(self._problem, self._is_largest))
        for one in found:
            if one.force is not None:
                self._late[one.about] = one
            elif one.is_wrong and one.size > WORSE * self._warned.get(one.about, 0.0):
                self._warned[one.about] = one.size
                warn(str(one))
        return found

    def _is_largest(self, about: object, force: float) -> bool:
        """Whether a force is the largest one of the path; it is noted."""
        if force <= self._forces.get(about, 0.0):
            return False
        self._forces[about], self._late[about] = force, None
        return True

    def end(self) -> None:
        """Warn of what counts at the largest force of a path, now ended,
        once for all paths of a problem."""
        for found in self._late.values():
            if found is not None and found.is_wrong:
                told = _TOLD.setdefault(self._problem, set())
                if found.about not in told:
                    told.add(found.about)
                    warn(str(found))


def _turned_too_far(contact: Interaction) -> str | None:
    """Message on a free body that friction acts on and that has turned too far in this
    step, else None. Collective.

    After half a turn the slip, which is a vector from a place to a place, points
    backwards, and friction would drive the body. Where a position is prescribed, it is
    refused before the solve; that of a free body is known after it.
    """
    for body in contact.layout.bodies:
        angle = float(np.linalg.norm(body.cpp.theta()))
        if angle >= LARGEST_TURN and any(
            one.friction is not None and one.results.resultant_on(body).force.any()
            for one in contact.contacts
            if any(body in zone.facets.bodies for zone in one.zones)
        ):
            return (
                f"{body!r} has turned by {angle:.3g} rad in this step: with friction it "
                f"has to be less than {LARGEST_TURN:.3g}. Take smaller steps"
            )
    return None
