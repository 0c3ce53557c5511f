"""Slaves that are stiffer or of a higher degree than their masters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import compat
from .contact_surfaces import ContactSurfaces
from .probing import VolumePattern
from .stiffness import stiffness_ratios

# Ratio of moduli from which the softer side is the better slave (docs/choosing_sides)
STIFFER = 10.0


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
