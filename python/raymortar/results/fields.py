"""Fields on the slave nodes, averaged from the integration points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..errors import ContactError, raise_everywhere, together
from ..interface.contact_surfaces import ContactSurfaces
from ..interface.point_results import OPEN, nodal_average, pressures, traction_part
from ..interface.present import PresentState
from ..options.friction import Law

PARTS = ("total", "normal", "tangential")


def check_part(part: Any, comm: MPI.Comm) -> None:
    """Raise unless a part of a traction is known. Collective."""
    raise_everywhere(
        comm, None if part in PARTS else f"part must be one of {PARTS}, not {part!r}"
    )


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
        quantity: Callable[[dict[str, Array]], Any],
        vector: bool = False,
        elsewhere: float = 0.0,
        hits_only: bool = True,
    ) -> Function:
        """Nodal averages of a point quantity, and a value off the contact."""
        self._present.require_results()
        made = self._surfaces
        f = Function(made.vector if vector else made.scalar, name=name)
        nodal_average(made.zones, quantity, f, hits_only)
        f.x.array[np.isnan(f.x.array)] = elsewhere
        return f

    def gap(self, elsewhere: float = np.nan) -> Function:
        """Gap of the law; NaN where no hit."""
        return self._average("gap", lambda points: points["gap"], elsewhere=elsewhere)

    def pressure(self) -> Function:
        """Contact pressure, positive in compression."""
        return self._average("pressure", pressures)

    def of_points(self, values: Sequence[Array], name: str) -> Function:
        """Averages of values at the points of each slave surface; NaN where no hit."""
        self._present.require_results()
        zones = self._surfaces.zones
        with together(self._surfaces.comm):
            given = [np.asarray(one) for one in values]
            dim = zones[0].facets.slave_surface.gdim
            wanted = [len(zone.points()["weight"]) for zone in zones]
            shapes = [one.shape for one in given]
            if shapes not in ([(n,) for n in wanted], [(n, dim) for n in wanted]):
                raise ContactError(
                    f"values of shapes {shapes} are not one for each point: the slave "
                    f"surfaces have {wanted} points, and a value is a number or a "
                    f"vector of {dim}"
                )
        each = iter(given)
        return self._average(name, lambda _: next(each), given[0].ndim == 2, np.nan)

    def traction(self, part: str) -> Function:
        """Contact traction, or a part of it."""
        check_part(part, self._surfaces.comm)
        name = "traction" if part == "total" else f"{part}_traction"
        return self._average(name, lambda points: traction_part(points, part), True)

    def slip(self) -> Function:
        """Slip since the accepted step."""
        if self._surfaces.tied is not None:
            raise ContactError("a Tie does not slip")
        if self._friction is not None:
            return self._average("slip", lambda points: points["slip"], True)
        self._present.require_results()
        zones = self._surfaces.zones
        each = iter([zone.cpp.slips_without_friction() for zone in zones])
        return self._average("slip", lambda _: next(each), True)

    def accumulated_slip(self) -> Function:
        """Length of the slip of all accepted steps."""
        slip = self._surfaces.zones[0].slip
        if slip is None:
            raise ContactError(
                "slip is accumulated with friction only: friction=Coulomb(0.0) has it "
                "without tangential tractions"
            )
        f = Function(self._surfaces.scalar, name="accumulated_slip")
        f.x.array[:] = slip.x.array
        return f

    def status(self) -> Function:
        """`NodeStatus` of the slave nodes."""
        f = self._average("status", lambda points: points["status"] - OPEN)
        f.x.array[:] = np.round(f.x.array)
        return f

    def coverage(self) -> Function:
        """Share of the slave surface around each node that has a hit."""
        return self._average(
            "coverage", lambda points: points["status"] >= OPEN, hits_only=False
        )

    def all(self) -> list[Function]:
        """All of them, without NaN, and the multiplier."""
        # DOLFINx 0.5 interpolates for XDMF, and a NaN then takes its whole cell
        found = [self.gap(0.0), self.traction("normal"), self.traction("tangential")]
        found += [self.status(), self.coverage()]
        if self._friction is not None:
            found.append(self.slip())
        multiplier = self._surfaces.multiplier
        return found if multiplier is None else [multiplier, *found]
