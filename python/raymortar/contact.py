"""Contact between tagged surfaces: the object a user makes."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .checked import is_real_number
from .compat import Array
from .errors import (
    ContactError,
    SetUpError,
    raise_everywhere,
    require_agreement,
    together,
)
from .host.checks import check_space
from .host.host import Host
from .host.kept_communicator import keep_communicator
from .host.slave_fields import OFFSET, FieldValue, check_field, on_facets
from .interface.accepted import AcceptedStep
from .interface.adjustment import Adjustment, adjust, require_start
from .interface.coefficients import PairCoefficients, spread
from .interface.contact_surfaces import make_surfaces
from .interface.cover import Cover
from .interface.friction_at_points import evaluate_friction, spread_coefficient
from .interface.interfaces import Interfaces
from .interface.interference import Behind, warn_of_excess
from .interface.pairs import known_names, numbered, table
from .interface.state import ContactState, not_finite, state_fault
from .interface.straight_facets import warn_of_straight_facets
from .interface.zones import described, group_pairs, on_sides
from .options.contact_options import ContactOptions
from .options.friction import Law
from .options.methods import AugmentedLagrangian, Penalty, Search
from .results.summaries import of_contact
from .rigid.body import Body
from .rigid.shapes import Shape
from .system.assembly import ContactAssembly

_numbers = itertools.count()


class Contact(ContactAssembly):
    """Contact integrals between tagged surfaces of a deforming mesh. Collective.

    Parameters
    ----------
    u
        Displacement: a vector-valued Lagrange function of degree 1 or 2, or a part of a
        mixed Function that is one, such as ``w.sub(0)``. If bodies have meshes of their
        own, a list. Its value now is the old displacement until `advance` is called.
    facet_tags
        Tags of exterior facets (``MeshTags``), for each mesh.
    pairs
        ``[(slave, master), ...]``: tags of facets by number or, with `names`, by name.
        Pairs with the same slave are one slave surface that meets all their masters. A
        master may be a shape of `rigid`, or a `rigid.Body` that moves one.
    method
        `AugmentedLagrangian` or `Penalty`.
    friction
        `Coulomb`, `Tresca`, `Stick` or `Friction`; None: frictionless.
    quadrature_degree
        Degree of the rule on each segment. None: the lowest from which more points
        reduce no error, see `quadrature.default_degree`.
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

    Attributes
    ----------
    u
        Displacement on a space of its own: of a part of a mixed Function a copy, which
        follows it.
    slave_u
        That of the mesh on which the slave surfaces are.
    host
        What is solved for, the displacement among it; see `host.Host`.
    bodies
        Parts of the mesh that hang together, by displacement node.
    multiplier
        Traction on the slave: a scalar ``Function`` (normal component, negative in
        compression), a vector one in global coordinates, or None with penalty. Zero
        off the slave surfaces.
    gamma
        Coefficient in use (None until an automatic one is set): as it was given; an
        automatic one is a number, or `PairCoefficients` where it differs between pairs
        of bodies.
    offset
        Added to the gap, as it was given; None: nothing.
    axisymmetric
        Whether integrals go over a full turn.
    pairs
        The pairs in the order in which they were given, each once: a list of
        `pairs.Pair`, with tags, names and the label of their columns in a `History`.
        ``points()["pair"]`` and `resultants` count by it.
    names
        Facet tag by name.
    updates
        Calls of `update` so far.
    revision
        Changes so far of what an assembled residual depends on, `u` and `multiplier`
        aside: pairing, history, coefficient.

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike.

    Notes
    -----
    The solver's unknowns are u and multiplier / gamma (a length): both blocks of the
    residual are then forces, whatever the unit of stress.
    """

    # What becomes of the gaps of a `Tie`; None: contact
    tied: str | None = None

    def __init__(
        self,
        u: Function | Sequence[Function],
        facet_tags: Any,
        pairs: Sequence[tuple[int | str, int | str | Shape | Body]],
        method: AugmentedLagrangian | Penalty | None = None,
        friction: Law | None = None,
        quadrature_degree: int | None = None,
        measure: str = "reference",
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        tangent: str = "full",
        offset: FieldValue | None = None,
        axisymmetric: bool = False,
    ) -> None:
        self._options = options = ContactOptions(
            AugmentedLagrangian() if method is None else method,
            friction,
            quadrature_degree,
            measure,
            Search() if search is None else search,
            tangent,
            offset,
            axisymmetric,
        )
        first = u[0] if isinstance(u, (list, tuple)) and u else u
        if not isinstance(first, Function):
            raise ContactError(f"u must be a Function, not {type(first).__name__}")
        self._comm: MPI.Comm = first.function_space.mesh.comm
        self.number = next(_numbers)
        self.partners = (self.number,)
        with together(self._comm):
            self.host = Host(u)
        keep_communicator(first.function_space.mesh)
        u = self.host.u
        with together(self._comm):
            options.check()
            facet_dim = u.function_space.mesh.topology.dim - 1
            self.names = known_names(names, facet_dim)
            tags = numbered(pairs, self.names)
            groups = group_pairs(tags)
            self.pairs = table(tags, self.names)
        require_agreement(
            self._comm,
            **vars(options),
            pairs={slave: described(masters) for slave, masters in groups.items()},
            names=self.pairs,
        )
        for part in self.host.displacements:
            check_space(part.u)
        self.u, self.method, self.measure = u, options.method, measure
        self.tangent, self.axisymmetric = tangent, bool(axisymmetric)
        self.friction = friction
        made = make_surfaces(self.host, facet_tags, groups, options, self.tied)
        self.zones, self.layout, self.bodies = made.zones, made.layout, made.bodies
        self.slave_u, self.multiplier = made.slave_u, made.multiplier
        self._scalar, self._vector = made.scalar, made.vector
        self._references = made.references
        if self.multiplier is not None:
            self._cover = Cover(self.zones, self.multiplier.function_space)
        self.gamma: float | Function | PairCoefficients | None = None
        self.gamma_scale = 1.0
        self.revision = 0
        self.offset: FieldValue | None = None
        # What lies behind the zones' sides, and whether an interference is more
        self.behind: list[Behind] | None = None
        self.excess: str | None = None
        self._dt = 1.0
        self._interfaces: Interfaces | None = None
        self._accepted = AcceptedStep(u, self.zones, self.layout.bodies)
        self._fixed_by: tuple[Any, ...] | None = ()
        self._fixed = np.zeros(len(u.x.array), dtype=np.int8)
        self._some_held = False
        # Read by `prepare`, which every use of it follows
        self._volume: Any = None
        if self.method.gamma is not None:
            self.set_gamma(self.method.gamma)
        if offset is not None:
            self.set_offset(offset)
        spread_coefficient(friction, self.zones, self.slave_u.function_space.mesh)
        self.updates = 0
        self.preallocations, self.extensions = 0, 0

    def __repr__(self) -> str:
        return of_contact(self)

    # Set-up

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
        nodal, self.gamma_scale = spread(gamma, self)
        for zone, values in zip(self.zones, nodal):
            zone.cpp.set_gamma(values.of_facets, self.gamma_scale, values.of_pairs())
        self.gamma = gamma
        self.revision += 1

    def set_offset(self, offset: FieldValue) -> None:
        """Set what is added to the gap, as an interference that grows. Collective.

        It takes effect with the next `update`, as displacements do; in `LoadSteps` set
        it in ``apply(t)``. Values are taken at the nodes of the slave facets, now.

        Parameters
        ----------
        offset
            As that of `Contact`. Length.

        Raises
        ------
        ContactError
            If it is not finite, no scalar, of another mesh, or differs between ranks.
        """
        with together(self._comm):
            check_field(OFFSET, offset, self.slave_u.function_space.mesh)
        require_agreement(self._comm, offset=offset)
        nodal = [on_facets(OFFSET, offset, z.facets, self._comm) for z in self.zones]
        for zone, values in zip(self.zones, nodal):
            zone.offset = values
        self.offset = offset
        self.excess = warn_of_excess(self)
        self._send_offset()

    def adjust(self, within: float) -> Adjustment:
        """Make surfaces that are nearer than this just touch, without stress.

        For surfaces that should touch and do not, by the noise of their meshes: what
        is missing or too much of each gap is added to the offset. Call it before the
        first step. What `set_offset` sets counts as wanted and stays, whether it is
        set before or later. Collective.

        Parameters
        ----------
        within
            Gaps and overlaps up to this are closed; larger ones stay. Length.

        Returns
        -------
        Adjustment
            How many slave facets have been adjusted, and by how much.

        Raises
        ------
        ContactError
            If it is not positive, or differs between ranks, or if the displacement is
            not zero.
        """
        with together(self._comm):
            require_start(self.u.x.array, within)
        require_agreement(self._comm, within=within)
        self.update()
        found = adjust(self.zones, float(within), self._comm)
        self._send_offset()
        return found

    def _send_offset(self) -> None:
        """Hand offsets and adjustments to the zones."""
        for zone in self.zones:
            if (offset := zone.whole_offset) is not None:
                zone.cpp.set_offset(offset)
        self.revision += 1

    @property
    def dt(self) -> float:
        """Time of the present step, 1 at first: slip over it is the slip rate that
        `Friction` sees. `LoadSteps` sets it to the step's size."""
        return self._dt

    @dt.setter
    def dt(self, value: float) -> None:
        if not (is_real_number(value) and np.isfinite(value) and value > 0.0):
            raise ContactError(f"dt = {value!r} must be a positive number")
        self._dt = float(value)
        for body in self.layout.bodies:
            body.freedom.dt = self._dt
        self.revision += 1

    # State

    def _send_state(self) -> None:
        """Displacement and multiplier to the zones. Collective."""
        for reference in self._references:
            raise_everywhere(self._comm, reference.fault(), SetUpError)
        raise_everywhere(self._comm, not_finite(self))
        for zone in self.zones:
            zone.cpp.set_displacement(*on_sides(zone, self.u.x.array))
            zone.motions.send(
                zone.cpp,
                self._comm,
                self.friction is not None,
                self.layout.body_rows,
            )
        if self.multiplier is not None:
            values = self.multiplier.x.array.reshape(-1, self.layout.components)
            for zone in self.zones:
                zone.cpp.set_multiplier(values[zone.multiplier_nodes])

    def update(self, rays_only: bool = False) -> None:
        """Pair and integrate at the present displacement. Collective.

        Parameters
        ----------
        rays_only
            Keep the integration points on the slave and cast their rays anew. The
            tangent is then that at fixed points, whatever `tangent` says.

        Raises
        ------
        ContactError
            If the displacement is not finite, or if the mesh has been moved on the
            contact surfaces since `Contact` was made.
        """
        self.updates += 1
        self.revision += 1
        self.host.pull()
        if self._options.has_springs:
            self._shown = self._unknowns()
        self._accepted.send()
        self._send_state()
        for zone in self.zones:
            with together(self._comm):
                if rays_only:
                    zone.cpp.cast()
                else:
                    zone.cpp.pair()
        evaluate_friction(self.friction, self.zones, self._dt, self._comm)
        if self.multiplier is not None:
            self._cover.share()
        # The bodies of other ranks may have moved
        if self._comm.allreduce(self._accepted.is_here, op=MPI.MIN):
            self._accepted.note_faced()
            if self.updates == 1:
                warn_of_straight_facets(self)

    def forget_flight(self, body: Body) -> None:
        """Take the present pose of a body as the old one: a flight is no slip."""
        self._accepted.forget_flight(body)
        self.revision += 1

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The history is the old displacement, and with friction what its springs hold on
        each slave facet (none with ``tangential="rate"``), for which results are brought
        up to date if the state is another than at the last `update`. They stay those of
        the accepted step until the next one.
        """
        if self._options.has_springs and self.updates:
            if self._is_stale():
                self.update()
            self._accepted.keep_springs()
        self._accepted.accept()
        if self.updates:
            self._accepted.note_faced()
        self.revision += 1

    def _unknowns(self) -> Array:
        """Displacement and multiplier of this rank, as one array."""
        lam = [] if self.multiplier is None else [self.multiplier.x.array]
        return np.concatenate([self.u.x.array, *lam])

    def _is_stale(self) -> bool:
        """Whether the last `update` was of another state. Collective."""
        self.host.pull()
        same = np.array_equal(self._shown, self._unknowns())
        return not self._comm.allreduce(same, op=MPI.LAND)

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self._accepted.u

    def state(self) -> ContactState:
        """Copy of all unknowns, multiplier and history, for `restore`."""
        self.host.pull()
        return self._accepted.state(self.host, self.multiplier)

    def fault_of(self, state: Any) -> str | None:
        """Why `restore` cannot go back to a state, if so."""
        zones = self.zones if self._options.has_springs else []
        return state_fault(state, self.state(), zones)

    def restore(self, state: ContactState) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        Where there were results before, those are of this state now.

        Raises
        ------
        ContactError
            If it is of another mesh, partition or method.
        """
        raise_everywhere(self._comm, self.fault_of(state))
        self._accepted.restore(state, self.host, self.multiplier)
        self.revision += 1
        if self.updates:
            self.update()
