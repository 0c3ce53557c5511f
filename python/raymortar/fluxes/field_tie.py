"""Fields that are continuous across surfaces whose meshes do not match."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..core import compat
from ..core.compat import Array, Indices
from ..core.discretization.facets import join
from ..core.discretization.joined import Displacement, parts_of
from ..core.errors import ContactError
from ..core.interface.pairs import Pair
from ..core.options.methods import Penalty, Search
from ..core.terms import Addition
from ..facet_functions import function_on_facets
from ..setup.arguments import check_fields
from ..ties.tie import Tie
from .flux_sides import TiedField
from .flux_terms import FluxTerms, TiePart

# A field on a surface, and this rank's facets there
Side = tuple[Displacement, Indices]


class FieldTie(Addition):
    """A field that is continuous across surfaces whose meshes do not match. Collective.

    For temperatures, potentials, velocities: any field that is no displacement. Its
    jump vanishes in the mean over the test functions of a multiplier, the flux from the
    slave to the master per area [theory (7.6)]. Give it to a problem in a list:
    ``FieldProblem(F_T, T, FieldTie(T, facets, pairs), bcs)`` with the field alone,
    ``NonlinearProblem([F_u, F_T], [contact, tie], bcs, u=[u, T])`` beside a displacement.

    Parameters
    ----------
    T
        The field: a Lagrange Function of degree 1 or 2, scalar or vector, or a part of a
        mixed Function that is one. If bodies have meshes of their own, a list.
    facet_tags, pairs, quadrature_degree, search, names, axisymmetric
        The same as for `Tie`. The surfaces are tied where they lie undeformed.

    Attributes
    ----------
    multiplier
        Unknown of the tie: a Function on the slave facets alone.
    part
        Object that adds entries to residual and tangent.

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike; for slave nodes without a master.

    Notes
    -----
    Let the side with the coarser facets be the slave if it is stiff: its flux has one
    value for each slave node. Where the field is prescribed on slave nodes, the
    multiplier is the mean of those next to them. A displacement has `Tie`, which turns
    with the bodies.

    Examples
    --------
    >>> tie = raymortar.fluxes.FieldTie(T, facet_tags, [("upper", "lower")], names=names)
    >>> problem = raymortar.fluxes.FieldProblem(F, T, tie, bcs)
    >>> problem.solve()
    >>> tie.rate()  # heat from the upper body to the lower one, per time
    """

    term = FluxTerms

    def __init__(
        self,
        T: Function | Sequence[Function],
        facet_tags: Any,
        pairs: Sequence[tuple[int | str, int | str]],
        quadrature_degree: int | None = None,
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        axisymmetric: bool = False,
    ) -> None:
        several = list(T) if isinstance(T, (list, tuple)) else [T]
        check_fields("FieldTie.T", several)
        fields = [Displacement(f, k) for k, f in enumerate(several)]
        # A tie of displacements, which stay zero, finds the pairs
        still = [_at_rest(f) for f in fields]
        tie = Tie(
            still if isinstance(T, (list, tuple)) else still[0],
            facet_tags,
            pairs,
            Penalty(1.0),
            quadrature_degree=quadrature_degree,
            search=search,
            names=names,
            axisymmetric=axisymmetric,
        )
        u = tie.surfaces.u
        sides = [TiedField(zone, u, fields, 0.0) for zone in tie.zones]
        slaves = join([zone.facets.slave for zone in tie.zones])
        part = tie.zones[0].facets.slave_part
        (of,) = (
            f
            for f in fields
            if compat.on_mesh(f.u, parts_of(u)[part].function_space.mesh)
        )
        self.multiplier, table = function_on_facets(
            of.u.function_space, slaves, f"flux of {several[0].name}"
        )
        self.part = TiePart(sides, self.multiplier, table)
        self._tie = tie

    def __repr__(self) -> str:
        pairs = ", ".join(map(str, self._tie.pairs))
        return f"<FieldTie of {self.part.name} across {pairs}>"

    def require_apart(self, other: Any) -> None:
        """Raise on a rank where another tie holds the field on the same facets."""
        pair = self.shared_pair(other) if isinstance(other, FieldTie) else None
        if pair is not None:
            raise ContactError(
                f"two FieldTies of {self.part.name} tie the pair {pair}, whose "
                "multipliers then have no unique values: leave one of them out"
            )

    def shared_pair(self, other: FieldTie) -> Pair | None:
        """Find a pair on which this tie and another one hold the same field, as far as
        facets of this rank show."""
        for pair, mine in self._tied_sides():
            for _, theirs in other._tied_sides():
                if _are_same(mine, theirs) or _are_same(mine, theirs[::-1]):
                    return pair
        return None

    def _tied_sides(self) -> Iterator[tuple[Pair, list[Side]]]:
        """Yield each pair, and the field and this rank's facets of its two sides."""
        for pair in self._tie.pairs:
            side = self.part.sides[pair.surface]
            facets = side.zone.facets
            master = facets.masters[facets.master_tags.index(pair.master)]
            yield pair, [
                (side.slave.of, facets.slave.facets),
                (side.master.of, master.facets),
            ]

    def rate(self) -> float | Array:
        """Integrate the flux from the slaves to the masters. Collective.

        Per time if the field's equation is a rate. With ``axisymmetric=True`` over a
        full turn.

        Returns
        -------
        A number; of a vector field its components.
        """
        if not self.part.is_solved_for:
            raise ContactError(
                f"the FieldTie of {self.part.name} is in no problem: give a problem a "
                "list with it"
            )
        found = self.part.rate()
        return float(found[0]) if len(found) == 1 else found


def _are_same(some: Sequence[Side], others: Sequence[Side]) -> bool:
    """Whether two pairs of sides have facets in common, and one field on them."""
    return all(
        f.component == g.component
        and np.shares_memory(f.given.x.array, g.given.x.array)
        and np.intersect1d(mine, theirs).size > 0
        for (f, mine), (g, theirs) in zip(some, others)
    )


def _at_rest(f: Displacement) -> Function:
    """A zero displacement on the mesh of a field."""
    V = f.u.function_space
    degree = compat.element_info(V).degree
    return Function(compat.vector_space(V.mesh, degree), name=f.given.name)
