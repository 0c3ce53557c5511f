"""Coefficients of laws at nodes, by what the surfaces of bodies yield."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.discretization.surfaces import Surface
from ..core.gamma.probing import VolumePattern
from ..core.gamma.stiffness import contact_stiffness, of_sides
from ..core.interface.coefficients import (
    Interfaces,
    Measure,
    PairCoefficients,
    one_or_each,
)
from ..core.system.assembly import ContactAssembly
from ..core.system.coupled import CoupledSystem
from .compliance import SurfaceCompliance

# Ratio of (5.16) to (5.2) below which bodies bend (docs/measured/slip_fronts.md)
BENDS = 0.015


class Bending:
    """Coefficients of the contacts of a system, as long as a volume has its matrices.
    Collective."""

    def __init__(
        self, system: CoupledSystem, volume: VolumePattern, bcs: Sequence[Any]
    ) -> None:
        self._bcs = bcs
        of = system.unknowns, system.bodies, bcs, system.axisymmetric
        self._compliance = SurfaceCompliance(volume, *of)

    def destroy(self) -> None:
        """Free PETSc's objects. Collective."""
        self._compliance.destroy()

    def coefficients(self, part: ContactAssembly) -> list[Array]:
        """Coefficient of a law at nodes [theory (5.16)], a table for each zone.
        Traction per length. Collective.

        Such a law does not depend on it. The active set needs gamma g of the size of the
        pressure for single nodes as well as for whole arcs of a body that bends: it is
        the geometric mean of the stiffness of (5.2) and the inverse of what the surface
        yields, where that is less.
        """
        volume, interfaces = part.volume, part.surfaces.interfaces
        assert volume is not None
        of_side = of_sides(volume, interfaces, self._bcs)
        arcs = _of_arcs(of_side, interfaces, self._compliance)
        stiffness = contact_stiffness(volume, interfaces, self._bcs)
        return [np.minimum(*both) for both in zip(stiffness, arcs)]

    def bends(self, part: ContactAssembly) -> bool:
        """Whether a law at points was chosen for its degree, and surfaces yield far more
        than single facets: the ratio of (5.16) to (5.2). Collective."""
        degree = part.zones[0].facets.slave_surface.displacement_degree
        chosen = part.why is not None and part.method.condition == "points"
        if not chosen or degree == 1:
            return False
        stiffness = part.contact_stiffness(self._bcs)
        if stiffness is None:
            return False
        soft = self.coefficients(part)
        return all((a < BENDS * b).all() for a, b in zip(soft, stiffness))


def softer(
    system: CoupledSystem, bcs: Sequence[Any]
) -> list[float | PairCoefficients | None]:
    """Find what the coefficient of a law at nodes would be, for each contact whose law at
    points has a multiplier; else None, as for ties and for forms without stiffness.
    Traction per length. Collective."""
    form = system.volume.form
    volume = VolumePattern(form, system.layout, system.axisymmetric, strains=False)
    bending = Bending(system, volume, bcs)
    try:
        return [_softer(part, bending) for part in system.parts]
    finally:
        bending.destroy()
        volume.destroy()


def _softer(part: ContactAssembly, bending: Bending) -> float | PairCoefficients | None:
    """`softer` of one contact. Collective."""
    surfaces = part.surfaces
    at_points = getattr(part.method, "condition", "points") == "points"
    led = surfaces.tied is None and surfaces.multiplier is not None
    if not (at_points and led) or part.contact_stiffness(()) is None:
        return None
    return one_or_each(surfaces.interfaces, bending.coefficients(part))


def _of_arcs(
    of_side: Measure, interfaces: Interfaces, compliance: SurfaceCompliance
) -> list[Array]:
    """Geometric means of stiffness and inverse compliance, of both sides in series; inf
    where neither has both. Collective."""

    def measure(surfaces: Sequence[Surface]) -> Array:
        # Bodies that buckle may yield by less than nothing
        yields = np.maximum(compliance.of_side(surfaces), 0.0)
        stiffness = of_side(surfaces)[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            squared = yields / stiffness
        return np.where(np.isfinite(squared), squared, 0.0)[:, None]

    def pair(slave: Array, master: Array) -> Array:
        with np.errstate(divide="ignore"):
            return 1.0 / np.sqrt(slave[:, 0] + master[:, 0])

    return interfaces.tables(measure, pair)
