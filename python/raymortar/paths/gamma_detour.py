"""A solve by way of a smaller augmentation coefficient."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from dolfinx.fem import Function

from ..diagnose.failure import FAILURES
from ..errors import ContactWarning

if TYPE_CHECKING:
    from ..contact import Contact
    from ..interaction import Interaction

# Smaller coefficient, over the one in use. It hardly changes the solution, but with it
# fewer points open and close during a solve (docs/robustness_paths.md)
SHARE = 0.1


def solve_by_small_gamma(solver: Any) -> int:
    """Solve with a tenth of gamma, then with gamma from there. Collective.

    Returns
    -------
    Iterations of both.
    """
    contacts = solver.problem.contact.contacts
    given = [contact.gamma for contact in contacts]
    try:
        set_each(contacts, [scaled(gamma, SHARE) for gamma in given])
        # Warnings of the first solve are of no interest: its state is not kept
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            iterations: int = solver.solve()[0]
    finally:
        set_each(contacts, given)
    return iterations + int(solver.solve()[0])


def solve_with_small_gamma(solver: Any) -> int:
    """Solve with a tenth of gamma. If the solve converges, keep this gamma. Collective.

    With a multiplier, this solution is as good as the one with gamma: both meet the
    contact conditions in the mean.

    Returns
    -------
    Iterations.
    """
    contacts = with_multipliers(solver.problem.contact)
    given = [contact.gamma for contact in contacts]
    try:
        set_each(contacts, [scaled(gamma, SHARE) for gamma in given])
        return int(solver.solve()[0])
    except FAILURES:
        set_each(contacts, given)
        raise


def with_multipliers(contact: Interaction) -> list[Contact]:
    """Contacts that have a multiplier."""
    return [c for c in contact.contacts if c.multiplier is not None]


def set_each(contacts: Sequence[Contact], gammas: Sequence[Any]) -> None:
    """Give each contact its coefficient. Collective."""
    for contact, gamma in zip(contacts, gammas):
        contact.set_gamma(gamma)


def scaled(gamma: Any, factor: float) -> Any:
    """A multiple of a coefficient of any kind."""
    if not isinstance(gamma, Function):
        return factor * gamma
    other = Function(gamma.function_space)
    other.x.array[:] = factor * gamma.x.array
    return other
