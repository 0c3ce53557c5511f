"""What follows a solve: an error if it failed, a warning if its result is doubtful."""

from __future__ import annotations

import warnings

import numpy as np

from ..errors import BodyLeft, ContactWarning, ConvergenceError, raise_everywhere
from ..interaction import Interaction
from ..interface.held import rigid_slaves
from ..problem import CoupledProblem
from ..rigid.motions import LARGEST_TURN
from .doubts import Doubts
from .failure import describe_failure, in_use_of
from .lost_contact import lost_contact
from .stiffness import strange_gammas, swaps
from .unheld import loose_bodies, unheld


def require_convergence(problem: CoupledProblem, converged: bool, reason: str) -> None:
    """Raise on every rank if a solve has failed; warn if its result is doubtful, but
    for load steps, which look at accepted steps themselves. Collective."""
    if not converged:
        message = f"Newton did not converge {reason}: {describe(problem)}"
        left = problem.contact.layout.bodies and problem.contact.free_bodies.any_left()
        kind = BodyLeft if left else ConvergenceError
        raise_everywhere(problem.comm, message, kind)
    turned = _turned_too_far(problem.contact)
    if turned is not None:
        message = f"Newton converged, but {turned}"
        raise_everywhere(problem.comm, message, ConvergenceError)
    if problem.part_of.get("steps"):
        return
    Doubts(problem).warn(stacklevel=3)
    loss = lost_contact(problem)
    if loss is not None:
        text = f"converged, but contact is lost: {loss}. Take smaller steps"
        warnings.warn(text, ContactWarning, stacklevel=3)


def describe(problem: CoupledProblem) -> str:
    """State of contact and residual history, for messages. Collective."""
    in_use, contacts = in_use_of(problem), problem.contact.contacts
    fixed = problem.contact.constrained(problem.bcs)
    controlled = in_use.controlled
    free = loose_bodies(problem, in_use.led) if controlled else unheld(problem)
    if problem.contact.layout.bodies:
        free += problem.contact.free_bodies.unheld()
    advice: list[str] = []
    for part in problem.contact.parts:
        assert part.volume is not None
        advice += swaps(part.surfaces, part.volume, problem.bcs)
    return describe_failure(
        problem.history,
        problem.contact.statistics,
        free,
        problem.convergence.describe(),
        [
            zone.facets.slave_tag
            for one in contacts
            for zone in rigid_slaves(one.surfaces, fixed)
        ],
        advice,
        [one.excess for one in contacts if one.excess is not None],
        strange_gammas(problem),
        in_use,
    )


def _turned_too_far(contact: Interaction) -> str | None:
    """Message on a free body that friction acts on and that has turned too far in this
    step, else None. Collective.

    After half a turn the slip, which is a vector from a place to a place, points
    backwards, and friction would drive the body. Where a position is prescribed, it is
    refused before the solve; that of a free body is known after it.
    """
    for body in contact.layout.bodies:
        angle = float(np.linalg.norm(body.freedom.theta))
        if angle >= LARGEST_TURN and any(
            one.friction is not None and one.resultant_on(body).force.any()
            for one in contact.contacts
            if any(body in zone.facets.bodies for zone in one.zones)
        ):
            return (
                f"{body!r} has turned by {angle:.3g} rad in this step: with friction it "
                f"has to be less than {LARGEST_TURN:.3g}. Take smaller steps"
            )
    return None
