"""Coefficients that do not fit the form's present stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ContactError
from ..interface.probing import VolumePattern
from ..interface.stiffness import contact_stiffness

if TYPE_CHECKING:
    from ..contact import Contact
    from ..problem import CoupledProblem

# Factor off the automatic coefficient up to which solves hardly suffer. The stiffness of
# a state that has not converged is no better known
FAR_OFF = 100.0


def automatic_gamma(problem: CoupledProblem, contact: Contact) -> float | None:
    """Find the automatic coefficient of a form as it is now, with its present
    constants; None if it has no stiffness. Traction per length. Collective."""
    try:
        volume = VolumePattern(problem.a, contact.layout, contact.axisymmetric)
        tables = contact_stiffness(
            volume, contact.layout, contact.surfaces.interfaces, problem.bcs
        )
    except ContactError:  # on all ranks
        return None
    return contact.method.automatic_factor * min(float(t.min()) for t in tables)


def compared(contact: Contact, now: float) -> str:
    """A sentence on the coefficient in use beside the automatic one, `now`."""
    return (
        f"gamma = {contact.gamma_scale:.3g} is {contact.gamma_scale / now:.3g} times the "
        f"automatic gamma of the form's present stiffness, {now:.3g}: "
        f"contact.set_gamma({now:.3g})"
    )


def strange_gammas(problem: CoupledProblem) -> list[str]:
    """Sentences on coefficients far off the automatic ones. Collective."""
    found = []
    for contact in problem.contact.contacts:
        now = automatic_gamma(problem, contact)
        if now is None:
            continue
        if not 1.0 / FAR_OFF <= contact.gamma_scale / now <= FAR_OFF:
            found.append(compared(contact, now))
    return found
