"""Points that a converged solve leaves deep inside the master: warnings, refusals."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..errors import ContactLost, ContactWarning
from ..options.methods import AugmentedLagrangian, Penalty
from .strange_gamma import automatic_gamma, compared

if TYPE_CHECKING:
    from ..interface.zone_data import ZoneData
    from ..problem import CoupledProblem

# Of a slave facet's size. Multipliers close gaps in the mean: what is left at a point is
# a few hundredths where facets resolve the surfaces
ALLOWED = 0.25
# The same of a penalty whose coefficient is below the automatic one
SOFT = 0.1
UNRESOLVED = (
    ": the facets do not resolve what touches there (a face beside a sharp corner, a "
    "step): refine it, or leave it out of the slave's tag"
)
# On a path the same is told again where it is so many times as deep
WORSE = 2.0


def _deepest(zone: ZoneData) -> tuple[float, str]:
    """Largest penetration of a pressed point over its facet's size, and a sentence."""
    points = zone.points()
    surface = zone.facets.slave_surface
    pressed = np.flatnonzero((points["pressure"] < 0.0) & (points["gap"] < 0.0))
    if not len(pressed):
        return 0.0, ""
    nodes = surface.X[surface.facet_nodes[points["slave"][pressed]]]
    share = -points["gap"][pressed] / np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    worst = int(np.argmax(share))
    q = pressed[worst]
    place = ", ".join(f"{x:.6g}" for x in points["x"][q])
    text = (
        f"converged with a point of slave tag {zone.facets.slave_tag} "
        f"{-points['gap'][q]:.3e} deep in the master, {share[worst]:.2g} of its facet, at "
        f"({place})"
    )
    return float(share[worst]), text


def _sunk(zone: ZoneData) -> tuple[float, str]:
    """Depth of the deepest point that is too deep for contact, and a sentence."""
    sunk = zone.cpp.sunk_points()
    if not len(sunk):
        return 0.0, ""
    points = zone.points()
    q = sunk[np.argmin(points["gap"][sunk])]
    place = ", ".join(f"{x:.6g}" for x in points["x"][q])
    text = (
        f"converged with a point of slave tag {zone.facets.slave_tag} "
        f"{-points['gap'][q]:.3e} deep in the master, at ({place}), where it is not "
        "seen: take smaller steps, or a larger depth in Search"
    )
    return float(-points["gap"][q]), text


class DeepPoints:
    """Warns of the deepest points of converged states, and refuses steps into tools.

    One warning is about points that are too deep for contact, the others about pressed
    points that the multiplier, or a penalty that is too soft, leaves inside the master.
    Each comes again where it is much worse.

    Parameters
    ----------
    problem
        Its contact is in an accepted state.
    """

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem, self._contact = problem, problem.contact
        contact = self._contact
        self._sunk, self._share = 0.0, ALLOWED / WORSE
        self._soft = {
            one: SOFT / WORSE
            for one in contact.contacts
            if isinstance(one.method, Penalty) and one.tied is None
        }
        self._zones = [
            zone
            for one in contact.contacts
            if isinstance(one.method, AugmentedLagrangian)
            for zone in one.zones
        ]
        self._on_tools = [zone for zone in self._zones if zone.facets.bodies]
        self._accepted = self._found = self._worst(_deepest, self._on_tools)[0]

    def require_gradual(self) -> None:
        """Refuse a step that takes points much deeper into a tool. Collective.

        The state may be an equilibrium, but one that the path jumps to: half through
        the tool, with a part of the force.

        Raises
        ------
        ContactLost
            If they are deeper by more than `ALLOWED` than in the accepted state.
        """
        self._found, text = self._worst(_deepest, self._on_tools)
        if self._found > self._accepted + ALLOWED:
            raise ContactLost(f"a rigid body jumps into its slave: {text}{UNRESOLVED}")

    def warn(self, stacklevel: int) -> None:
        """Warn on every rank of the present state, now accepted. Collective.

        Parameters
        ----------
        stacklevel
            Of `warnings.warn`, seen from the caller.
        """
        depth, text = self._worst(_sunk, self._contact.zones)
        if depth > WORSE * self._sunk:
            self._sunk = depth
            warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)
        self._accepted = self._found
        share, text = self._worst(_deepest, self._zones)
        if share > WORSE * self._share:
            self._share = share
            warnings.warn(text + UNRESOLVED, ContactWarning, stacklevel=stacklevel + 1)
        for one, told in self._soft.items():
            share, text = self._worst(_deepest, one.zones)
            if share <= WORSE * told:
                continue
            self._soft[one] = share
            now = automatic_gamma(self._problem, one)
            if now is not None and one.gamma_scale < now:
                text = f"{text}: {compared(one, now)}"
                warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)

    def _worst(
        self, of_zone: Callable[[ZoneData], tuple[float, str]], zones: list[ZoneData]
    ) -> tuple[float, str]:
        """The largest number over zones and ranks, and its sentence. Collective."""
        if not zones:
            return 0.0, ""
        comm = self._contact.layout.comm
        most, text = max(map(of_zone, zones))
        most, rank = comm.allreduce((most, comm.rank), op=MPI.MAXLOC)
        return most, comm.bcast(text, root=rank)


def warn_of_penetration(problem: CoupledProblem) -> None:
    """Warn of the deepest points after a solve by itself. Collective."""
    DeepPoints(problem).warn(stacklevel=4)
