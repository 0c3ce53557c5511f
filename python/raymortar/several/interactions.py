"""Several contacts as one object, and what may be in one problem."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..core import compat
from ..core.discretization.tagged import ALL
from ..core.discretization.unknowns import Unknowns
from ..core.errors import raise_everywhere
from ..core.interaction import Interaction
from ..core.interface.pairs import PairTable
from ..core.target import Target
from .system import SeveralSystem


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
        self._contacts = tuple(contacts)
        super().__init__(
            SeveralSystem(
                contacts[0].unknowns, [contact.assembly for contact in contacts]
            ),
            PairTable.joined(
                [contact.pair_table for contact in contacts],
                [len(contact.zones) for contact in contacts],
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
        if contact.system.axisymmetric != first.system.axisymmetric:
            return (
                f"{which} has axisymmetric={contact.system.axisymmetric}, contact[0] "
                f"{first.system.axisymmetric}: one form is of a full turn, or of none"
            )
    return _fault_beside_all(contacts)


def _fault_beside_all(contacts: Sequence[Any]) -> str | None:
    """Why no other contact may be beside one of all facets, if so. Ties may."""
    meshed = [
        [pair for pair in contact.pairs if not isinstance(pair.master, Target)]
        for contact in contacts
    ]
    of_all = [i for i, pairs in enumerate(meshed) if any(p.slave == ALL for p in pairs)]
    # Of each tool that all facets meet, the first contact in which they do
    tools = {
        pair.master: i
        for i, contact in reversed(list(enumerate(contacts)))
        for pair in contact.pairs
        if pair.slave == ALL and isinstance(pair.master, Target)
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


def _same_displacement(one: Unknowns, other: Unknowns) -> bool:
    """Whether two hosts have one displacement, on the same meshes in one order."""
    parts = list(zip(one.displacements, other.displacements))
    return len(one.displacements) == len(other.displacements) and all(
        compat.same_values(a.given, b.given) and a.component == b.component
        for a, b in parts
    )
