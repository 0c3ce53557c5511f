"""From tagged facets to the C++ zones: one per slave tag."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from ... import _cpp
from .. import compat
from ..compat import Array
from ..discretization.facets import Facets, facet_dof_table
from ..discretization.layout import Layout
from ..discretization.ranks import largest
from ..discretization.surfaces import Bodies, Surface, bodies_of_facets
from ..discretization.tagged import ZoneFacets
from ..hooks import hooks
from ..options.methods import ContactOptions, Search
from ..target import Motions
from .zone_data import MasterTags, ZoneData, nothing

# Search distances, in sizes of facets
DEFAULTS = {"reach": 2.0, "depth": 2.0, "skin": 0.5}


def _cpp_surface(surface: Surface, layout: Layout, bodies: Bodies) -> _cpp.Surface:
    """Convert a surface for C++."""
    found = _cpp.Surface(
        shape=getattr(_cpp.Shape, surface.shape),
        degree=surface.displacement_degree,
        node_degree=surface.node_degree,
        gdim=surface.gdim,
        X=surface.X,
        facet_nodes=surface.facet_nodes,
        facet_dofs=surface.facet_dofs,
        rows=layout.u_rows[surface.dofs],
        facet_id=surface.facet_ids,
    )
    found.set_bodies(bodies_of_facets(bodies, surface))
    return found


def _distances(
    search: Search, surface: _cpp.Surface, comm: MPI.Comm
) -> dict[str, Array]:
    """Find the search distances of the slave facets. Lengths. Collective.

    Defaults go by the diameter, or the mean diameter if that is larger, as steps are no
    smaller where the mesh is finer.
    """
    own = surface.diameters()
    total, count = comm.allreduce(own.sum()), comm.allreduce(len(own))
    sizes = np.maximum(own, total / count)
    given = {"reach": search.reach, "depth": search.depth, "skin": search.skin}
    return {
        name: DEFAULTS[name] * sizes if value is None else np.full_like(sizes, value)
        for name, value in given.items()
    }


def create_zone(
    zone: ZoneFacets,
    layout: Layout,
    options: ContactOptions,
    result_space: Any,
    behind: Sequence[Callable[[Facets, float], Array]],
    bodies: Bodies,
    tied: str | None = None,
) -> ZoneData:
    """Make the C++ zone of some facets. Collective.

    Results are in a scalar space of the multiplier's degree. A tie is tied, ``"keep"``
    or ``"close"``: what becomes of its gaps. `behind` is `Hooks.behind` of each mesh.
    """
    comm, search, friction = layout.comm, options.search, options.friction
    surface = zone.slave_surface
    slave, master = (_cpp_surface(side, layout, bodies) for side in zone.sides)
    distances = _distances(search, slave, comm)
    # With this thickness of both bodies, no depth is limited
    most = 2.0 * largest(comm, distances["depth"])
    of_slave = of_master = behind[zone.slave_part](zone.slave, most)
    if not zone.meets_itself:
        of_master = behind[zone.master_part](zone.master, most)
    thickness = of_slave, of_master
    for side, length in zip((slave, master), thickness):
        side.set_thickness(length)
    multipliers, nodes = _cpp.Multipliers(), np.empty(0, dtype=np.int32)
    table = np.empty((len(zone.slave.facets), 0), dtype=np.int32)
    q = surface.displacement_degree
    if layout.multiplier is not None:
        W = layout.multiplier.function_space
        q, table = compat.element_info(W).degree, facet_dof_table(W, zone.slave)
        nodes, local = np.unique(table, return_inverse=True)
        multipliers = _cpp.Multipliers(
            degree=q,
            components=layout.components,
            facet=local.reshape(table.shape).astype(np.int32),
            rows=layout.multiplier_rows[nodes],
        )
    degree = options.quadrature_degree
    if degree is None:
        sides = [(side.shape, side.displacement_degree) for side in zone.sides]
        degree = default_degree(sides, q, surface.axisymmetric)
    pair_filter = None
    if zone.share_vertices:
        assert hooks.never_meet is not None, "sides are apart in the core alone"
        offsets, neighbours = hooks.never_meet(*zone.sides, comm)
        pair_filter = _cpp.PairFilter(offsets=offsets, neighbours=neighbours)
    # Each place of a surface that meets itself is integrated from both sides
    share = 0.5 if zone.meets_itself else 1.0
    turn = "_of_revolution" if surface.axisymmetric else ""
    made_of = _cpp.ZoneInput(
        slave=slave,
        master=master,
        master_node_ids=zone.master_surface.node_ids,
        master_dof_ids=zone.master_surface.dof_ids,
        tools=[b.tool if tied is None else b.follower for b in zone.bodies],
        multipliers=multipliers,
        dual_multiplier=options.method.is_dual,
        method=options.method.cpp,
        condition=getattr(_cpp.Condition, options.method.condition or "points"),
        friction=None if friction is None else friction.cpp(),
        measure=getattr(_cpp.Measure, options.measure + turn),
        frame=getattr(_cpp.LawFrame, options.frame),
        keeps_springs=options.has_springs,
        moving_segments=options.tangent == "full",
        tie=None if tied is None else getattr(_cpp.TieGap, tied),
        distances=_cpp.SearchDistances(
            **distances, depth_is_default=search.depth is None
        ),
        strategy=getattr(_cpp.Strategy, search.strategy.replace("-", "_")),
        subdivide=search.subdivide,
        segment_rules=segment_rules(surface.shape, degree, share),
        facet_rule=facet_rule(surface.shape, degree, share),
        filter=pair_filter,
    )
    return ZoneData(
        zone,
        comm,
        _cpp.Zone(comm.py2f(), made_of),
        table,
        nodes.astype(np.int32),
        facet_dof_table(result_space, zone.slave),
        friction is not None or tied is not None,
        tied is not None,
        distances,
        search.depth is None,
        thickness,
        nothing(surface.gdim),
        MasterTags(zone, comm),
        MasterTags(zone, comm, zone.meets_itself),
        Motions(zone.bodies),
        multiplier_degree=q,
        dual_multiplier=layout.multiplier if options.method.is_dual else None,
        has_law_at_nodes=tied is None and options.method.condition == "nodes",
    )


def default_degree(
    sides: Sequence[tuple[str, int]], q: int, axisymmetric: bool = False
) -> int:
    """Degree of the rule on segments, from where more points change no error.

    `sides` has the shape of facets and the degree p of the displacement, slave first.
    Shape functions have degree p on flat simplices and 2p on flat parallelograms (without
    parallel sides they are rational, and no rule is exact). If the slave has simplices,
    their products with a multiplier of degree q (penalty: p of the slave) are exact. If it
    has quadrilaterals, uniform tractions are, with 1 more for the Jacobian. If either side
    has quadrilaterals, the degree is at least 4, so that a field of degree 2 beside a
    displacement of degree 1 has a uniform flux.
    """
    are_square = [shape == "quadrilateral" for shape, _ in sides]
    functions = max(2 * p if on else p for on, (_, p) in zip(are_square, sides))
    degree = functions + (1 if are_square[0] else q) + axisymmetric
    return max(degree, 4) if any(are_square) else degree


def segment_rules(shape: str, degree: int, share: float = 1.0) -> _cpp.SegmentRules:
    """Rules for the segments of facets of a shape.

    Polynomials of the degree are integrated exactly on any segment. On one with four
    vertices the Jacobian of its bilinear map takes one degree more, and three points
    each way are the least: with two, Newton's method may go to and fro between points
    of large segments that open and close. Integrals count by their share: where both
    sides are integrated over, each counts half [theory (3.15)].
    """
    if shape == "interval":
        return _cpp.SegmentRules(facet_rule("interval", degree, share))
    triangle = facet_rule("triangle", degree, share)
    fan = _along_rays(share) if degree == 3 else triangle
    quadrilateral = facet_rule("quadrilateral", max(degree + 1, 5), share)
    return _cpp.SegmentRules(triangle, quadrilateral, fan)


def facet_rule(shape: str, degree: int, share: float = 1.0) -> _cpp.QuadratureRule:
    """Rule for whole facets, with a share of its weights."""
    points, weights = compat.quadrature(shape, degree)
    return _cpp.QuadratureRule(points, share * weights)


def _along_rays(share: float) -> _cpp.QuadratureRule:
    """Product of Gauss rules along and across the rays from a triangle's first corner.

    Four points for degree 3, where rules that favour no corner take six; at other
    degrees they have no more points than products. Around a centre nothing else is
    asked for than symmetry of each triangle about its own.
    """
    r = np.array([6 - np.sqrt(6), 6 + np.sqrt(6)]) / 10  # Gauss points for r dr
    by_r = np.array([9 - np.sqrt(6), 9 + np.sqrt(6)]) / 36
    t, by_t = np.array([3 - np.sqrt(3), 3 + np.sqrt(3)]) / 6, 1 / 2
    points = np.stack([np.outer(r, 1 - t).ravel(), np.outer(r, t).ravel()], axis=1)
    return _cpp.QuadratureRule(points, share * np.repeat(by_r * by_t, 2))
