"""One contact or several in one problem: states, accepted steps, results."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dolfinx.fem import Function

from . import compat
from .compat import Array
from .discretization.layout import CoupledRows
from .discretization.surfaces import Bodies
from .discretization.tagged import ALL
from .discretization.unknowns import Unknowns
from .errors import raise_everywhere, warn
from .interface.pairs import Pair, PairTable
from .results.points import PointResults
from .results.sums import Statistics, statistics
from .rigid.body import Body
from .state import (
    Owners,
    Quantity,
    State,
    common,
    copy_of,
    fault_of,
    of_function,
    of_part,
)
from .state import restore as write_all
from .system.assembly import ContactAssembly
from .system.coupled import CoupledSystem


class Interaction(PointResults, CoupledSystem):
    """One contact, or several in one problem: the base of `Contact`.

    Parts add to matrices and vectors, and each part's ``present`` pairs surfaces.
    ``owners`` have further arrays of the state: ``contact.owners["motion"] = motion``.
    """

    owners: Owners

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

    def quantities(self) -> Iterator[Quantity]:
        """Yield the arrays of the accepted step and the present unknowns, each once, with
        what further owners have."""
        yield from self._of_contact()
        yield from self.owners

    def _of_contact(self) -> Iterator[Quantity]:
        """Yield the arrays of contact itself."""
        unknowns, first = self.unknowns, 0
        yield common("contacts", [len(self.parts)], _other_number)
        for k, f in enumerate(unknowns.functions):
            yield of_function(f"unknown {k}", f, is_unknown=True)
        for k, one in enumerate(unknowns.displacements):
            yield self._accepted(k, one.u.function_space)
        for k, part in enumerate(self.parts):
            yield from part.present.quantities(k, first)
            first += len(part.zones)
        for k, body in enumerate(self._free):
            of = body.freedom.state, body.freedom.restore
            yield Quantity(f"free body {k}", *of, is_unknown=True)

    def _accepted(self, k: int, V: Any) -> Quantity:
        """The displacement of a mesh at the accepted step, which parts have alike."""
        places = self.unknowns.u_places(k)
        first, *others = [
            of_part(f"accepted {k}", part.present, "u_old", places, V)
            for part in self.parts
        ]

        def write(values: Array) -> None:
            for one in (first, *others):
                one.write(values)

        return replace(first, write=write)

    @property
    def _free(self) -> list[Body]:
        """The free rigid bodies, each once: several contacts may meet a body."""
        return list(dict.fromkeys(b for part in self.parts for b in part.layout.bodies))

    def changing(self) -> list[Quantity]:
        """The arrays that a solve changes: unknowns, multipliers, free bodies."""
        return [one for one in self._of_contact() if one.is_unknown]

    def _fields(self) -> list[Quantity]:
        """Unknowns and multipliers."""
        return [one for one in self.changing() if one.by is not None]

    def values_of(self, state: State) -> Array:
        """All local unknowns in a state."""
        count = len(self.unknowns.functions)
        arrays = [state[f"unknown {k}"] for k in range(count)]
        return arrays[0] if count == 1 else np.concatenate(arrays)

    def u_of(self, state: State) -> Array:
        """The displacement in a state, of this rank's dofs."""
        return self.values_of(state)[self.unknowns.u_local]

    def state(self) -> State:
        """Copy of all unknowns, multipliers and histories, for `restore`: arrays by
        name, such as ``"unknown 0"`` and ``"accepted 0"``, the accepted displacement.
        """
        self.unknowns.pull()
        return copy_of(self.quantities())

    def restore(self, state: State) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        If there were results before, they are updated to this state.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        raise_everywhere(self._comm, fault_of(state, self.quantities()))
        write_all(state, self.quantities())
        self.owners.note(state)
        for part in self.parts:
            part.present.restored()
        if any(part.present.updates for part in self.parts):
            self.update()

    def extrapolate(self, now: State, last: State, ratio: float) -> None:
        """Add a multiple of the change between two states to all unknowns."""
        for one in self._fields():
            values = np.asarray(one.read())
            one.write(values + ratio * (now[one.name] - last[one.name]))
        for k, body in enumerate(self._free):
            end, begin = (
                body.freedom.totals_of(s[f"free body {k}"]) for s in (now, last)
            )
            body.freedom.values = body.freedom.values + ratio * (end - begin)
        self.unknowns.pull()

    def go_back(self, begin: State, share: float) -> None:
        """Take back all but a share of the change of all unknowns since a state."""
        for one in self._fields():
            start = begin[one.name]
            one.write(start + share * (np.asarray(one.read()) - start))
        for k, body in enumerate(self._free):
            start = begin[f"free body {k}"][: len(body.freedom)]
            body.freedom.values = start + share * (body.freedom.values - start)
        self.unknowns.pull()

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
        self._contacts, self.owners = tuple(contacts), Owners()
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


def _other_number(there: Array, here: Array) -> str:
    """Say that a state is of more contacts or fewer."""
    return f"the state is of {there[0]:.0f} contacts, here are {here[0]:.0f}"


def _same_displacement(one: Unknowns, other: Unknowns) -> bool:
    """Whether two hosts have one displacement, on the same meshes in one order."""
    parts = list(zip(one.displacements, other.displacements))
    return len(one.displacements) == len(other.displacements) and all(
        compat.same_values(a.given, b.given) and a.component == b.component
        for a, b in parts
    )
