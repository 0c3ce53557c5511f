"""Fields on the slave nodes, averaged from the integration points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..errors import ContactError, raise_everywhere
from ..interface.contact_surfaces import ContactSurfaces
from ..interface.point_results import OPEN, SLIP, along_normal, nodal_average
from ..interface.present import PresentState
from ..options.friction import Law

PARTS = ("total", "normal", "tangential")


class NodalFields:
    """Fields of one contact at its last update. Collective.

    `Contact` documents its methods.

    Parameters
    ----------
    surfaces
        Of the contact.
    present
        Its present state.
    friction
        Its law.
    """

    def __init__(
        self, surfaces: ContactSurfaces, present: PresentState, friction: Law | None
    ) -> None:
        self._surfaces, self._present, self._friction = surfaces, present, friction

    def _average(
        self,
        name: str,
        quantity: Callable[[dict[str, Array]], Array],
        vector: bool = False,
        elsewhere: float | None = 0.0,
        hits_only: bool = True,
    ) -> Function:
        """Nodal averages of a point quantity, and a value off the contact."""
        self._present.require_results()
        made = self._surfaces
        f = Function(made.vector if vector else made.scalar, name=name)
        nodal_average(made.zones, quantity, f, hits_only)
        if elsewhere is not None:
            f.x.array[np.isnan(f.x.array)] = elsewhere
        return f

    def gap(self) -> Function:
        """Gap of the law; NaN where no hit."""
        return self._average("gap", lambda points: points["gap"], elsewhere=None)

    def traction(self, part: str) -> Function:
        """Contact traction, or a part of it."""
        raise_everywhere(
            self._surfaces.comm,
            None if part in PARTS else f"part must be one of {PARTS}, not {part!r}",
        )

        def quantity(points: dict[str, Array]) -> Array:
            total = points["traction"]
            if part == "total":
                return total
            normal = along_normal(points, total)
            return normal if part == "normal" else total - normal

        name = "traction" if part == "total" else f"{part}_traction"
        return self._average(name, quantity, vector=True)

    def slip(self) -> Function:
        """Slip since the accepted step."""
        if self._friction is None:
            raise ContactError("slip is only known with friction")

        def quantity(points: dict[str, Array]) -> Array:
            return points["slip"] - along_normal(points, points["slip"])

        return self._average("slip", quantity, vector=True)

    def status(self) -> Function:
        """`NodeStatus` of the slave nodes."""
        f = self._average("status", lambda points: points["status"] - OPEN)
        f.x.array[:] = np.round(f.x.array)
        return f

    def coverage(self) -> Function:
        """Share of the slave surface around each node that has a hit."""

        def quantity(points: dict[str, Array]) -> Array:
            return (points["status"] >= OPEN).astype(np.float64)

        return self._average("coverage", quantity, hits_only=False)

    def all(self) -> list[Function]:
        """All of them, without NaN, and the multiplier."""
        gap = self.gap()
        # DOLFINx 0.5 interpolates for XDMF, and a NaN then takes its whole cell
        gap.x.array[np.isnan(gap.x.array)] = 0.0
        found = [gap, self.traction("normal"), self.traction("tangential")]
        found += [self.status(), self.coverage()]
        if self._friction is not None:
            found.append(self.slip())
        multiplier = self._surfaces.multiplier
        return found if multiplier is None else [multiplier, *found]

    def friction_work(self) -> float:
        """Work that tangential tractions take in this step."""
        if self._friction is None:
            return 0.0
        self._present.require_results()
        work = 0.0
        for zone in self._surfaces.zones:
            points = zone.points()
            slip = points["slip"] - along_normal(points, points["slip"])
            by_area = -np.einsum("qi,qi->q", points["traction"], slip)
            weight = points["weight"]
            if self._surfaces.multiplier is not None:
                slips = points["status"] == SLIP
                by_area, weight = np.maximum(by_area, 0.0)[slips], weight[slips]
            work += float(weight @ by_area)
        return float(self._surfaces.comm.allreduce(work))
