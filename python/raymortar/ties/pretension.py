"""Bolts: two faces of a cut shank that are tied but for one opening, which has a force."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from .. import _cpp
from ..arguments import direction
from ..core.compat import Array
from ..core.convergence.balance import EPS
from ..core.discretization.facets import shape_functions
from ..core.errors import (
    ContactError,
    is_real_number,
    is_whole_number,
    raise_everywhere,
    require_agreement,
    together,
)
from ..core.interface.point_results import CLOSED
from ..core.interface.present import Follower
from ..core.options.methods import Search
from ..core.state import Quantity
from ..core.terms import Term
from ..entries import add_entries
from ..facet_functions import single_number
from .tie import Tie

# Least cosine between the axis and the mean normal of a face
_ALONG = 0.5


def _is_tag(given: Any) -> bool:
    """Whether an argument is a tag or a name of facets, not a body."""
    return isinstance(given, str) or is_whole_number(given)


class OpeningTerm(Term):
    """One length by which the faces of a tie overlap along an axis [theory (4.44)].

    Attributes
    ----------
    functions
        Unknown that it brings: the length.
    force
        Force that it carries, where it is not locked.
    length
        Where it is locked, the length that it keeps; None: it is not.
    """

    spoken = "pretensions"

    is_of_contact = True

    def __init__(self, tie: Tie, axis: Array) -> None:
        self._part, self._axis = tie.assembly, axis
        self._comm: MPI.Comm = tie.layout.comm
        self._f: Function = single_number(self._comm, "opening")
        self.functions = [self._f]
        self.force = 0.0
        self.length: float | None = None
        self._groups: Any = None
        self._row = -1
        # Force of a unit traction along the axis at each owned row, and the largest terms
        # of the own row at the last residual
        self._weights, self._terms = np.empty(0), 0.0

    @property
    def value(self) -> float:
        """The present length. Collective."""
        here = self._f.x.array
        return float(self._comm.bcast(here[0] if len(here) else 0.0))

    @property
    def is_solved_for(self) -> bool:
        """Whether a problem has it."""
        return self._row >= 0

    @property
    def _stiffness(self) -> float:
        """Force per length of the multiplier's unknowns on the whole face."""
        return float(self._part.gamma_scale) * self._area

    def start(self, system: Any) -> None:
        """Take the rows of the length and of the multiplier. Collective."""
        self._system, self._layout = system, system.layout
        unknowns = system.unknowns
        at = next(k for k, g in enumerate(unknowns.functions) if g is self._f)
        mine = self._layout.rows[unknowns.starts[at] : unknowns.starts[at + 1]]
        self._row = self._comm.bcast(int(mine[0]) if len(mine) else -1)
        self._own = self._layout.begin + np.arange(self._layout.size)
        b = self._layout.create_vector()
        area = 0.0
        for zone in self._part.zones:
            points = zone.points()
            on = points["status"] >= CLOSED
            weight, facet = points["weight"][on], points["slave"][on]
            shape, degree = zone.facets.slave_surface.shape, zone.multiplier_degree
            N, _ = shape_functions(shape, degree, points["xi"][on])
            first = self._part.layout.multiplier_rows[zone.multiplier_table[facet]]
            d = len(self._axis)
            rows = first[..., None] + np.arange(d)
            values = (weight[:, None] * N)[..., None] * self._axis
            kind = PETSc.IntType
            b.setValues(
                rows.ravel().astype(kind), values.ravel(), PETSc.InsertMode.ADD_VALUES
            )
            area += weight.sum()
        b.assemble()
        self._weights = b.array_r.copy()
        self._area = self._comm.allreduce(area)
        b.destroy()

    def couple(self, pattern: Any) -> None:
        """Tell how its row depends on it, for line searches and rounding errors."""
        unknowns = self._system.unknowns
        for field, row in zip(unknowns.fields(), pattern.couplings):
            mine = field.rows[self._layout.begin + field.rows == self._row]
            row[mine] += self._stiffness

    def set_groups(self, groups: Any) -> None:
        """Take the groups of rows by which residuals are measured."""
        self._groups = groups

    def rows(self) -> list[_cpp.FieldRows]:
        """Room for its row and its column at the multiplier's rows."""
        zones, found = list(self._system.zones), []
        d = np.arange(len(self._axis))
        for zone in self._part.zones:
            first = self._part.layout.multiplier_rows[zone.multiplier_table]
            own = (first[..., None] + d).reshape(len(first), first.shape[1] * len(d))
            rows = np.column_stack([own, np.full(len(own), self._row)])
            found.append(
                _cpp.FieldRows(
                    zone=next(k for k, other in enumerate(zones) if other is zone),
                    slave=rows.astype(np.int64),
                    master=np.empty(0, dtype=np.int64),
                    per_slave=rows.shape[1],
                    per_master=0,
                )
            )
        return found

    def tension(self) -> float:
        """Sum up the tractions along the axis. Force. Collective."""
        layout, multiplier = self._part.layout, self._part.surfaces.multiplier
        assert multiplier is not None
        own = layout.owned_multipliers
        values = multiplier.x.array.reshape(-1, layout.components)[own]
        first = layout.multiplier_rows[own] - layout.begin
        weights = self._weights[first[:, None] + np.arange(layout.components)]
        mine = np.array([np.sum(weights * values), np.abs(weights * values).sum()])
        self._comm.Allreduce(MPI.IN_PLACE, mine)
        self._terms = float(mine[1])
        return float(mine[0])

    def residual(self, bcs: Sequence[Any], lacking: Any) -> Array:
        """Balance of the force, or the length, in its own row, (n,). Collective."""
        length, tension = self.value, self.tension()
        found: Array = np.zeros(self._layout.n)
        if self.length is None:
            own = tension - self.force
            self._terms += abs(self.force)
        else:
            own = self._stiffness * (length - self.length)
            self._terms = self._stiffness * (abs(length) + abs(self.length))
        found[self._own[: len(found)] == self._row] = own
        return found

    def multiplier_residual(self) -> Array:
        """Overlap in the multiplier's rows. Collective."""
        behind = self._weights[self._layout.n :]
        return np.asarray(self._part.gamma_scale * self.value * behind)

    def sizes(self) -> tuple[Array, Array]:
        """Sizes of the terms of its row by group, and their rounding errors."""
        found = np.zeros(self._groups.count)
        at = self._groups.of_row[self._own == self._row]
        found[at] = self._terms
        self._comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        return found, EPS * found

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add its column, and its row. Collective."""
        here = np.flatnonzero(self._weights)
        rows, values = self._own[here], self._part.gamma_scale * self._weights[here]
        own, fixed = np.full(len(rows), self._row), self.length is not None
        add_entries(A, rows, own, values)
        if not fixed:
            add_entries(A, own, rows, values)
        if self._comm.rank == 0:
            one = np.array([self._row])
            add_entries(A, one, one, np.array([self._stiffness if fixed else 0.0]))


class Pretension(Tie, Follower):
    """Two faces of a cut shank, tied but for one opening that carries a force.

    A bolt is tightened by a given force and keeps its length afterwards. Cut its shank
    across, and tag both faces. They stay tied, point by point, but for one length by
    which they overlap along the axis,

    .. math:: x_m - x_s - g_0 n + \\delta a = 0, \\qquad \\int \\lambda \\cdot a = F

    with the unknown length :math:`\\delta`. After `lock` it is kept, and the force
    follows from the loads. It goes wherever a `Tie` does, and one problem takes several.
    Collective.

    Parameters
    ----------
    u, facet_tags, quadrature_degree, search, names, axisymmetric
        The same as for `Tie`.
    faces
        Tags or names of the two faces of the cut, ``("cut a", "cut b")``.
    axis
        Direction of the shank, fixed in space; either way along it is the same.
    force
        Force in the shank, positive if it pulls; in 2D per thickness, or with
        ``axisymmetric=True`` of a full turn; of a part of the bolt that of the part. Set the attribute between steps to change it.

    Raises
    ------
    ContactError
        For the same faults as `Tie`; for an axis across the faces.

    Notes
    -----
    Conditions may not prescribe all displacements along the axis on both faces.

    Examples
    --------
    >>> bolt = Pretension(u, facet_tags, ("cut a", "cut b"), (0, 0, 1), names=names)
    >>> def tighten(t):
    ...     bolt.force = 550.0 * t
    >>> LoadSteps(solver, tighten, steps=2).run()
    >>> bolt.lock()
    """

    def __init__(
        self,
        u: Function | Sequence[Function],
        facet_tags: Any,
        faces: tuple[int | str, int | str],
        axis: Sequence[float] | Array,
        force: float = 0.0,
        quadrature_degree: int | None = None,
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        axisymmetric: bool = False,
    ) -> None:
        is_pair = isinstance(faces, (tuple, list)) and len(faces) == 2
        if not is_pair or not all(_is_tag(one) for one in faces):
            raise ContactError(
                f"faces = {faces!r} must be the tags or names of two faces of a cut"
            )
        along = direction("axis", axis)
        super().__init__(
            u,
            facet_tags,
            [(faces[0], faces[1])],
            quadrature_degree=quadrature_degree,
            search=search,
            names=names,
            axisymmetric=axisymmetric,
        )
        comm = self.layout.comm
        require_agreement(comm, axis=str(along.tolist()))
        with together(comm):
            if len(axis) != self.zones[0].facets.slave_surface.gdim:
                raise ContactError(f"axis = {axis!r} is not in the space of the mesh")
        self._term = OpeningTerm(self, self._out_of_slave(along[: len(axis)]))
        self.terms = [self._term]
        self.force = force
        self.assembly.present.follow(self)

    def _out_of_slave(self, axis: Array) -> Array:
        """Turn the axis so that it points out of the first face. Collective."""
        points = self.zones[0].points()
        sums = (points["area"][:, None] * points["normal"]).sum(axis=0)
        sums = self.layout.comm.allreduce(np.append(sums, points["area"].sum()))
        cosine = float(sums[:-1] @ axis) / float(sums[-1])
        raise_everywhere(
            self.layout.comm,
            f"axis = {axis.tolist()} runs along the faces of the cut: it must be that of "
            "the shank, across them"
            if abs(cosine) < _ALONG
            else None,
        )
        return float(np.sign(cosine)) * axis

    def __repr__(self) -> str:
        return f"<Pretension across {self.pairs[0]}>"

    @property
    def force(self) -> float:
        """Force in the shank that was asked for; to set it ends a `lock`."""
        return self._term.force

    @force.setter
    def force(self, value: float) -> None:
        if not (is_real_number(value) and np.isfinite(value)):
            raise ContactError(f"force = {value!r} must be a finite number")
        self._term.force, self._term.length = float(value), None
        self.assembly.present.note_change()

    @property
    def is_locked(self) -> bool:
        """Whether the present length is kept."""
        return self._term.length is not None

    def lock(self) -> None:
        """Keep the present length from the next solve on. Collective."""
        self._require_problem()
        if self._term.length is None:
            self._term.length = self._term.value
            self.assembly.present.note_change()

    def opening(self) -> float:
        """Length by which the faces overlap, positive where the shank was shortened:
        how far the nut was turned, along the axis. Collective."""
        return self._term.value

    def tension(self) -> float:
        """Force in the shank. Collective."""
        self._require_problem()
        self.results.warn_if_unsolved()
        return self._term.tension()

    def _require_problem(self) -> None:
        """Raise if no problem has solved for the opening."""
        if not self._term.is_solved_for:
            raise ContactError("the Pretension is in no problem: give it to one")

    # State

    def quantities(self) -> Iterator[Quantity]:
        """Yield whether the length is kept, and the length."""

        def read() -> Array:
            kept = self._term.length
            return np.array([kept is not None, 0.0 if kept is None else kept])

        def write(values: Array) -> None:
            self._term.length = float(values[1]) if values[0] else None

        yield Quantity("lock", read, write)
