"""Contact between tagged surfaces: the object a user makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.fem import Function

from mpi4py import MPI
from petsc4py import PETSc

from . import _cpp, compat, surfaces
from .compat import Array, Indices
from .errors import ContactError, raise_everywhere, require_agreement, together
from .fields import ContactFields
from .friction import LAWS, Coulomb, Stick, Tresca
from .held import any_held, refuse_held
from .layout import Layout
from .memory import matrix_bytes, require_memory
from .methods import (
    MEASURES,
    TANGENTS,
    AugmentedLagrangian,
    Penalty,
    Search,
    check_coefficient,
)
from .stiffness import VolumePattern, contact_stiffness
from .zones import (
    ZoneData,
    ZoneFacets,
    create_zone,
    find_facets,
    group_pairs,
    numbered,
    on_facets,
)


@dataclass(frozen=True)
class ContactState:
    """What a step starts from: this rank's arrays of displacement and history."""

    u: Array
    u_old: Array
    multiplier: Array | None
    traction_old: list[Array | None]


class Contact(ContactFields):
    """Contact integrals between tagged surfaces of a deforming mesh. Collective.

    Parameters
    ----------
    u
        Displacement, a vector-valued Lagrange function of degree 1 or 2. Its present
        value is the old displacement until `advance` is called.
    facet_tags
        Tags of exterior facets (``MeshTags``).
    pairs
        ``[(slave tag, master tag), ...]``, a tag being its number or, with `names`,
        its name. Pairs with the same slave tag are one slave surface that meets all
        their masters.
    method
        `AugmentedLagrangian` or `Penalty`.
    friction
        `Coulomb`, `Tresca` or `Stick`; None: frictionless.
    quadrature_degree
        Of the rule on each segment. None: such that more points change no error, see
        `zones.default_quadrature_degree`.
    measure
        ``"reference"``: integrals over the undeformed slave surface, the multiplier is
        the nominal traction; ``"current"``: over the deformed one, Cauchy traction.
    search
        `Search` distances and strategy.
    tangent
        ``"fixed"``: the derivative at fixed integration points; ``"full"``: of the
        residual that is paired anew, through the segments that move with the bodies.
    names
        Facet tag by name: numbers, as in a scene's ``tags``, or (dimension, tag), as
        Gmsh's physical groups are read (``compat.read_gmsh(...).names``).

    Attributes
    ----------
    multiplier
        Traction on the slave: a scalar ``Function`` (normal component, negative in
        compression), a vector one in global coordinates, or None with penalty. Zero
        off the slave surfaces.
    gamma
        Coefficient in use (None until an automatic one is set).

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike.

    Notes
    -----
    The solver's unknowns are u and multiplier / gamma (a length): both blocks of the
    residual are then forces, whatever the unit of stress.
    """

    def __init__(
        self,
        u: Function,
        facet_tags: Any,
        pairs: Sequence[tuple[int | str, int | str]],
        method: AugmentedLagrangian | Penalty | None = None,
        friction: Coulomb | Tresca | Stick | None = None,
        quadrature_degree: int | None = None,
        measure: str = "reference",
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        tangent: str = "fixed",
    ) -> None:
        method = AugmentedLagrangian() if method is None else method
        search = Search() if search is None else search
        if not isinstance(u, Function):
            raise ContactError(f"u must be a Function, not {type(u).__name__}")
        self._comm: MPI.Comm = u.function_space.mesh.comm
        with together(self._comm):
            _check_options(
                method, friction, quadrature_degree, measure, search, tangent
            )
            groups = group_pairs(numbered(pairs, names, u))
        require_agreement(
            self._comm,
            method=method,
            friction=friction,
            quadrature_degree=quadrature_degree,
            measure=measure,
            search=search,
            tangent=tangent,
            pairs=groups,
        )
        surfaces.check_space(u)
        self.u, self.method, self.measure = u, method, measure
        self.tangent = tangent
        self.friction = friction
        facets = find_facets(u, facet_tags, groups)
        degree, components = self._multiplier_kind()
        mesh = u.function_space.mesh
        self.multiplier = None
        if components:
            W = compat.space(
                mesh, "Lagrange", degree, (components,) if components > 1 else ()
            )
            self.multiplier = Function(W, name="multiplier")
        self._scalar = compat.scalar_space(mesh, degree)
        self._vector = compat.vector_space(mesh, degree)
        self.layout = Layout(u, self.multiplier, self._slave_dofs(facets))
        self.zones: list[ZoneData] = [
            create_zone(
                zone,
                self.layout,
                self._law(),
                friction,
                self._scalar,
                quadrature_degree,
                measure == "current",
                tangent == "full",
                search,
            )
            for zone in facets
        ]
        self.gamma: float | Function | None = None
        self.gamma_scale = 1.0
        self._u_old = u.x.array.copy()
        self._fixed_by: tuple[Any, ...] = ()
        self._some_held = False
        # Read by `prepare`, which every use of it follows
        self._volume: Any = None
        if method.gamma is not None:
            self.set_gamma(method.gamma)
        self._history_is_new = True
        self._preallocations = 0

    # Set-up

    def _multiplier_kind(self) -> tuple[int, int]:
        """Degree and components of the multiplier (components 0: none)."""
        p = compat.element_info(self.u.function_space).degree
        dim = self.u.function_space.mesh.geometry.dim
        default = p if dim == 2 else 1
        if isinstance(self.method, Penalty):
            return default, 0
        degree = default if self.method.degree is None else self.method.degree
        if degree > default:
            raise ContactError(
                f"multiplier degree {degree} is not stable: at most {default} with a "
                f"displacement of degree {p} in {dim}D"
            )
        return degree, 1 if self._multiplier() == "normal" else dim

    def _multiplier(self) -> str:
        """Scalar or vector, by choice or by what friction needs."""
        method = self.method
        if isinstance(method, AugmentedLagrangian) and method.multiplier is not None:
            return method.multiplier
        return "normal" if self.friction is None else "vector"

    def _law(self) -> _cpp.LawKind:
        penalty = isinstance(self.method, Penalty)
        if self.friction is not None:
            name = "penalty_friction" if penalty else "augmented_friction"
        else:
            name = "penalty" if penalty else f"augmented_{self._multiplier()}"
        return getattr(_cpp.LawKind, name)

    @property
    def _has_springs(self) -> bool:
        """Whether friction springs carry a traction from step to step."""
        return (
            self.friction is not None
            and isinstance(self.method, Penalty)
            and self.method.tangential == "elastic"
        )

    def _slave_dofs(self, facets: Sequence[ZoneFacets]) -> Indices:
        """Block dofs of the multiplier on this rank's slave facets."""
        if self.multiplier is None:
            return np.empty(0, dtype=np.int32)
        W = self.multiplier.function_space
        tables = [surfaces.facet_dof_table(W, zone.slave) for zone in facets]
        return np.unique(np.concatenate([table.ravel() for table in tables]))

    def set_gamma(self, gamma: float | Function) -> None:
        """Set the augmentation or penalty coefficient. Collective.

        Parameters
        ----------
        gamma
            Positive number or scalar Function, traction per length.

        Raises
        ------
        ContactError
            If it is not positive, differs between ranks or is of another mesh.
        """
        with together(self._comm):
            check_coefficient(gamma)
            if isinstance(gamma, Function):
                _check_coefficient_function(gamma, self.u)
        require_agreement(self._comm, gamma=gamma)
        values = [
            on_facets(gamma, zone.facets)
            if isinstance(gamma, Function)
            else np.full(zone.facets.slave_surface.facet_dofs.shape, float(gamma))
            for zone in self.zones
        ]
        # One scale for all zones: a multiplier node may belong to two of them
        total = self._comm.allreduce(sum(float(v.sum()) for v in values))
        self.gamma_scale = total / self._comm.allreduce(sum(v.size for v in values))
        for zone, value in zip(self.zones, values):
            zone.cpp.set_gamma(value, self.gamma_scale)
        self.gamma = gamma

    # State

    def _on_surface(self, array: Array, surface: surfaces.Surface) -> Array:
        """Values of a ghosted array of u at the surface's dofs, (dofs, gdim)."""
        return array.reshape(-1, surface.gdim)[surface.dofs]

    def _for_zones(self, send: str, array: Array) -> None:
        """Give every zone the values of an array of u on both its sides."""
        for zone in self.zones:
            getattr(zone.cpp, send)(
                self._on_surface(array, zone.facets.slave_surface),
                self._on_surface(array, zone.facets.master_surface),
            )

    def _not_finite(self) -> str | None:
        """What is no number in this rank's share of the state, if anything."""
        for name, f in (("displacement", self.u), ("multiplier", self.multiplier)):
            bad = 0 if f is None else np.count_nonzero(~np.isfinite(f.x.array))
            if bad:
                return f"the {name} has {bad} entries that are not finite"
        return None

    def _send_state(self) -> None:
        """Displacement and multiplier to the zones. Collective."""
        raise_everywhere(self._comm, self._not_finite())
        self._for_zones("set_displacement", self.u.x.array)
        if self.multiplier is not None:
            values = self.multiplier.x.array.reshape(-1, self.layout.components)
            for zone in self.zones:
                zone.cpp.set_multiplier(values[zone.multiplier_nodes])

    def update(self, rays_only: bool = False) -> None:
        """Pair and integrate at the present displacement. Collective.

        Parameters
        ----------
        rays_only
            Keep the integration points on the slave and cast their rays anew: what
            the tangent at fixed points differentiates.

        Raises
        ------
        ContactError
            If the displacement is not finite.
        """
        self._send_history()
        self._send_state()
        for zone in self.zones:
            with together(self._comm):
                if rays_only:
                    zone.cpp.cast()
                else:
                    zone.cpp.pair()

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The old displacement is the only history; the elastic penalty also keeps the
        tangential traction of the last `update` on each slave facet. Results stay those
        of the accepted step until the next `update`.
        """
        if self._has_springs:
            for zone in self.zones:
                zone.traction_old = zone.cpp.tangential_traction()
        self._u_old[:] = self.u.x.array
        self._history_is_new = True

    def state(self) -> ContactState:
        """Copy of displacement, multiplier and history, for `restore`."""
        lam = None if self.multiplier is None else self.multiplier.x.array.copy()
        return ContactState(
            self.u.x.array.copy(),
            self._u_old.copy(),
            lam,
            [z.traction_old for z in self.zones],
        )

    def restore(self, state: ContactState) -> None:
        """Go back to a state of this object. Collective."""
        with together(self._comm):
            self.u.x.array[:] = state.u
            self._u_old[:] = state.u_old
            if self.multiplier is not None:
                self.multiplier.x.array[:] = state.multiplier
        for zone, traction in zip(self.zones, state.traction_old):
            zone.traction_old = traction
        self._history_is_new = True

    def _send_history(self) -> None:
        """Old displacement and tractions to the zones, where they have changed."""
        if not self._history_is_new:
            return
        self._for_zones("set_old_displacement", self._u_old)
        for zone in self.zones:
            traction = zone.traction_old
            zone.cpp.set_old_traction(np.empty(0) if traction is None else traction)
        self._history_is_new = False

    def _fix(self, bcs: Sequence[Any]) -> None:
        """Tell the zones which displacements are prescribed. Collective."""
        if tuple(map(id, bcs)) == tuple(map(id, self._fixed_by)):
            return
        marker, _ = compat.dirichlet_dofs(bcs, self.u.function_space)
        self._for_zones("set_fixed", marker.astype(np.float64))
        self._fixed_by = tuple(bcs)
        self._some_held = self.multiplier is not None and any_held(self, marker)

    # Assembly

    def prepare(self, a: Any, bcs: Sequence[Any] = ()) -> None:
        """Read what is needed from the volume's bilinear form. Collective.

        Its sparsity pattern, and the automatic gamma from its diagonal.

        Parameters
        ----------
        a
            Compiled bilinear form of everything but contact.
        bcs
            Dirichlet conditions: a body that they hold throughout is taken as rigid.
        """
        volume = self._volume = VolumePattern(a, self.layout)
        if self.gamma is None:
            stiffness = contact_stiffness(volume, self.layout, self.zones, bcs)
            self.set_gamma(self.method.automatic_factor * stiffness)

    def create_matrix(self, a: Any) -> PETSc.Mat:
        """Matrix over [u, multiplier] with room for volume and contact. Collective.

        Parameters
        ----------
        a
            Compiled bilinear form of everything but contact.
        """
        if self._volume is None or self._volume.form is not a:
            self.prepare(a)
        A = self.layout.create_matrix()
        self.update()
        self._make_room(A)
        return A

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Zero vector over [u, multiplier]; the form L is not needed."""
        return self.layout.create_vector()

    def _make_room(self, A: PETSc.Mat) -> None:
        self._preallocations += 1
        for zone in self.zones:
            zone.pattern.extend(zone.cpp)
            zone.positions.forget()
        require_memory(
            self._comm, matrix_bytes(self._volume, self.zones, self.layout.components)
        )
        _cpp.preallocate(
            A.handle,
            self._volume.offsets,
            self._volume.columns,
            [zone.cpp for zone in self.zones],
            [zone.pattern for zone in self.zones],
        )

    def make_room(self, A: PETSc.Mat) -> bool:
        """Preallocate A anew if pairs have appeared that it cannot hold. Collective.

        A loses its values then, and a KSP that has factorised it must be ``reset()``:
        PETSc 3.22 (3.18 not yet) does not notice the new pattern of a parallel matrix and
        would write the new values into the old pattern's memory.

        Returns
        -------
        Whether it did.
        """
        short = any(not zone.pattern.covers(zone.cpp) for zone in self.zones)
        if not self._comm.allreduce(short, op=MPI.LOR):
            return False
        self._make_room(A)
        return True

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`; assembly of A is the caller's.

        Constrained rows and columns are left out. Collective.
        """
        self._fix(bcs)
        if self._some_held:
            refuse_held(self)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_tangent(zone.cpp, A.handle, zone.positions)

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """Add the residual at the last `update`; assembly of b is the caller's.

        Constrained rows are left out. Collective.
        """
        self._fix(bcs)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_residual(zone.cpp, b.handle)

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        """b <- b - alpha A_c (g - x0) over constrained columns. Collective.

        Parameters
        ----------
        b
            Vector over [u, multiplier]; its assembly is the caller's.
        bcs
            Dirichlet conditions.
        x0
            Ghosted array of u.
        alpha
            Factor; -1 for the residual of Newton's method.
        """
        self._fix(bcs)
        marker, g = compat.dirichlet_dofs(bcs, self.u.function_space)
        increment = np.where(marker == 1, g - x0, 0.0)
        if not self._comm.allreduce(bool(np.any(increment)), op=MPI.LOR):
            return
        for zone in self.zones:
            sides = zone.facets.slave_surface, zone.facets.master_surface
            slave, master = (self._on_surface(increment, side) for side in sides)
            with together(self._comm):
                _cpp.apply_lifting(zone.cpp, b.handle, slave, master, alpha)

    @property
    def stiffness_diagonal(self) -> Array:
        """Diagonal of the volume's matrix at set-up, owned dofs of u, unrolled."""
        return self._volume.diagonal


def _check_coefficient_function(gamma: Function, u: Function) -> None:
    """Raise unless gamma is a scalar on the displacement's mesh."""
    components = compat.element_info(gamma.function_space).value_shape
    if components:
        raise ContactError(
            f"gamma must be a scalar Function, not one with values of shape {components}"
        )
    if not compat.on_mesh(gamma, u.function_space.mesh):
        raise ContactError("gamma is a Function on another mesh than the displacement")


def _check_options(
    method: Any,
    friction: Any,
    quadrature_degree: Any,
    measure: Any,
    search: Any,
    tangent: Any,
) -> None:
    """Raise for options that do not exist."""
    if not isinstance(method, (AugmentedLagrangian, Penalty)):
        raise ContactError(
            f"method must be AugmentedLagrangian or Penalty, not {method!r}"
        )
    if friction is not None and not isinstance(friction, LAWS):
        raise ContactError(
            f"friction must be Coulomb, Tresca, Stick or None, not {friction!r}"
        )
    if friction is not None and getattr(method, "multiplier", None) == "normal":
        raise ContactError("friction needs multiplier='vector', not 'normal'")
    if measure not in MEASURES:
        raise ContactError(f"measure must be one of {MEASURES}, not {measure!r}")
    if tangent not in TANGENTS:
        raise ContactError(f"tangent must be one of {TANGENTS}, not {tangent!r}")
    if not isinstance(search, Search):
        raise ContactError(f"search must be a Search, not {search!r}")
    degree = quadrature_degree
    if degree is not None and not (
        isinstance(degree, (int, np.integer)) and 1 <= degree <= 30
    ):
        raise ContactError(
            f"quadrature_degree = {degree!r} is not a whole number from 1 to 30"
        )
