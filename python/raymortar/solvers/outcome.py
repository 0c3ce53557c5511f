"""What follows a solve: an error if it failed, a warning if its result is doubtful."""

from __future__ import annotations

import warnings

from ..convergence.lost_contact import lost_contact
from ..convergence.penetration import warn_of_penetration
from ..convergence.tension import warn_of_tension
from ..convergence.tilt import warn_of_tilt
from ..convergence.turned_tools import turned_too_far
from ..errors import BodyLeft, ContactWarning, ConvergenceError, raise_everywhere
from ..problem import CoupledProblem


def require_convergence(problem: CoupledProblem, converged: bool, reason: str) -> None:
    """Raise on every rank if a solve has failed; warn if its result is doubtful."""
    if not converged:
        message = f"Newton did not converge {reason}: {problem.describe()}"
        left = problem.free_body_left()
        kind = BodyLeft if left else ConvergenceError
        raise_everywhere(problem.comm, message, kind)
    turned = turned_too_far(problem.contact)
    if turned is not None:
        raise_everywhere(
            problem.comm, f"Newton converged, but {turned}", ConvergenceError
        )
    if not problem.tells_of_doubt:
        return
    warn_of_penetration(problem)
    warn_of_tension(problem.contact, stacklevel=3)
    warn_of_tilt(problem.contact)
    loss = lost_contact(problem)
    if loss is not None:
        warnings.warn(
            f"converged, but contact is lost: {loss}. Take smaller steps",
            ContactWarning,
            stacklevel=3,
        )
