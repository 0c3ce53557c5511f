"""Contact between tagged surfaces: the object a user makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function

from .discretization.slave_fields import FieldValue
from .discretization.surfaces import Smooth
from .errors import ContactError, of_type
from .hooks import hooks
from .interaction import Interaction
from .interface.coefficients import PairCoefficients
from .interface.contact_surfaces import ContactSurfaces, checked, make_surfaces
from .interface.offsets import Offsets
from .interface.point_results import CLOSED, OPEN
from .interface.present import PresentState
from .options.descriptions import shown
from .options.friction import Law
from .options.methods import AugmentedLagrangian, ContactOptions, Penalty, Search
from .state import State
from .system.assembly import ContactAssembly
from .system.coupled import CoupledSystem
from .terms import Adhesion, Term

__all__ = ["Contact", "State"]


class Contact(Interaction):
    """Contact integrals between tagged surfaces of a deforming mesh. Collective.

    Parameters
    ----------
    u
        Displacement: a vector-valued Lagrange function of degree 1 or 2, or a part of a
        mixed Function that is one, such as ``w.sub(0)``. If bodies have meshes of their
        own, a list. Its value now is the old displacement until `advance` is called.
    facet_tags
        Tags of exterior facets (``MeshTags``), for each mesh. With ``pairs="all"`` they
        are for names alone and may be None.
    pairs
        ``[(slave, master), ...]``: tags of facets by number or, with `names`, by name.
        Pairs with the same slave are one slave surface that meets all their masters. A
        master may be a shape of `rigid`, or a `rigid.Body` that moves one; with
        ``("all", tool)`` every exterior facet may meet it. With `Penalty` a tag may be
        slave and master, and with ``"all"``, which is ``[("all", "all")]``, every
        exterior facet may meet every other.
    method
        `AugmentedLagrangian` or `Penalty`; where a surface meets itself the latter.
    friction
        `Coulomb`, `Tresca`, `Stick` or `Friction`; None: frictionless.
    quadrature_degree
        Degree of the rule on each segment. None: the lowest beyond which more points
        reduce no error, by the facets and degrees of both sides.
    measure
        ``"reference"``: integrals over the undeformed slave surface, the multiplier is
        the nominal traction; ``"current"``: over the deformed one, Cauchy traction.
    search
        `Search` distances and strategy.
    tangent
        ``"full"``: the derivative includes the motion of segments and points with the
        bodies. ``"fixed"``: integration points stay where they are on the slave.
    names
        Facet tag by name: numbers, or (dimension, tag) as Gmsh's physical groups are
        read (``io.read_gmsh(...).names``).
    offset
        Length that is added to the gap. A positive one is a clearance, a negative one an
        interference, as of a press fit that is meshed without it. Number; scalar
        ``Function`` on the mesh of u; or a function of undeformed positions, (3, n) to
        (n,). See `set_offset`.
    axisymmetric
        Whether the 2D mesh is the section of solids of revolution, with coordinates
        (r, z) = (x[0], x[1]): integrals then go over a full turn, with the weight
        2 pi r of `measure`. The form must have it, too.
    smooth
        Whether straight facets are curved, so that contact meets the round surfaces
        they stand for: True finds these from the facets' normals; a function takes
        undeformed points (3, n) to points of the true surface (3, n). Meshes of degree
        2 are curved already.
    frame
        Normal by which the law splits tractions into pressure and friction [theory
        (2.14)]: ``"automatic"``: that of a `rigid.Line` or `Plane`, else the slave's;
        ``"slave"``: the slave's; ``"master"``: that of the master, which has to be flat
        or smooth.
    adhesion
        `Cohesive` law by which the undeformed surfaces are bonded; None: they are not.

    Attributes
    ----------
    unknowns
        The user's unknowns, the displacement among them; see `unknowns.Unknowns`.
    names
        Facet tag by name.
    bond
        `Bond` of the points that adhere; None without adhesion.
    system, states, results, surfaces, assembly
        What is less often asked for: the coupled system, the arrays of its states,
        results, slave surfaces with their masters, the terms of matrices and vectors.

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike.

    Notes
    -----
    The solver's unknowns are u and multiplier / gamma (a length): both blocks of the
    residual are then forces, whatever the unit of stress.
    """

    # Gaps of a `Tie`, kept or closed; None: contact
    tied: str | None = None
    # Further terms of the equations of a problem that has it
    terms: Sequence[Term] = ()

    def __init__(
        self,
        u: Function | Sequence[Function],
        facet_tags: Any,
        pairs: str | Sequence[tuple[int | str, int | str | Any]],
        method: AugmentedLagrangian | Penalty | None = None,
        friction: Law | None = None,
        quadrature_degree: int | None = None,
        measure: str = "reference",
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        tangent: str = "full",
        offset: FieldValue | None = None,
        axisymmetric: bool = False,
        smooth: Smooth = False,
        frame: str = "automatic",
        adhesion: Adhesion | None = None,
    ) -> None:
        options = ContactOptions(
            AugmentedLagrangian() if method is None else method,
            friction,
            quadrature_degree,
            measure,
            Search() if search is None else search,
            tangent,
            offset,
            axisymmetric,
            smooth,
            frame,
        )
        if adhesion is not None:
            of_type("adhesion", adhesion, Adhesion, "a Cohesive")
        self.measure, self.tangent = measure, tangent
        given = checked(u, facet_tags, pairs, names, options, self.tied)
        self.names = given.pairs.names_at(0)
        self.friction = friction
        self.surfaces: ContactSurfaces = make_surfaces(given)
        self._present = PresentState(self.surfaces, self.surfaces.options)
        self.assembly = ContactAssembly(self.surfaces, self._present)
        system = CoupledSystem(self.surfaces.unknowns, [self.assembly])
        super().__init__(system, given.pairs)
        self.offsets = Offsets(self.surfaces)
        if options.method.gamma is not None:
            self.assembly.set_gamma(options.method.gamma)
        if offset is not None:
            self.offsets.set(offset)
        if friction is not None:
            mesh = self.surfaces.slave_u.function_space.mesh
            friction.spread(self.surfaces.zones, mesh)
        self.bond: Any = None
        if adhesion is not None:
            self.bond = adhesion.bond(self, u, facet_tags, pairs, names)
            self.terms = [self.bond]

    def __repr__(self) -> str:
        facets = sum(len(z.facets.slave_surface.facet_ids) for z in self.zones)
        law = "no friction" if self.friction is None else shown(self.friction)
        if self.tied is not None:
            law = f"gaps {'kept' if self.tied == 'keep' else 'closed'}"
        gamma = f"gamma {'not yet set' if self.gamma is None else shown(self.gamma)}"
        counts = "not yet paired"
        if self.system.updates:  # no rank waits for another: one alone may print this
            status = np.concatenate([zone.points()["status"] for zone in self.zones])
            hits, closed = (np.count_nonzero(status >= one) for one in (OPEN, CLOSED))
            counts = f"{hits} of {len(status)} points hit, {closed} closed"
        why = f" as {self.assembly.why}" if self.assembly.why else ""
        rank, size = self.layout.comm.rank, self.layout.comm.size
        return (
            f"<{type(self).__name__} of {', '.join(map(str, self.pairs))}; "
            f"{shown(self.method)}{why}, {law}, {gamma}; {facets} slave facets, {counts}"
            f"{f' on rank {rank} of {size}' if size > 1 else ''}>"
        )

    @property
    def method(self) -> AugmentedLagrangian | Penalty:
        """Method, with what it left open as it was chosen: ``repr`` says why."""
        return self.assembly.method

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """This contact alone; see `Interaction`."""
        return (self,)

    @property
    def multiplier(self) -> Function | None:
        """Traction on the slave: a scalar ``Function`` (normal component, negative in
        compression), a vector one in global coordinates, or None with penalty. Zero
        off the slave surfaces."""
        return self.surfaces.multiplier

    @property
    def gamma(self) -> float | Function | PairCoefficients | None:
        """Coefficient in use (None until an automatic one is set): as it was given; an
        automatic one is a number, or `PairCoefficients` where it differs between pairs
        of bodies."""
        return self.assembly.gamma

    def set_gamma(self, gamma: float | Function | PairCoefficients) -> None:
        """Set the augmentation or penalty coefficient. Collective.

        Parameters
        ----------
        gamma
            Positive number or scalar Function, traction per length, for all pairs; or a
            multiple of this contact's automatic `PairCoefficients`.

        Raises
        ------
        ContactError
            If it is not positive, differs between ranks or is of another mesh.
        """
        self.assembly.set_gamma(gamma)

    @property
    def offset(self) -> FieldValue | None:
        """Length that is added to the gap, as it was given; None: nothing."""
        return self.offsets.value

    def set_offset(self, offset: FieldValue) -> None:
        """Set the offset, such as an interference that grows. Collective.

        It takes effect with the next `update`, as displacements do; in `LoadSteps` set
        it in ``apply(t)``. Values are taken at the nodes of the slave facets, now.

        Parameters
        ----------
        offset
            As for `Contact`. Length. It must be finite, and alike on all ranks.
        """
        self.offsets.set(offset)
        self._present.note_change()

    def adjust(self, within: float) -> Any:
        """Make surfaces that are nearer than a length just touch, without stress.

        For surfaces that should touch, but whose meshes have small gaps or overlaps:
        these are added to the offset. Call it before the first step. Offsets of
        `set_offset` stay, whether they are set before or later. Collective.

        Parameters
        ----------
        within
            Gaps and overlaps up to this are closed; larger ones stay. Length.

        Returns
        -------
        How many slave facets have been adjusted, and by how much.

        Raises
        ------
        ContactError
            If it is not positive, or differs between ranks, or if the displacement is
            not zero.
        """
        assert hooks.adjust is not None, "the core alone takes meshes as they are"
        return hooks.adjust(self, within)

    @property
    def dt(self) -> float:
        """Time of the present step, 1 at first: slip over it is the slip rate that
        `Friction` sees. `LoadSteps` sets it to the step's size."""
        return self._present.dt

    @dt.setter
    def dt(self, value: float) -> None:
        self._present.dt = value

    def gap(self) -> Function:
        """Gap at the slave nodes, negative in penetration; NaN where no hit. Length.

        The gap of the law, with the offset. Average over the integration points around
        each node. Collective.
        """
        found: Function = self.results.gap()
        return found

    def traction(self, part: str = "total") -> Function:
        """Contact traction on the slave, global coordinates; 0 elsewhere. Collective.

        Per reference or current area, by `measure`.

        Parameters
        ----------
        part
            ``"total"``; ``"normal"``: along the normal of `frame`; ``"tangential"``: the
            rest, which is friction.
        """
        found: Function = self.results.traction(part)
        return found

    def pressure(self) -> Function:
        """Contact pressure on the slave, **positive in compression**; 0 elsewhere.

        The normal part of `traction`, of every method, per area as there. Where it is
        negative the law holds in the mean only: see `points`. Collective.
        """
        found: Function = self.results.pressure()
        return found

    def slip(self) -> Function:
        """Slip since the accepted step, T_n w, at the slave nodes. Length. Collective.

        The motion of the slave over the master point it meets now, in the slave's
        tangent plane and in global coordinates, also where the contact is open; 0 where
        no hit. After `advance` it stays that of the accepted step until the next
        `update`. Without friction it is computed when this is called.

        Raises
        ------
        ContactError
            For a `Tie`.
        """
        found: Function = self.results.slip()
        return found

    def status(self) -> Function:
        """`Status` of the slave nodes: 0 no hit, 1 open, 2 stick, 3 slip. Collective.

        The numbers of ``points()["status"]``. Contact without friction is slip. A law at
        points gives a node what most of the area around it does. Zero off the slave.
        """
        found: Function = self.results.status()
        return found

    def fields(self) -> list[Function]:
        """All nodal results of the last `update`, for XDMF or VTK files. Collective.

        Gap (0 where no hit: see coverage), normal and tangential traction, status,
        coverage, the multiplier if there is one, slip with friction: write them next to
        the displacement, ``io.write_xdmf(file, mesh, [u, *contact.fields()])``.
        """
        found: list[Function] = self.results.fields()
        return found

    def friction_work(self) -> float:
        """Work that friction takes in this step, before `advance`. Collective.

        The integral of tractions times the slip, with a penalty or elastic slip the slip
        beyond the cone: force times length, per thickness in 2D, or of a full turn. The
        tractions at the end of the step count; of dual multipliers those of the nodes
        times their mean slips, which is never negative. With a penalty or elastic slip it
        is 0 in stick: what is given back is ``stored_energy("tangential")``.
        """
        return float(self.results.friction_work())

    def stored_energy(self, part: str = "total") -> float:
        """Energy that penalty and elastic slip store at the last `update`. Collective.

        The integral of ``|t|^2 / (2 gamma)`` over the slave surfaces: force times
        length, per thickness in 2D, or of a full turn. 0 with a multiplier, and with
        ``Penalty(exact=True)``, which has no penetration. With ``Coulomb(elastic_slip=)``,
        for every method, the tangential part is half of the traction times that slip.

        Parameters
        ----------
        part
            ``"normal"``: in the penetration; ``"tangential"``: in the friction springs,
            0 with ``tangential="rate"``, which has none; ``"total"``: in both.
        """
        return float(self.results.stored_energy(part))


def one_or_several(given: Any) -> Interaction:
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
        of_type(f"contact[{i}]", contact, Contact, "a Contact")
    if len(given) == 1:
        return given[0]
    assert hooks.several is not None, "a problem of the core alone has one contact"
    return hooks.several(given)
