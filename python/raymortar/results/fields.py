"""What a user reads off a contact: fields, resultants, points, counts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..checked import is_whole_number
from ..compat import Array
from ..errors import ContactError, as_path, raise_everywhere, together
from ..host.layout import Layout
from ..interface.point_results import (
    OPEN,
    SLIP,
    Resultant,
    Statistics,
    added,
    along_normal,
    nodal_average,
    resultant,
    resultant_on,
    resultants,
    statistics,
)
from ..interface.zones import ZoneData
from ..rigid.body import Body
from .segments import write_segments

PARTS = ("total", "normal", "tangential")


class ZoneResults:
    """Results of all zones at the last `update`, of one contact or several."""

    zones: Any
    u: Any
    layout: Any
    contacts: Any
    pairs: Any
    updates: int
    preallocations: int
    _comm: MPI.Comm

    def points(self, zone: int = 0) -> dict[str, Array]:
        """Arrays over this rank's integration points of a zone, at the last `update`.

        Parameters
        ----------
        zone
            Number of the slave surface, from 0 on in the order of pairs.

        Returns
        -------
        Arrays by name, n rows each:

        - ``x`` (n, d): deformed position; ``normal`` (n, d): the slave's, outward
        - ``gap``: of the law, with the offset; negative in penetration. Length
        - ``distance``: slave to master along the normal, without the offset. Length
        - ``pressure``: what the law presses with, **negative in compression**, 0 where
          it is open. Traction
        - ``traction`` (n, d): what acts on the slave, in global coordinates
        - ``slip`` (n, d), with friction only: since the accepted step. Length
        - ``status``: a `PointStatus`
        - ``weight``: area for which a point stands, by `measure`, of a full turn if the
          contact is axisymmetric: sums over points are integrals. **Negative** at points
          without hit that take from a whole facet what its segments cover. ``area``:
          the same in the undeformed configuration
        - ``pair``: number of the pair in `pairs`, -1 where no master is hit
        - ``slave``, ``master``: facets by their local numbers, -1 for no master;
          ``xi``, ``eta`` (n, d - 1): reference coordinates on these
        - ``seed``: master facet of the segment, on which the ray starts its search; -1
          on uncovered parts. ``ray``: how the search ended, 0 for a hit
        """
        data = self._zone(zone)
        points: dict[str, Any] = data.points()
        # What comes after the last stands for no master
        number = np.array([*self._pairs_of(zone), -1], dtype=np.int32)
        points["pair"] = number[data.masters_of(points)]
        return points

    def _pairs_of(self, zone: int) -> list[int]:
        """Which of `pairs` each master tag of a slave surface makes with it."""
        surface = range(len(self.zones))[zone]
        of_master = {
            p.master: k for k, p in enumerate(self.pairs) if p.surface == surface
        }
        return [of_master[tag] for tag in self.zones[zone].facets.master_tags]

    def _zone(self, i: int) -> ZoneData:
        """Zone of a number, with results."""
        self._require_results()
        n = len(self.zones)
        if not (is_whole_number(i) and -n <= i < n):
            raise self._no_surface(i)
        return self.zones[i]

    def _no_surface(self, i: Any) -> ContactError:
        names = dict.fromkeys(p.slave_name for p in self.pairs if p.slave_name)
        named = f", or named {', '.join(map(repr, names))}" if names else ""
        return ContactError(
            f"there is no slave surface {i!r}: they are numbered from 0 to "
            f"{len(self.zones) - 1}, in the order of pairs{named}"
        )

    def _require_results(self) -> None:
        """Raise before the first `update`, of which all ranks know."""
        if self.updates == 0:
            raise ContactError("there are no results yet: call update, or solve, first")

    def write_segments(self, path: str | Path) -> None:
        """Segments and integration points as VTK files for ParaView. Collective.

        Writes ``<path>`` with one polygon (line in 2D) for each part of a slave facet
        that faces one master facet, in the deformed configuration, and
        ``<stem>_points.vtu`` with the integration points; in parallel, one piece of
        each per rank and a ``.pvtu`` file that joins them.

        Parameters
        ----------
        path
            File name that ends in ``.vtu``.
        """
        with together(self._comm):
            self._require_results()
            file = as_path(path)
        write_segments(self.zones, self.u, self._comm, file)

    def resultant(
        self, slave: int | str = 0, master: int | str | Body | None = None
    ) -> Resultant:
        """Contact force on a slave surface, or of a pair, its moment and its parts.

        The force on the slave; that on the master is the opposite. With
        ``axisymmetric=True`` it is that of a full turn, along the axis, and ``radial``
        has what cancels in it: see `results.Resultant`. Collective.

        Parameters
        ----------
        slave
            With a master the slave of the pair, its name or tag. Without one its name,
            or the number of the slave surface, from 0 on in the order of pairs.
        master
            Name or tag, or a `rigid.Body`. None: all that the slave meets.

        Raises
        ------
        ContactError
            If there is no such surface or pair.

        Examples
        --------
        >>> contact.resultant("ring", "plate").force
        >>> contact.resultant("ring").force  # of all its pairs
        """
        if master is None and not isinstance(slave, str):
            with together(self._comm):
                zone = self._zone(slave)
            return resultant(zone, self._comm)
        with together(self._comm):
            self._require_results()
            found = self._pairs_named(slave, master)
        if master is None:
            surfaces = dict.fromkeys(self.pairs[k].surface for k in found)
            return added([resultant(self.zones[i], self._comm) for i in surfaces])
        of_pairs = self.resultants()
        return added([of_pairs[k] for k in found])

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair, in the order of `pairs`. Collective."""
        with together(self._comm):
            self._require_results()
        found: list[Any] = [None] * len(self.pairs)
        for i, zone in enumerate(self.zones):
            for k, force in zip(self._pairs_of(i), resultants(zone, self._comm)):
                found[k] = force
        return found

    def resultant_on(self, body: Body) -> Resultant:
        """Contact force on a rigid body, moment about its centre where that is, and
        parts of the force, from all slaves that it meets. Collective.

        The opposite of `resultant`, whose moments are about the origin.

        Raises
        ------
        ContactError
            If no slave meets it.
        """
        with together(self._comm):
            self._require_results()
            if not any(body in zone.facets.bodies for zone in self.zones):
                raise ContactError(f"{body!r} is the master of no pair")
        return resultant_on(self.zones, body, self._comm)

    def _pairs_named(self, slave: Any, master: Any) -> list[int]:
        """Which pairs have a slave and, if one is given, a master, by name or tag."""
        both = [slave] if master is None else [slave, master]
        found, begin = [], 0
        for contact in self.contacts:
            for k, pair in enumerate(contact.pairs, begin):
                names = [
                    contact.names.get(s) if isinstance(s, str) else s for s in both
                ]
                if master is not None and master == pair.master_name:
                    names[1] = pair.master  # a rigid body has a name of its own
                if [pair.slave, pair.master][: len(names)] == names:
                    found.append(k)
            begin += len(contact.pairs)
        if not found and master is None:
            raise self._no_surface(slave)
        if not found:
            known = ", ".join(map(str, self.pairs))
            asked = ", ".join(map(repr, both))
            raise ContactError(
                f"there is no contact of ({asked}): pairs of (slave, master) are "
                f"{known}, and their forces those on the slave"
            )
        return found

    @property
    def statistics(self) -> Statistics:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        counts = statistics(self.zones, self.layout)
        counts.preallocations = self.preallocations
        return counts


class ContactFields(ZoneResults):
    """Results at the last `update`; `Contact` has them all."""

    zones: list[ZoneData]
    friction: Any
    multiplier: Function | None
    u: Function
    layout: Layout
    _scalar: Any
    _vector: Any

    def _field(
        self,
        name: str,
        quantity: Callable[[dict[str, Array]], Array],
        vector: bool = False,
        elsewhere: float | None = 0.0,
        hits_only: bool = True,
    ) -> Function:
        """Nodal averages of a point quantity, and a value off the contact."""
        self._require_results()
        f = Function(self._vector if vector else self._scalar, name=name)
        nodal_average(self.zones, quantity, f, hits_only)
        if elsewhere is not None:
            f.x.array[np.isnan(f.x.array)] = elsewhere
        return f

    def gap(self) -> Function:
        """Gap at the slave nodes, negative in penetration; NaN where no hit. Length.

        The gap of the law, with the offset. Average over the integration points around
        each node. Collective.
        """
        return self._field("gap", lambda points: points["gap"], elsewhere=None)

    def traction(self, part: str = "total") -> Function:
        """Contact traction on the slave, global coordinates; 0 elsewhere. Collective.

        Per reference or current area, by `measure`.

        Parameters
        ----------
        part
            ``"total"``; ``"normal"``: along the slave's normal; ``"tangential"``: the
            rest, which is friction.
        """
        raise_everywhere(
            self._comm,
            None if part in PARTS else f"part must be one of {PARTS}, not {part!r}",
        )

        def quantity(points: dict[str, Array]) -> Array:
            total = points["traction"]
            if part == "total":
                return total
            normal = along_normal(points, total)
            return normal if part == "normal" else total - normal

        name = "traction" if part == "total" else f"{part}_traction"
        return self._field(name, quantity, vector=True)

    def slip(self) -> Function:
        """Slip since the accepted step, T_n w, at the slave nodes. Length. Collective.

        The motion of the slave over the master point it meets now, in the slave's
        tangent plane and in global coordinates, also where the contact is open; 0
        where no hit. After `advance` it is that of a step that has not begun: read it
        before.

        Raises
        ------
        ContactError
            Without friction, which needs no slip.
        """
        if self.friction is None:
            raise ContactError("slip is only known with friction")

        def quantity(points: dict[str, Array]) -> Array:
            return points["slip"] - along_normal(points, points["slip"])

        return self._field("slip", quantity, vector=True)

    def status(self) -> Function:
        """`NodeStatus` of the slave nodes: 0 open or no hit, 1 stick, 2 slip. Collective.

        Contact without friction is slip. The average over the points around each node,
        rounded. Numbers are one less than those of `PointStatus`, which tells points
        without hit from open ones.
        """
        f = self._field("status", lambda points: points["status"] - OPEN)
        f.x.array[:] = np.round(f.x.array)
        return f

    def coverage(self) -> Function:
        """Share of the slave surface around each node that has a hit. Collective.

        1 where every ray meets the master, 0 where none does and off the slave.
        """

        def quantity(points: dict[str, Array]) -> Array:
            return (points["status"] >= OPEN).astype(np.float64)

        return self._field("coverage", quantity, hits_only=False)

    def fields(self) -> list[Function]:
        """All nodal results of the last `update`, for XDMF or VTK files. Collective.

        Gap (0 where no hit: see coverage), normal and tangential traction, status,
        coverage, the multiplier if there is one, slip with friction: write them next to
        the displacement, ``io.write_xdmf(file, mesh, [u, *contact.fields()])``.
        """
        gap = self.gap()
        # DOLFINx 0.5 interpolates for XDMF, and a NaN then takes its whole cell
        gap.x.array[np.isnan(gap.x.array)] = 0.0
        found = [gap, self.traction("normal"), self.traction("tangential")]
        found += [self.status(), self.coverage()]
        if self.friction is not None:
            found.append(self.slip())
        return found if self.multiplier is None else [self.multiplier, *found]

    def friction_work(self) -> float:
        """Work that tangential tractions take in this step, before `advance`. Collective.

        The integral of -t . T_n w over the slave surfaces: force times length, per
        thickness in 2D, or of a full turn. With a multiplier it is that of the points
        that slip, and never negative: where springs give a little back, nothing is
        lost. With the elastic penalty a part is stored in the springs.
        """
        if self.friction is None:
            return 0.0
        self._require_results()
        work = 0.0
        for zone in self.zones:
            points = zone.points()
            slip = points["slip"] - along_normal(points, points["slip"])
            by_area = -np.einsum("qi,qi->q", points["traction"], slip)
            if self.multiplier is not None:
                by_area = np.maximum(by_area, 0.0)[points["status"] == SLIP]
                weight = points["weight"][points["status"] == SLIP]
            else:
                weight = points["weight"]
            work += float(weight @ by_area)
        return float(self._comm.allreduce(work))
