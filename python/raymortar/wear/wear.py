"""Wear: contact that loses material where it slips under pressure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..core import compat
from ..core.compat import Array
from ..core.contact import Contact
from ..core.discretization.facets import facet_dof_table, shape_functions
from ..core.discretization.ranks import largest as largest_of
from ..core.discretization.ranks import sums_at
from ..core.discretization.surfaces import surface_normals
from ..core.errors import (
    ContactError,
    ConvergenceError,
    SetUpError,
    described,
    of_type,
    positive,
    require_agreement,
    together,
    truth,
    warn,
)
from ..core.interface.present import Follower
from ..core.interface.zone_data import ZoneData
from ..core.state import Quantity, of_function
from ..results.tractions import seen_points
from ..user_laws.arguments import check_functions, real_values
from .anderson import Anderson
from .archard import Archard

# Difference of depths that counts as none, over the deepest of the step
AGREEMENT = 1e-6
# Changes above this tell that no solver has repeated the solves of an accepted step
SETTLED = 0.01
# Most solves of an implicit step after the first, below those of a solver
MOST_REPEATS = 18
# Share of the deepest from which on nodes count as worn
BARELY = 1e-2
# Share of the largest pressure at which open points tell how they would wear
NEARLY_OPEN = 1e-3
# Depth over pressure times stiffness, of explicit steps [theory (7.9)]
LIMIT = 1.0


class Wear(Follower):
    """Depth of material that contact has lost, which widens its gaps. Collective.

    It grows by what each accepted step has done, and is the contact's offset:
    ``LoadSteps(..., on_accept=wear.accept)``. The depth belongs to the slave's material,
    so of two bodies that wear it is the sum.

    Parameters
    ----------
    contact
        A contact without an offset, with friction or without.
    law
        `Archard`, or a function of pressures p >= 0 and slip rates v >= 0, (n,) each, to
        depths per time >= 0, (n,).
    largest
        A step that wears deeper than this is warned of, once: the next steps should be
        smaller. Length. None: any depth.
    implicit
        False: gaps are measured from the surface at the start of a step. True: from the
        surface as worn at its end, which is stable at any size of the step; each solve
        is repeated, 5 to 15 times, until pressures and wear agree.

    Attributes
    ----------
    depth
        Depth so far, positive: a Function of degree 1 on the slave's mesh, 0 off the
        slave surfaces. To start from a worn surface set its values. It is a part of the
        contact's state, which a `Checkpoint` keeps.
    step
        Largest depth of the last accepted step. Length.

    Notes
    -----
    Pressures are taken at the end of the step [theory (7.8)]. Explicit
    steps that are too large for the bodies' stiffness make pressures alternate, which
    is warned of once (7.9). The depth is spread to the nodes such that its integral
    over the undeformed surface equals the law's, to rounding.

    Examples
    --------
    >>> wear = raymortar.fluxes.Wear(contact, raymortar.fluxes.Archard(1e-6))
    >>> steps = raymortar.LoadSteps(solver, slide, steps=100, on_accept=wear.accept)
    >>> history.include({"worn": wear.volume})
    """

    def __init__(
        self,
        contact: Contact,
        law: Archard | Callable[[Array, Array], Array],
        largest: float | None = None,
        implicit: bool = False,
    ) -> None:
        of_type("Wear.contact", contact, Contact, "a Contact")
        self._comm = contact.layout.comm
        with together(self._comm):
            if contact.tied is not None:
                raise ContactError("Wear.contact is a Tie, which does not slip")
            if contact.offset is not None:
                raise ContactError(
                    "Wear.contact has an offset, which wear would replace: set "
                    "wear.depth instead"
                )
            of = contact.assembly.present.followers
            if any(isinstance(one, Wear) for one in of):
                raise ContactError(
                    "the offset of Wear.contact is set by something else already, a Wear: "
                    "one has it for itself. Give it a law that is the sum of both"
                )
            if not callable(law):
                raise ContactError(
                    "Wear.law must be Archard or a function of p and v, not "
                    f"{described(law)}"
                )
            check_functions("Wear", {"law": law}, ("p", "v"), ())
            if largest is not None:
                positive("Wear.largest", largest)
            self.implicit = truth("Wear.implicit", implicit)
        require_agreement(self._comm, largest=largest, implicit=implicit)
        self.contact, self.law, self.largest, self.step = contact, law, largest, 0.0
        mesh = contact.surfaces.slave_u.function_space.mesh
        self.depth = Function(compat.scalar_space(mesh, 1), name="wear")
        V = self.depth.function_space
        self._tables = [facet_dof_table(V, z.facets.slave) for z in contact.zones]
        shares = [
            (table, _nodal_areas(zone)[..., None])
            for table, zone in zip(self._tables, contact.zones)
        ]
        self._areas = sums_at(V.dofmap.index_map, 1, *shares)[:, 0]
        # Depth of the present implicit step, and what accelerates its fixed point
        self.array = np.zeros(len(self._areas))
        self._owned: int = V.dofmap.index_map.size_local
        self._anderson = Anderson(self._comm, self._areas[: self._owned])
        # The last implicit step's depth, and the sum of its first estimate; 0: none
        self._last, self._then, self._wears = self.array, 0.0, 0.0
        self._accepted: int | None = None
        # The offset that it has given the contact, and the depth that this has
        self._offset: Function | None = None
        self._sent = self.array.copy()
        self._may_warn, self._may_be_told = not self.implicit, True
        present = contact.assembly.present
        present.follow(self)
        if self.implicit:
            present.corrections.append(self)

    def __repr__(self) -> str:
        return f"<Wear of {self.contact!r} by {self.law!r}>"

    def accept(self) -> None:
        """Add what the last step has worn, and widen the gaps by it. Collective.

        Call it once for each step, after `Contact.advance` and before the next
        `update`, as ``LoadSteps(on_accept=wear.accept)`` does.

        Raises
        ------
        ContactError
            If the law returns no depths, or if no step was accepted before, or since the
            last call.
        """
        steps = self.contact.assembly.present.steps
        if steps == 0:
            raise ContactError(
                "Wear.accept was called before a step was accepted: call it after solve() "
                "and contact.advance(), as LoadSteps(on_accept=wear.accept) does"
            )
        if self._accepted == steps:
            raise ContactError(
                "Wear.accept was called for this step already: call it once, after "
                "contact.advance()"
            )
        change, stiffness = self._depths()
        if self.implicit:
            self._require_settled(change)
            change = self.array
            self._last, self._then = change, self._wears
        self._accepted = steps
        self.step = largest_of(self._comm, change)
        self.depth.x.array[:] += change
        self.array = np.zeros(len(change))
        self.bring()
        if self._may_warn:
            self._warn_if_coarse(stiffness)
        if self.largest is not None and self.step > self.largest:
            warn(
                f"a step has worn {self.step:.3g} deep, more than largest = "
                f"{self.largest:.3g}: take smaller steps",
                page="fields",
            )
            self.largest = None

    def path_ended(self) -> str | None:
        """Tell once, at the end of a path, that no step was ever accepted."""
        if self._accepted is not None or not self._may_be_told:
            return None
        self._may_be_told = False
        return (
            f"the Wear by {self.law!r} has accepted no step of this path, so nothing has "
            "worn: LoadSteps(..., on_accept=wear.accept)"
        )

    # Implicit steps

    def _require_settled(self, found: Array) -> None:
        """Raise where no solver has repeated its solves until the depth of the step is
        that which its pressures wear. Collective."""
        deepest = max(largest_of(self._comm, one) for one in (found, self.array))
        if largest_of(self._comm, np.abs(found - self.array)) > SETTLED * deepest:
            raise ContactError(
                "implicit wear repeats a solve until depths and pressures agree, which "
                "solvers of raymortar alone do: take one of these, or Wear(..., "
                "implicit=False)"
            )

    def renew(self) -> float | None:
        """Improve the depth of an implicit step, which the pressures at its end wear.
        Collective.

        Returns
        -------
        Largest change of the depth, over the largest depth of the step; None if both
        agree.

        Raises
        ------
        ConvergenceError
            If they still differ after many solves.
        """
        found, slopes = self._depths()
        lacking = found - self.array
        deepest = max(largest_of(self._comm, one) for one in (found, self.array))
        change = largest_of(self._comm, np.abs(lacking))
        if change <= AGREEMENT * deepest:
            self._anderson.start()
            return None
        if self._anderson.count > MOST_REPEATS:
            self._anderson.start()
            raise ConvergenceError(
                f"implicit wear has not settled after {MOST_REPEATS} solves: depths of "
                f"the step change by {change / deepest:.1e} of the deepest"
            )
        nearer = lacking / (1.0 + slopes * self.contact.assembly.gamma_scale)
        wears = self._comm.allreduce(found[: self._owned].sum())
        if (
            self._anderson.count == 0
            and largest_of(self._comm, self.array) == 0.0
            and self._then > 0.0
        ):  # as deep as the last step, for as much pressure
            nearer = self._last * (wears / self._then)
        if self._anderson.count == 0:
            self._wears = wears
        values = self._anderson.next(self.array, nearer, found > BARELY * deepest)
        self.array = np.maximum(values, 0.0)
        return change / deepest

    # State

    def quantities(self) -> Iterator[Quantity]:
        """Yield the depth so far, what an implicit step adds, and what the last one
        has added, from which the next one starts."""
        V = self.depth.function_space
        yield of_function("worn depth", self.depth)
        if self.implicit:
            names = {"array": "depth of the step", "_last": "depth of the last step"}
            for one, name in names.items():
                yield Quantity(
                    name, partial(getattr, self, one), partial(setattr, self, one), V
                )
            yield Quantity(
                "wear of the last step", lambda: np.array(self._then), self._set_then
            )

    def _set_then(self, value: Array) -> None:
        self._then = float(value)

    def bring(self) -> None:
        """Set the contact's offset, which is nobody else's, where the depth is another
        one than it has. Collective."""
        whole = self.depth.x.array + self.array
        is_new = not np.array_equal(whole, self._sent)
        if not self._comm.allreduce(is_new, op=MPI.LOR):
            return
        with together(self._comm):
            present = self.contact.offset
            if present is not self._offset and present is not self.depth:
                raise SetUpError(
                    "the offset of Wear.contact was set by something else: one Wear has "
                    "it for itself; set wear.depth instead"
                )
        depth = self.depth
        if self._comm.allreduce(bool(self.array.any()), op=MPI.LOR):
            depth = Function(self.depth.function_space)
            depth.x.array[:] = whole
        self._offset, self._sent = depth, whole
        self.contact.set_offset(depth)

    # Depth of a step

    def _depths(self) -> tuple[Array, Array]:
        """Depth that the last solve wears, and the same over the pressure, at this
        rank's nodes. Collective."""
        shares = []
        with together(self._comm):
            for zone, table in zip(self.contact.zones, self._tables):
                facet, xi, worn = self._worn(zone)
                N, _ = shape_functions(zone.facets.slave_surface.shape, 1, xi)
                shares.append((table[facet], N[..., None] * worn[:, None]))
        V = self.depth.function_space
        sums = sums_at(V.dofmap.index_map, 2, *shares).T
        has = self._areas > 0.0
        depth, slope = np.where(has, sums, 0.0) / np.where(has, self._areas, 1.0)
        return depth, slope

    def _warn_if_coarse(self, slopes: Array) -> None:
        """Say once where an explicit step is beyond its limit [theory (7.9)].
        Collective."""
        stiffness = self.contact.assembly.stiffness()
        if stiffness is None:
            return
        # Depths are of degree 1: mid nodes are no nodes of theirs
        V = self.contact.surfaces.slave_u.function_space
        stiffness /= compat.element_info(V).degree ** 2
        ratio = largest_of(self._comm, slopes) * stiffness / LIMIT
        if ratio > 1.0:
            self._may_warn = False
            warn(
                f"a step wears {ratio:.2g} times as deep as explicit steps may, so that "
                "pressures alternate from step to step: take smaller steps, or "
                "Wear(..., implicit=True)",
                page="fields",
            )

    def _worn(self, zone: ZoneData) -> tuple[Array, Array, Array]:
        """Facets and places of the points that slip, and what the step wears there times
        area: depth, and depth over pressure, (n, 2)."""
        points, dt = seen_points(zone), self.contact.dt
        slip = points["slip"] if zone.frictional else zone.cpp.slips_without_friction()
        nu = points["contact_normal"]
        p = -np.einsum("qi,qi->q", points["traction"], nu)
        hit = points["status"] > 0
        p, v = np.maximum(p[hit], 0.0), np.linalg.norm(slip[hit], axis=1) / dt
        rate = real_values("Wear.law", self.law(p.copy(), v.copy()), len(v))
        if not (np.isfinite(rate).all() and rate.min(initial=0.0) >= 0.0):
            raise ContactError(
                "Wear.law returns depths that are negative or not finite"
            )
        some = np.maximum(p, NEARLY_OPEN * p.max(initial=0.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = np.nan_to_num(np.asarray(self.law(some.copy(), v.copy())) / some)
        depth = np.column_stack([np.where(p > 0.0, rate, 0.0), slope])
        weight = dt * points["weight"][hit]
        return points["slave"][hit], points["xi"][hit], weight[:, None] * depth

    def volume(self) -> float:
        """Volume that the slave surfaces have lost: the integral of the depth over the
        undeformed surface, in 2D per thickness or of a full turn. Collective."""
        V = self.depth.function_space
        owned = V.dofmap.index_map.size_local
        mine = self.depth.x.array[:owned] @ self._areas[:owned]
        return float(self._comm.allreduce(mine))


def _nodal_areas(zone: ZoneData) -> Array:
    """Integrals of the linear shape functions over the undeformed facets, (facets, n)."""
    surface = zone.facets.slave_surface
    points, weights, m = surface_normals(surface)
    N, _ = shape_functions(surface.shape, 1, points)
    found: Array = np.einsum("q,qa,fq->fa", weights, N, np.linalg.norm(m, axis=-1))
    return found
