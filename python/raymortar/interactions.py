"""Several contacts in one problem, as one object for what solves it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from dolfinx.fem import Function

from . import compat
from .contact import Contact
from .discretization.layout import CoupledRows
from .discretization.tagged import ALL
from .discretization.unknowns import Unknowns
from .errors import ContactError, ContactWarning, raise_everywhere
from .interaction import Interaction
from .interface.pairs import PairTable
from .rigid.body import Body


class Interactions(Interaction):
    """Contacts that one problem solves for together. Collective.

    `NonlinearProblem.contact`, where a problem is given a list of contacts. Each keeps
    its own multiplier, coefficient, law, search and fields. Here is what they have in
    common, and what they do one after the other. Their zones are numbered on, in the
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
        If one is there twice, or if their displacements are not the same.
    """

    def __init__(self, contacts: Sequence[Contact]) -> None:
        raise_everywhere(contacts[0].layout.comm, _fault(contacts))
        _warn_of_shared_pairs(contacts)
        self._contacts = tuple(contacts)
        super().__init__(
            contacts[0].unknowns,
            [contact.assembly for contact in contacts],
            PairTable.joined(
                [contact.pair_table for contact in contacts],
                [len(contact.zones) for contact in contacts],
            ),
        )

    def __repr__(self) -> str:
        contacts = ", ".join(map(repr, self.contacts))
        return f"<Interactions of {len(self.contacts)}: {contacts}>"

    @property
    def contacts(self) -> tuple[Contact, ...]:
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


def one_or_several(given: Any) -> Contact | Interactions:
    """A contact as it is, a list of several as one object. Collective."""
    if isinstance(given, Contact):
        return given
    if not isinstance(given, (list, tuple)):
        raise ContactError(
            f"contact must be a Contact, not {type(given).__name__}: of several "
            "interactions a list of them"
        )
    if not given:
        raise ContactError("contact is an empty list: give at least one Contact")
    for i, contact in enumerate(given):
        if not isinstance(contact, Contact):
            raise ContactError(
                f"contact[{i}] must be a Contact, not {type(contact).__name__}"
            )
    return given[0] if len(given) == 1 else Interactions(given)


def _fault(contacts: Sequence[Contact]) -> str | None:
    """Why contacts cannot be in one problem, if so."""
    first = contacts[0]
    for i, contact in enumerate(contacts):
        if any(contact is other for other in contacts[:i]):
            return (
                f"contact[{i}], of slave {contact.surfaces.tags}, is in the list twice"
            )
        if not _same_displacement(first.unknowns, contact.unknowns):
            return (
                f"contact[{i}], of slave {contact.surfaces.tags}, has the displacement "
                f"{contact.unknowns.name}, contact[0] another one, {first.unknowns.name}: all "
                "contacts of a problem must be made with the same"
            )
        if contact.axisymmetric != first.axisymmetric:
            return (
                f"contact[{i}], of slave {contact.surfaces.tags}, has axisymmetric="
                f"{contact.axisymmetric}, contact[0] {first.axisymmetric}: one form is "
                "of a full turn, or of none"
            )
    return _fault_beside_all(contacts)


def _fault_beside_all(contacts: Sequence[Contact]) -> str | None:
    """Why no other contact may be beside one of all facets, if so. Ties may."""
    meshed = [
        [pair for pair in contact.pairs if not isinstance(pair.master, Body)]
        for contact in contacts
    ]
    of_all = [i for i, pairs in enumerate(meshed) if any(p.slave == ALL for p in pairs)]
    for i, (contact, pairs) in enumerate(zip(contacts, meshed)):
        if of_all and i != of_all[0] and contact.tied is None and pairs:
            return (
                f"contact[{i}] has the pair {pairs[0]}, which is one of those of 'all' of "
                f"contact[{of_all[0]}]: its contact would be counted twice; leave it "
                "out, or name all pairs"
            )
    return None


def _warn_of_shared_pairs(contacts: Sequence[Contact]) -> None:
    """Say where several multipliers stand for the traction of one pair."""
    known: dict[frozenset[Any], int] = {}
    for i, contact in enumerate(contacts):
        if contact.multiplier is None:
            continue
        for pair in contact.pairs:
            sides = frozenset((pair.slave, pair.master))
            if sides in known:
                slave = contact.surfaces.zones[pair.surface].facets.spoken
                other = pair.master_name or pair.master
                warnings.warn(
                    f"contact[{known[sides]}] and contact[{i}] both have multipliers "
                    f"on {slave} and master {other}: only the sum "
                    "of their tractions is determined, and the linear solver may fail; "
                    "give the pair to one of them, or one of them a Penalty",
                    ContactWarning,
                    stacklevel=4,
                )
            known[sides] = i


def _same_displacement(one: Unknowns, other: Unknowns) -> bool:
    """Whether two hosts have one displacement, on the same meshes in one order."""
    parts = list(zip(one.displacements, other.displacements))
    return len(one.displacements) == len(other.displacements) and all(
        compat.same_values(a.given, b.given) and a.component == b.component
        for a, b in parts
    )
