"""Coefficients and sides that do not suit the stiffness of the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import compat
from ..contact import Contact
from ..errors import ContactError
from ..interface.contact_surfaces import ContactSurfaces
from ..interface.stiffness import VolumePattern, contact_stiffness, stiffness_ratios
from ..problem import CoupledProblem

# Factor off the automatic coefficient up to which solves hardly suffer. The stiffness of
# a state that has not converged is no better known
FAR_OFF = 100.0
# Ratio of moduli from which the softer side is the better slave (docs/choosing_sides)
STIFFER = 10.0


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
        if now and not 1.0 / FAR_OFF <= contact.gamma_scale / now <= FAR_OFF:
            found.append(compared(contact, now))
    return found


def swaps(
    surfaces: ContactSurfaces, volume: VolumePattern, bcs: Sequence[Any]
) -> list[str]:
    """Advice on slaves that are much stiffer than their masters, or of a higher degree.
    Collective.

    Parameters
    ----------
    surfaces
        Of one contact.
    volume, bcs
        Of the problem.
    """
    if surfaces.multiplier is None:
        return []
    degree = compat.element_info(surfaces.multiplier.function_space).degree
    ratios = stiffness_ratios(volume, surfaces.layout, surfaces.interfaces, bcs)
    found = []
    for zone, ratio in zip(surfaces.zones, ratios):
        if zone.facets.bodies:
            continue  # a rigid tool cannot be the slave
        both = zone.facets.slave_surface, zone.facets.master_surface
        p, q = (side.displacement_degree for side in both)
        reasons, most = [], float(ratio.max(initial=0.0))
        if p > q:
            reasons.append(f"has degree {p} and its master degree {q}")
        if most >= STIFFER:
            reasons.append(f"is {most:.2g} times as stiff as its master")
        if reasons:
            lower = "AugmentedLagrangian(degree=1), or " * (degree > 1)
            found.append(
                f"{lower}the other side as the slave (slave tag "
                f"{zone.facets.slave_tag} {' and '.join(reasons)})"
            )
    return found
