"""One contact or several in one problem: states, accepted steps, results."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from dolfinx.fem import Function

from . import compat
from .compat import Array
from .discretization.layout import CoupledRows
from .discretization.surfaces import Bodies
from .discretization.tagged import ALL
from .discretization.unknowns import Unknowns
from .errors import raise_everywhere, warn
from .interface.pairs import Pair, PairTable
from .interface.present import JointState, State
from .results.points import PointResults
from .results.sums import Statistics, statistics
from .rigid.body import Body
from .system.assembly import ContactAssembly
from .system.coupled import CoupledSystem


class Interaction(PointResults, CoupledSystem):
    """One contact, or several in one problem: the base of `Contact`.

    Parts add to matrices and vectors, and each part's ``present`` pairs surfaces.
    """

    def __init__(
        self, unknowns: Unknowns, parts: Sequence[ContactAssembly], pairs: PairTable
    ) -> None:
        super().__init__(unknowns, parts)
        self.pair_table = pairs

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
        return self.pair_table.pairs

    @property
    def bodies(self) -> Bodies:
        """Parts of the mesh that are connected, by displacement node."""
        return self.parts[0].surfaces.bodies

    # State

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self.parts[0].present.u_old

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The history is the old displacement and, with friction, the tractions of the
        friction springs on each slave facet (none with ``tangential="rate"``). Results
        are updated first if the state has changed since the last `update`. They then
        belong to the accepted step until the next `update`.
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

        If there were results before, they are updated to this state.

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

    @property
    def results(self) -> PointResults:
        """Results at the integration points: its own methods."""
        return self

    @property
    def statistics(self) -> Statistics:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        counts = statistics(self.zones, self.layout)
        counts.preallocations = self.preallocations
        return counts


class Interactions(Interaction):
    """Contacts that one problem solves for together. Collective.

    `NonlinearProblem.contact`, where a problem is given a list of contacts. Each keeps
    its own multiplier, coefficient, law, search and fields. This class has their common
    results, and calls them one after the other. Zones are numbered through, in the
    order of the contacts.

    Parameters
    ----------
    contacts
        Two or more, of the same displacement.

    Attributes
    ----------
    layout
        Rows of the unknowns: [forms | multipliers of each contact], rank by rank.

    Raises
    ------
    ContactError
        If one is listed twice, or if their displacements are not the same.
    """

    def __init__(self, contacts: Sequence[Any]) -> None:
        raise_everywhere(contacts[0].layout.comm, _fault(contacts))
        _warn_of_shared_pairs(contacts)
        self._contacts = tuple(contacts)
        self.join()

    def join(self) -> None:
        """Join the present parts and pairs of the contacts."""
        super().__init__(
            self.contacts[0].unknowns,
            [contact.assembly for contact in self.contacts],
            PairTable.joined(
                [contact.pair_table for contact in self.contacts],
                [len(contact.zones) for contact in self.contacts],
            ),
        )

    def __repr__(self) -> str:
        contacts = ", ".join(map(repr, self.contacts))
        return f"<Interactions of {len(self.contacts)}: {contacts}>"

    @property
    def contacts(self) -> tuple[Any, ...]:
        """The contacts, in the order of their multipliers' rows."""
        return self._contacts

    @property
    def gamma(self) -> list[Any] | None:
        """Coefficient of each contact; None until all have one."""
        found = [contact.gamma for contact in self.contacts]
        return None if any(gamma is None for gamma in found) else found

    @property
    def gamma_scale(self) -> list[float]:
        """Divisors of each contact's multiplier among the unknowns."""
        return self._scales

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take what a problem solves for, the displacement among it. Collective.

        Raises
        ------
        ContactError
            If the displacement is none of it, or if a contact belongs to a problem with
            other unknowns or other contacts.
        """
        partners = tuple(part.number for part in self.parts)
        for part in self.parts:
            part.set_functions(functions, partners)
        self.layout = CoupledRows(self.unknowns, [part.layout for part in self.parts])
        surfaces = [part.surfaces for part in self.parts]
        for part in self.parts:
            part.send_rows()
            part.find_cross_points(surfaces)

    def friction_work(self) -> float:
        """`Contact.friction_work` of all. Collective."""
        return sum(contact.friction_work() for contact in self.contacts)

    def stored_energy(self, part: str = "total") -> float:
        """`Contact.stored_energy` of all. Collective."""
        return sum(contact.stored_energy(part) for contact in self.contacts)


def _fault(contacts: Sequence[Any]) -> str | None:
    """Why contacts cannot be in one problem, if so."""
    first = contacts[0]
    for i, contact in enumerate(contacts):
        which = f"contact[{i}], of slave {contact.assembly.surfaces.tags},"
        if any(contact is other for other in contacts[:i]):
            return f"{which} is in the list twice"
        if not _same_displacement(first.unknowns, contact.unknowns):
            return (
                f"{which} has the displacement {contact.unknowns.name}, contact[0] another "
                f"one, {first.unknowns.name}: all contacts of a problem must be made with "
                "the same"
            )
        if contact.axisymmetric != first.axisymmetric:
            return (
                f"{which} has axisymmetric={contact.axisymmetric}, contact[0] "
                f"{first.axisymmetric}: one form is of a full turn, or of none"
            )
    return _fault_beside_all(contacts)


def _fault_beside_all(contacts: Sequence[Any]) -> str | None:
    """Why no other contact may be beside one of all facets, if so. Ties may."""
    meshed = [
        [pair for pair in contact.pairs if not isinstance(pair.master, Body)]
        for contact in contacts
    ]
    of_all = [i for i, pairs in enumerate(meshed) if any(p.slave == ALL for p in pairs)]
    # Of each tool that all facets meet, the first contact in which they do
    tools = {
        pair.master: i
        for i, contact in reversed(list(enumerate(contacts)))
        for pair in contact.pairs
        if pair.slave == ALL and isinstance(pair.master, Body)
    }
    for i, (contact, pairs) in enumerate(zip(contacts, meshed)):
        twice = [(pair, of_all[0]) for pair in pairs if of_all and contact.tied is None]
        twice += [(p, tools[p.master]) for p in contact.pairs if p.master in tools]
        for pair, j in twice:
            if i != j:
                return (
                    f"contact[{i}] has the pair {pair}, which is one of those of 'all' "
                    f"of contact[{j}]: its contact would be counted twice; leave it "
                    "out, or name all pairs"
                )
    return None


def _warn_of_shared_pairs(contacts: Sequence[Any]) -> None:
    """Say where several multipliers stand for the traction of one pair."""
    known: dict[frozenset[Any], int] = {}
    for i, contact in enumerate(contacts):
        if contact.assembly.surfaces.multiplier is None:
            continue
        for pair in contact.pairs:
            sides = frozenset((pair.slave, pair.master))
            if sides in known:
                slave = contact.zones[pair.surface].facets.spoken
                other = pair.master_name or pair.master
                warn(
                    f"contact[{known[sides]}] and contact[{i}] both have multipliers "
                    f"on {slave} and master {other}: only the sum "
                    "of their tractions is determined, and the linear solver may fail; "
                    "give the pair to one of them, or one of them a Penalty",
                )
            known[sides] = i


def _same_displacement(one: Unknowns, other: Unknowns) -> bool:
    """Whether two hosts have one displacement, on the same meshes in one order."""
    parts = list(zip(one.displacements, other.displacements))
    return len(one.displacements) == len(other.displacements) and all(
        compat.same_values(a.given, b.given) and a.component == b.component
        for a, b in parts
    )
