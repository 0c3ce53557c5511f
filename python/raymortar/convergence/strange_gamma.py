"""Coefficients that do not fit the form's present stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ContactError
from ..interface.stiffness import VolumePattern, contact_stiffness

if TYPE_CHECKING:
    from ..problem import CoupledProblem

# Factor off the automatic coefficient up to which solves hardly suffer. The stiffness of
# a state that has not converged is no better known
FAR_OFF = 100.0


def strange_gammas(problem: CoupledProblem) -> list[str]:
    """Sentences on coefficients far off the automatic ones of the form as it is now,
    with its present constants. Collective."""
    found = []
    for contact in problem.contact.contacts:
        try:
            volume = VolumePattern(problem.a, contact.layout, contact.axisymmetric)
            tables = contact_stiffness(
                volume, contact.layout, contact.surfaces.interfaces, problem.bcs
            )
        except ContactError:  # on all ranks: the present form has no stiffness
            continue
        now = contact.method.automatic_factor * min(float(t.min()) for t in tables)
        ratio = contact.gamma_scale / now
        if not 1.0 / FAR_OFF <= ratio <= FAR_OFF:
            found.append(
                f"gamma = {contact.gamma_scale:.3g} is {ratio:.3g} times the automatic "
                f"gamma of the form's present stiffness, {now:.3g}: "
                f"contact.set_gamma({now:.3g})"
            )
    return found
