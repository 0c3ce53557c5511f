"""One contact or several: states, steps that are accepted, results."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from .compat import Array
from .discretization.bodies import Bodies
from .discretization.unknowns import Unknowns
from .errors import raise_everywhere
from .interface.pairs import Pair, PairTable
from .interface.state import JointState, State
from .results.meetings import Meeting
from .results.points import PointResults
from .results.sums import Resultant, Statistics, statistics
from .rigid.body import Body
from .system.assembly import ContactAssembly
from .system.coupled import CoupledSystem

# Without Python frames: each iterate asks
_REVISION = attrgetter("present.revision")


class Interaction(CoupledSystem):
    """One contact, or several in one problem: the base of `Contact`.

    Its public methods hand over to objects: `results` reads points, ``parts`` add to
    matrices and vectors, and each part's ``present`` pairs surfaces.

    Attributes
    ----------
    results
        Results at the integration points.
    """

    def __init__(
        self, unknowns: Unknowns, parts: Sequence[ContactAssembly], pairs: PairTable
    ) -> None:
        super().__init__(unknowns, parts)
        self.results = PointResults(
            self.zones,
            pairs,
            [part.present for part in self.parts],
            self.u,
            self._comm,
        )

    @property
    @abstractmethod
    def contacts(self) -> tuple[Any, ...]:
        """The contacts, in the order of their multipliers' rows."""

    @property
    def pairs(self) -> list[Pair]:
        """All pairs, each once, in the order in which they were given.

        Tags, names and the label of their columns in a `History`; ``points()["pair"]``
        and `resultants` count by them.
        """
        return self.results.pairs.pairs

    @property
    def bodies(self) -> Bodies:
        """Parts of the mesh that are connected, by displacement node."""
        return self.parts[0].surfaces.bodies

    # State

    @property
    def revision(self) -> int:
        """Changes so far of what an assembled residual depends on, `u` and `multiplier`
        aside: pairing, history, coefficient."""
        return sum(map(_REVISION, self.parts))

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self.parts[0].present.u_old

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The history is the old displacement, and with friction what its springs hold on
        each slave facet (none with ``tangential="rate"``), for which results are brought
        up to date if the state is another than at the last `update`. They stay those of
        the accepted step until the next one.
        """
        if self.updates and any(part.present.has_friction for part in self.parts):
            self.unknowns.pull()
            if self.cpp.has_moved():
                self.update()
        for part in self.parts:
            part.present.accept()

    def state(self) -> Any:
        """Copy of all unknowns, multipliers and histories, for `restore`."""
        copies = tuple(part.present.copy() for part in self.parts)
        return copies[0] if len(copies) == 1 else JointState(copies)

    def restore(self, state: State) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        Where there were results before, those are of this state now.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        raise_everywhere(self._comm, self._fault_of(state))
        for part, one in zip(self.parts, state.parts):
            part.present.restore(one)
        if any(part.present.updates for part in self.parts):
            self.update()

    def _fault_of(self, state: Any) -> str | None:
        """Return why the contacts cannot go back to a state, if so."""
        presents = [part.present for part in self.parts]
        if len(presents) == 1:
            return presents[0].fault_of(state)
        if not isinstance(state, JointState):
            return (
                f"state must be that of {len(presents)} contacts, as "
                f"problem.contact.state() gives it, not {type(state).__name__}"
            )
        if len(state.parts) != len(presents):
            return (
                f"the state is of {len(state.parts)} contacts, here are {len(presents)}"
            )
        faults = [one.fault_of(part) for one, part in zip(presents, state.parts)]
        found = [f"contact[{i}]: {f}" for i, f in enumerate(faults) if f is not None]
        return found[0] if found else None

    def extrapolate(self, now: State, last: State, ratio: float) -> None:
        """Add a multiple of the change between two states to all unknowns."""
        ends = [one.u if one.unknowns is None else one.unknowns for one in (now, last)]
        self.unknowns.set_values(self.unknowns.values() + ratio * (ends[0] - ends[1]))
        changes: dict[Body, Array] = {}  # several contacts may meet a body
        for part, new, old in zip(self.parts, now.parts, last.parts):
            f = part.surfaces.multiplier
            if f is not None and new.multiplier is not None:
                assert old.multiplier is not None
                f.x.array[:] += ratio * (new.multiplier - old.multiplier)
            for body, end, begin in zip(part.layout.bodies, new.freedoms, old.freedoms):
                totals = body.freedom.totals_of
                changes[body] = ratio * (totals(end) - totals(begin))
        for body, moved in changes.items():
            body.freedom.values = body.freedom.values + moved

    def go_back(self, begin: State, share: float) -> None:
        """Take back all but a share of the change of all unknowns since a state."""
        arrays = [(self.u.x.array, begin.u)]
        known: dict[Body, Array] = {}  # several contacts may meet a body
        for part, old in zip(self.parts, begin.parts):
            f = part.surfaces.multiplier
            if f is not None and old.multiplier is not None:
                arrays.append((f.x.array, old.multiplier))
            known.update(zip(part.layout.bodies, old.freedoms))
        arrays += [
            (body.freedom.values, old[: len(body.freedom)])
            for body, old in known.items()
        ]
        for values, start in arrays:
            values[:] = start + share * (values - start)

    # Results

    def points(
        self, zone: int | str = 0, master: int | str | Body | None = None
    ) -> dict[str, Array]:
        """Arrays over this rank's integration points of a slave, at the last `update`.

        Parameters
        ----------
        zone, master
            As `resultant`: the number of the slave surface, from 0 on in the order of
            pairs, or its name; with a master a pair, of which those points that hit it.

        Returns
        -------
        Arrays by name, n rows each:

        - ``x`` (n, d): deformed position; ``normal`` (n, d): the slave's, outward
        - ``gap``: of the law, with the offset; negative in penetration. Length
        - ``distance``: slave to master along the normal, without the offset. Length
        - ``pressure``: what the law presses with, **negative in compression**, 0 where
          it is open. Traction
        - ``traction`` (n, d): what acts on the slave, in global coordinates
        - ``slip`` (n, d), with friction only: T_n w since the accepted step, in the
          slave's tangent plane; ``closing``: how much of an open gap has closed since
          then; ``accumulated_slip``: length of the slip of all accepted steps. Length
        - ``gamma``: coefficient of the law. Traction per length
        - ``status``: a `PointStatus`
        - ``weight``: area for which a point stands, by `measure`, of a full turn if the
          contact is axisymmetric: sums over points are integrals. **Negative** at points
          without hit that take from a whole facet what its segments cover. ``area``:
          the same in the undeformed configuration
        - ``pair``: number of the pair in `pairs`, -1 where no master is hit
        - ``X`` (n, d): undeformed position; ``facet``, ``cell``: local index of the
          slave's facet and of its cell in DOLFINx's mesh; ``reference`` (n, d): where
          the point is on the reference cell, in DOLFINx's order. A Function ``f`` on
          the slave's mesh has the values ``f.eval(X, cell)``, X with 3 columns
        - ``slave``, ``master``: indices into this rank's facets with the tags, -1 for
          no master; ``xi``, ``eta`` (n, d - 1): reference coordinates on these, in an
          order of the library's own, see ``reference``
        - ``seed``: master facet of the segment, on which the ray starts its search; -1
          on uncovered parts. ``ray``: how the search ended, 0 for a hit
        """
        return self.results.points(zone, master)

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
        self.results.write_segments(path)

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
            or the number of the slave surface, from 0 on in the order of pairs. With
            ``pairs="all"`` any tag, or a body as `meetings` names it.
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
        self.results.warn_if_unsolved()
        return self.results.resultant(slave, master)

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair, in the order of `pairs`. Collective."""
        self.results.warn_if_unsolved()
        return self.results.resultants()

    def meetings(self) -> list[Meeting]:
        """Surfaces that are in contact at the last `update`, by name. Collective.

        Of ``pairs="all"`` and of a surface that meets itself, the tags and bodies that
        have found each other; of other pairs those that are closed.
        """
        return self.results.meetings()

    def resultant_on(self, body: Body) -> Resultant:
        """Contact force on a rigid body, moment about its centre where that is, and
        parts of the force, from all slaves that it meets. Collective.

        The opposite of `resultant`, whose moments are about the origin.

        Raises
        ------
        ContactError
            If no slave meets it.
        """
        self.results.warn_if_unsolved()
        return self.results.resultant_on(body)

    @property
    def statistics(self) -> Statistics:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        counts = statistics(self.zones, self.layout)
        counts.preallocations = self.preallocations
        return counts
