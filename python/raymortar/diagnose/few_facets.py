"""Contact that few facets carry, by which forces and tractions depend on gamma."""

from __future__ import annotations

import numpy as np

from ..compat import Array
from ..errors import format_point
from ..interface.point_results import CLOSED, OPEN
from ..interface.zone_data import ZoneData
from ..problem import CoupledProblem
from .narrow import forces_on_facets, undeformed_middles

# Work of the law's residuals, over that of the bodies, from which on forces change with
# gamma by some percent (docs/measured/few_facets)
SHARE = 0.02
# Largest number of facets that counts as few, by dimension: two contacts of 4 facets; in
# space two of 4 by 4 quadrilaterals, or one of twice as many triangles
FEW = {2: 8, 3: 32}


class FewFacets:
    """Dependence of the forces on a slave surface on gamma, in one state. Collective.

    Forces depend on it by the work of the law's residuals over that of the bodies
    [theory (4.36)]. `points` are those of the surface, `gamma` its mean coefficient.

    Attributes
    ----------
    force
        Sum of the normal forces on all points of all ranks. Force.
    """

    def __init__(self, zone: ZoneData, points: dict[str, Array], gamma: float) -> None:
        self._zone = zone
        weight = points["weight"]
        closed, is_open = points["status"] >= CLOSED, points["status"] == OPEN
        self._carried = forces_on_facets(zone, points)
        left = (points["traction"] ** 2).sum(axis=1) / gamma * is_open
        left += gamma * points["gap"] ** 2 * closed
        pressed = points["pressure"] ** 2 / gamma * closed
        mine = [self._carried.sum(), weight @ left, weight @ pressed]
        mine.append(np.count_nonzero(self._carried))
        found = zone.comm.allreduce(np.array(mine))
        self.force, self._left, self._pressed, self._facets = map(float, found)

    def told(self, problem: CoupledProblem) -> str | None:
        """Word the warning; None where forces hardly depend on gamma. Collective.

        The forms are assembled only if the residuals are large beside the pressure on
        the facets themselves, which do a part of the bodies' work.
        """
        dim, count = self._zone.facets.slave_surface.gdim, int(self._facets)
        if count > FEW[dim] or self._left <= SHARE * self._pressed:
            return None
        work = _work_of_bodies(problem)
        if not self._left > SHARE * work > 0.0:
            return None
        middles, most = undeformed_middles(self._zone), (0.0, "")
        if self._carried.any():
            k = int(np.argmax(self._carried))
            most = float(self._carried[k]), format_point(middles[k], middles)
        place = max(self._zone.comm.allgather(most))[1]
        carry = "1 facet carries" if count == 1 else f"{count} facets carry"
        return (
            f"{carry} the contact of {self._zone.facets.spoken}, most at the undeformed "
            f"{place}: gaps and tractions that the law leaves at points do "
            f"{self._left / work:.2g} of the work of the bodies, and so forces and "
            "tractions depend on gamma, by a few to many percent. Make facets there "
            "smaller, until at least 4 lie across the contact. The law at nodes leaves "
            "gamma out, but errs by more"
        )


def _work_of_bodies(problem: CoupledProblem) -> float:
    """Work of the bodies' inner forces on their displacements. Collective.

    Forces at rest are loads, which are left out. Where a function sets the coefficients of
    the forms, they are unknown: then all forces count by their amounts, which is more.
    """
    unknowns, volume = problem.contact.unknowns, problem.volume
    u = unknowns.owned_values()[unknowns.u_owned]
    forces = volume.forces(problem.bcs)[unknowns.u_owned]
    if volume.updated is not None:
        return float(problem.comm.allreduce(np.abs(forces) @ np.abs(u)))
    with unknowns.lent() as rest:
        rest[unknowns.u_local] = 0.0
        unknowns.set_values(rest)
        loads = volume.forces(problem.bcs)[unknowns.u_owned]
    return float(problem.comm.allreduce((forces - loads) @ u))
