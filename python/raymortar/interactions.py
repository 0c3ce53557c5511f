"""Several contacts in one problem, as one object for what solves it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from mpi4py import MPI

from dolfinx.fem import Function

from . import compat
from .compat import Array
from .contact import Contact
from .errors import ContactError, ContactWarning, raise_everywhere
from .host.bodies import Bodies
from .host.host import Host
from .host.layout import JointLayout
from .interface.pairs import Pair, labelled
from .interface.state import JointState, joint_fault
from .interface.stiffness import VolumePattern
from .interface.zones import ZoneData
from .results.fields import ZoneResults
from .results.summaries import of_contacts
from .system.coupled import CoupledSystem


class Interactions(CoupledSystem, ZoneResults):
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
        Rows of all unknowns: [host | multipliers of each contact], rank by rank.

    Raises
    ------
    ContactError
        If one is there twice, or if their displacements are not the same.
    """

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self.contacts: tuple[Contact, ...] = tuple(contacts)
        self._comm: MPI.Comm = contacts[0].layout.comm
        raise_everywhere(self._comm, _fault(self.contacts))
        _warn_of_shared_pairs(self.contacts)
        self.layout: JointLayout
        self._volume: Any = None

    def __repr__(self) -> str:
        return of_contacts(self.contacts)

    @property
    def host(self) -> Host:  # type: ignore[override]
        """What is solved for, see `host.Host`."""
        return self.contacts[0].host

    @property
    def u(self) -> Function:
        """Displacement, see `Contact`."""
        return self.contacts[0].u

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self.contacts[0].u_old

    @property
    def axisymmetric(self) -> bool:  # type: ignore[override]
        """Whether integrals go over a full turn, those of all contacts."""
        return self.contacts[0].axisymmetric

    @property
    def bodies(self) -> Bodies:
        """Parts of the mesh that hang together, by displacement node."""
        return self.contacts[0].bodies

    @property
    def zones(self) -> list[ZoneData]:
        """Those of all contacts."""
        return [zone for contact in self.contacts for zone in contact.zones]

    @property
    def pairs(self) -> list[Pair]:
        """Those of all contacts, with slave surfaces numbered on."""
        found, begin = [], 0
        for contact in self.contacts:
            found += [replace(p, surface=begin + p.surface) for p in contact.pairs]
            begin += len(contact.zones)
        return labelled(found)

    @property
    def gamma(self) -> list[Any] | None:
        """Coefficient of each contact; None until all have one."""
        found = [contact.gamma for contact in self.contacts]
        return None if any(gamma is None for gamma in found) else found

    @property
    def gamma_scale(self) -> list[float]:
        """By what each contact's multiplier is divided among the unknowns."""
        return [contact.gamma_scale for contact in self.contacts]

    @property
    def updates(self) -> int:  # type: ignore[override]
        """Updates that all contacts have had."""
        return min(contact.updates for contact in self.contacts)

    @property
    def revision(self) -> int:
        """Changes so far of what an assembled residual depends on."""
        return sum(contact.revision for contact in self.contacts)

    @property
    def preallocations(self) -> int:  # type: ignore[override]
        """Of matrices."""
        return max(contact.preallocations for contact in self.contacts)

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take what a problem solves for, the displacement among it. Collective.

        Raises
        ------
        ContactError
            If the displacement is none of it, or if a contact belongs to a problem with
            other unknowns or other contacts.
        """
        partners = tuple(contact.number for contact in self.contacts)
        for contact in self.contacts:
            contact.settle(functions, partners)
        self.layout = JointLayout([contact.layout for contact in self.contacts])
        for contact in self.contacts:
            contact.send_rows()
            contact.meet(self.contacts)

    def belong_to(self, volume: VolumePattern) -> None:
        """Go over to the volume, of `prepare`, of another problem of these contacts."""
        self._volume = volume
        for contact in self.contacts:
            contact.belong_to(volume)

    # State

    def update(self, rays_only: bool = False) -> None:
        """`Contact.update` of each. Collective."""
        for contact in self.contacts:
            contact.update(rays_only)

    def advance(self) -> None:
        """Accept the step, see `Contact.advance`. Collective."""
        for contact in self.contacts:
            contact.advance()

    def state(self) -> JointState:
        """Copy of all unknowns, multipliers and histories, for `restore`."""
        return JointState(tuple(contact.state() for contact in self.contacts))

    def restore(self, state: JointState) -> None:
        """Go back to a state of these contacts, or of ones made alike. Collective.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        raise_everywhere(self._comm, joint_fault(state, self.contacts))
        for contact, part in zip(self.contacts, state.parts):
            contact.restore(part)

    def friction_work(self) -> float:
        """`Contact.friction_work` of all. Collective."""
        return sum(contact.friction_work() for contact in self.contacts)


def one_or_several(given: Any) -> Contact | Interactions:
    """A contact as it is, a list of several as one object. Collective.

    Raises
    ------
    ContactError
        If there is none, or something that is no contact.
    """
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
            return f"contact[{i}], of slave {contact.tags}, is in the list twice"
        if not _same_displacement(first.host, contact.host):
            return (
                f"contact[{i}], of slave {contact.tags}, has the displacement "
                f"{contact.host.name}, contact[0] another one, {first.host.name}: all "
                "contacts of a problem must be made with the same"
            )
        if contact.axisymmetric != first.axisymmetric:
            return (
                f"contact[{i}], of slave {contact.tags}, has axisymmetric="
                f"{contact.axisymmetric}, contact[0] {first.axisymmetric}: one form is "
                "of a full turn, or of none"
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
                warnings.warn(
                    f"contact[{known[sides]}] and contact[{i}] both have multipliers "
                    f"on slave tag {pair.slave} and master {pair.master}: only the sum "
                    "of their tractions is determined, and the linear solver may fail; "
                    "give the pair to one of them, or one of them a Penalty",
                    ContactWarning,
                    stacklevel=4,
                )
            known[sides] = i


def _same_displacement(one: Host, other: Host) -> bool:
    """Whether two hosts have one displacement, on the same meshes in one order."""
    parts = list(zip(one.displacements, other.displacements))
    return len(one.displacements) == len(other.displacements) and all(
        compat.same_values(a.given, b.given) and a.component == b.component
        for a, b in parts
    )
