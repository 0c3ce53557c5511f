"""Fields of a contact at its slave nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array
from ..core.errors import ContactError, raise_everywhere, together
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.point_results import (
    CLOSED,
    OPEN,
    OfPoints,
    Status,
    nodal_average,
    pressures,
    set_at_nodes,
)
from ..core.interface.present import PresentState
from ..core.options.friction import Law
from ..core.options.methods import Penalty
from .points import Results
from .sums import elastic_energy, friction_work, stored_energy
from .tractions import traction_part, tractions

PARTS = ("total", "normal", "tangential")


def check_part(part: Any, comm: MPI.Comm) -> None:
    """Raise unless a part of a traction is known. Collective."""
    raise_everywhere(
        comm, None if part in PARTS else f"part must be one of {PARTS}, not {part!r}"
    )


class ContactResults(Results):
    """Results of one contact: at points, at slave nodes, and its energies, at the last
    update. Collective."""

    def __init__(self, contact: Any) -> None:
        super().__init__(contact)
        self.surfaces: ContactSurfaces = contact.surfaces
        self.friction: Law | None = contact.friction
        self._present: PresentState = contact.assembly.present

    def _average(
        self,
        name: str,
        quantity: OfPoints,
        vector: bool = False,
        elsewhere: float = 0.0,
        hits_only: bool = True,
    ) -> Function:
        """Nodal averages of a point quantity, and a value off the contact."""
        f = self._new(name, vector)
        nodal_average(self.surfaces.zones, quantity, f, hits_only)
        f.x.array[np.isnan(f.x.array)] = elsewhere
        return f

    def _new(self, name: str, vector: bool) -> Function:
        """Zero Function for results of the last update, which there must be."""
        self._present.require_results()
        made = self.surfaces
        return Function(made.vector if vector else made.scalar, name=name)

    def _of_law(
        self,
        name: str,
        quantity: OfPoints,
        vector: bool = False,
    ) -> Function:
        """Take what a law gives: one at nodes these values, others means of points."""
        zones, lam = self.surfaces.zones, self.surfaces.multiplier
        if not zones[0].has_law_at_nodes:
            return self._average(name, quantity, vector)
        f = self._new(name, vector)
        set_at_nodes(zones, lambda zone: quantity(tractions(zone, lam)), f)
        return f

    def _gap(self, elsewhere: float) -> Function:
        return self._average("gap", lambda points: points["gap"], elsewhere=elsewhere)

    def gap(self) -> Function:
        """See `Contact.gap`. Collective."""
        return self._gap(np.nan)

    def traction(self, part: str = "total") -> Function:
        """See `Contact.traction`. Collective."""
        check_part(part, self.surfaces.comm)
        name = "traction" if part == "total" else f"{part}_traction"
        return self._of_law(name, lambda points: traction_part(points, part), True)

    def pressure(self) -> Function:
        """See `Contact.pressure`. Collective."""
        return self._of_law("pressure", pressures)

    def slip(self) -> Function:
        """See `Contact.slip`. Collective."""
        if self.surfaces.tied is not None:
            raise ContactError("a Tie does not slip")
        if self.friction is not None:
            return self._of_law("slip", lambda points: points["slip"], True)
        self._present.require_results()
        zones = self.surfaces.zones
        each = iter([zone.cpp.slips_without_friction() for zone in zones])
        return self._average("slip", lambda _: next(each), True)

    def accumulated_slip(self) -> Function:
        """Sum of the lengths of the slip of all accepted steps. Length. Collective.

        It belongs to the slave's material: `advance` averages the length of the slip of
        closed points to the slave nodes and adds it there. `History` and `Output`
        record a step before that, and so without its slip.

        Raises
        ------
        ContactError
            Without friction, which counts it.
        """
        slip = self.surfaces.zones[0].slip
        if slip is None:
            raise ContactError(
                "slip is accumulated with friction only: friction=Coulomb(0.0) has it "
                "without tangential tractions"
            )
        f = Function(self.surfaces.scalar, name="accumulated_slip")
        f.x.array[:] = slip.x.array
        return f

    def to_nodes(
        self, values: Array | Sequence[Array], name: str = "values"
    ) -> Function:
        """Average values at the integration points around each slave node. Collective.

        Points weigh by their area times the square of the node's shape function. As
        `gap` does with ``points()["gap"]``.

        Parameters
        ----------
        values
            A number or a vector for each of this rank's `points`, (n,) or (n, d). For
            several slave surfaces a list, in their order.
        name
            Name of the Function.

        Returns
        -------
        Function
            NaN where no ray hits a master.

        Raises
        ------
        ContactError
            If there is not one value for each point.

        Examples
        --------
        >>> points = contact.points()
        >>> n, t = points["normal"], points["traction"]
        >>> shear = np.linalg.norm(t - np.sum(n * t, axis=1)[:, None] * n, axis=1)
        >>> contact.results.to_nodes(shear, "shear")
        """
        each = [values] if isinstance(values, np.ndarray) else values
        self._present.require_results()
        zones = self.surfaces.zones
        with together(self.surfaces.comm):
            given = [np.asarray(one) for one in each]
            dim = zones[0].facets.slave_surface.gdim
            wanted = [len(zone.points()["weight"]) for zone in zones]
            shapes = [one.shape for one in given]
            if shapes not in ([(n,) for n in wanted], [(n, dim) for n in wanted]):
                raise ContactError(
                    f"values of shapes {shapes} are not one for each point: the slave "
                    f"surfaces have {wanted} points, and a value is a number or a "
                    f"vector of {dim}"
                )
        each_given = iter(given)
        return self._average(
            name, lambda _: next(each_given), given[0].ndim == 2, np.nan
        )

    def status(self) -> Function:
        """See `Contact.status`. Collective."""
        if self.surfaces.zones[0].has_law_at_nodes:
            return self._of_law("status", lambda at: at["status"])
        f = self._average("status", lambda at: at["status"] >= CLOSED, False, np.nan)
        slips = self._average("slips", lambda at: at["status"] == Status.SLIP).x.array
        closed = f.x.array
        cases = np.isnan(closed), closed < 0.5, slips < 0.5 * closed
        numbers = [float(s) for s in (Status.NO_HIT, Status.OPEN, Status.STICK)]
        f.x.array[:] = np.select(cases, numbers, float(Status.SLIP))
        return f

    def coverage(self) -> Function:
        """Share of the slave surface around each node that has a hit. Collective.

        1 where every ray meets the master, 0 where none does and off the slave.
        """
        return self._average(
            "coverage", lambda points: points["status"] >= OPEN, hits_only=False
        )

    def fields(self) -> list[Function]:
        """See `Contact.fields`. Collective."""
        # DOLFINx 0.5 interpolates for XDMF, and a NaN then takes its whole cell
        found = [self._gap(0.0), self.traction("normal"), self.traction("tangential")]
        found += [self.status(), self.coverage()]
        if self.friction is not None:
            found.append(self.slip())
        if self._contact.bond is not None:
            found.append(self._contact.bond.damage())
        multiplier = self.surfaces.multiplier
        return found if multiplier is None else [multiplier, *found]

    def friction_work(self) -> float:
        """See `Contact.friction_work`. Collective."""
        if self.friction is None:
            return 0.0
        self._present.require_results()
        return friction_work(self.zones, self.surfaces.multiplier)

    def stored_energy(self, part: str = "total") -> float:
        """See `Contact.stored_energy`. Collective."""
        check_part(part, self._comm)
        method, elastic = self._contact.method, 0.0
        is_penalty = isinstance(method, Penalty)
        options = self.surfaces.options
        has_springs = options.has_springs
        if has_springs and options.has_elastic_slip:
            self._present.require_results()
            elastic = 0.0 if part == "normal" else elastic_energy(self.zones)
            has_springs = False
        if not is_penalty or method.exact:
            return elastic
        self._present.require_results()
        if self.friction is not None and not has_springs:
            if part == "tangential":
                return elastic
            part = "normal"
        return elastic + stored_energy(self.zones, part)


def results_of(contact: Any) -> Results:
    """Make the results of a contact, or the common ones of several in one problem."""
    is_one = contact.contacts == (contact,)
    return ContactResults(contact) if is_one else Results(contact)
