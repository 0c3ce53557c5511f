"""From tagged facets to the C++ zones: one per slave tag."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .. import _cpp, compat
from ..checked import is_whole_number
from ..compat import Array, Indices
from ..errors import ContactError
from ..host.bodies import Bodies, bodies_of_facets
from ..host.facets import facet_dof_table
from ..host.layout import Layout
from ..host.surfaces import Surface
from ..host.tagged import ZoneFacets
from ..host.thickness import Cells, thickness_behind
from ..options import quadrature
from ..options.contact_options import ContactOptions
from ..options.methods import Search
from ..rigid.body import Body, as_body
from ..rigid.motions import Motions
from ..rigid.shapes import Shape
from .zone_data import Masters, MasterTags, ZoneData, nothing


def group_pairs(pairs: Any) -> dict[int, Masters]:
    """Master tags, or rigid bodies, of each slave tag, after checking the list of
    pairs."""
    try:
        given = [(slave, master) for slave, master in pairs]
    except (TypeError, ValueError):
        raise ContactError(
            f"pairs must be a list of (slave tag, master tag), not {pairs!r}"
        ) from None
    if not given:
        raise ContactError("pairs is empty: give at least one (slave, master)")
    for slave, _ in given:
        if as_body(slave) is not None:
            raise ContactError(
                f"{slave!r} is the slave of a pair: a rigid shape has no facets to "
                "integrate over, so it can be a master only"
            )
    for tag in chain.from_iterable(given):
        if isinstance(tag, type) and issubclass(tag, (Shape, Body)):
            raise ContactError(
                f"pairs has the class rigid.{tag.__name__}, not a shape made of it, as "
                f"rigid.{tag.__name__}(...)"
            )
        if not (is_whole_number(tag) or isinstance(tag, Body)):
            raise ContactError(f"pairs has the tag {tag!r}, which is no whole number")
    tags = [
        (int(slave), master if isinstance(master, Body) else int(master))
        for slave, master in given
    ]
    for slave, master in tags:
        if slave == master:
            raise ContactError(
                f"tag {slave} is slave and master of the same pair: split it into two "
                "tags that share no vertex. Contact of a surface with itself is not "
                "offered yet"
            )
        if (master, slave) in tags:
            raise ContactError(
                f"pair ({slave}, {master}) is given in both orders: their contact "
                "would be counted twice"
            )
    groups: dict[int, list[Any]] = {}
    for slave, master in tags:
        if master not in groups.setdefault(slave, []):
            groups[slave].append(master)
    for slave, masters in groups.items():
        if len({isinstance(master, Body) for master in masters}) > 1:
            raise ContactError(
                f"slave tag {slave} has masters with tags and rigid ones: give each kind "
                "a Contact of its own, NonlinearProblem(F, [one, other])"
            )
    return {slave: tuple(masters) for slave, masters in groups.items()}


def described(masters: Masters) -> tuple[Any, ...]:
    """Masters as values that ranks can compare."""
    return tuple(repr(m) if isinstance(m, Body) else m for m in masters)


def _cpp_surface(surface: Surface, layout: Layout) -> _cpp.Surface:
    return _cpp.Surface(
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


def _sizes(surface: _cpp.Surface, comm: MPI.Comm) -> Array:
    """Unit of the facets' search distances: the diameter, or the mean diameter if that
    is larger, as steps are no smaller where the mesh is finer. Shape (n_facets,).
    Length. Collective.
    """
    own = surface.diameters()
    total = comm.allreduce(own.sum(), op=MPI.SUM)
    return np.maximum(own, total / comm.allreduce(len(own), op=MPI.SUM))


def _distances(search: Search, sizes: Array) -> dict[str, Array]:
    """Search distances of the slave facets, the defaults from their sizes. Lengths."""
    defaults = {"reach": 2.0, "depth": 2.0, "skin": 0.5}
    given = {name: getattr(search, name) for name in defaults}
    return {
        name: default * sizes
        if given[name] is None
        else np.full(len(sizes), float(given[name]))
        for name, default in defaults.items()
    }


def _multipliers(
    zone: ZoneFacets, multiplier: Function | None, layout: Layout
) -> tuple[_cpp.Multipliers, Indices, Indices]:
    """Multiplier of a zone for C++, its dof table, and its sorted dofs."""
    if multiplier is None:
        none = np.empty((len(zone.slave.facets), 0), dtype=np.int32)
        return _cpp.Multipliers(), none, np.empty(0, dtype=np.int32)
    W = multiplier.function_space
    table = facet_dof_table(W, zone.slave)
    nodes, local = np.unique(table, return_inverse=True)
    cpp = _cpp.Multipliers(
        degree=compat.element_info(W).degree,
        components=layout.components,
        facet=local.reshape(table.shape).astype(np.int32),
        rows=layout.multiplier_rows[nodes],
    )
    return cpp, table, nodes.astype(np.int32)


def create_zone(
    zone: ZoneFacets,
    layout: Layout,
    options: ContactOptions,
    result_space: Any,
    cells: Sequence[Cells],
    bodies: Bodies,
    tied: str | None = None,
) -> ZoneData:
    """C++ zone of some facets. Collective.

    Parameters
    ----------
    zone
        Its facets.
    layout
        Rows of the unknowns.
    options
        What the user has chosen.
    result_space
        Scalar space of the multiplier's degree.
    cells
        Of each mesh.
    bodies
        Parts of the mesh that are connected.
    tied
        ``"keep"`` or ``"close"``: a tie, and what becomes of its gaps; None: contact.
    """
    comm, search, friction = layout.comm, options.search, options.friction
    slave = _cpp_surface(zone.slave_surface, layout)
    master = _cpp_surface(zone.master_surface, layout)
    distances = _distances(search, _sizes(slave, comm))
    # With this thickness of both bodies, no depth is limited
    most = 2.0 * comm.allreduce(distances["depth"].max(initial=0.0), op=MPI.MAX)
    thickness = tuple(
        thickness_behind(cells[part], side, most)
        for part, side in (
            (zone.slave_part, zone.slave),
            (zone.master_part, zone.master),
        )
    )
    slave.set_thickness(thickness[0])
    master.set_thickness(thickness[1])
    slave.set_bodies(bodies_of_facets(bodies, zone.slave_surface))
    master.set_bodies(bodies_of_facets(bodies, zone.master_surface))
    surface = zone.slave_surface
    multipliers, table, nodes = _multipliers(zone, layout.multiplier, layout)
    p = surface.displacement_degree
    q = compat.element_info(result_space).degree if layout.multiplier else p
    degree = options.quadrature_degree
    if degree is None:
        degree = quadrature.default_degree(surface.shape, p, q, surface.axisymmetric)
    turn = "_of_revolution" if surface.axisymmetric else ""
    made_of = _cpp.ZoneInput(
        slave=slave,
        master=master,
        master_node_ids=zone.master_surface.node_ids,
        master_dof_ids=zone.master_surface.dof_ids,
        tools=[body.tool for body in zone.bodies],
        multipliers=multipliers,
        method=options.method.cpp(),
        friction=None if friction is None else friction.cpp(),
        measure=getattr(_cpp.Measure, options.measure + turn),
        frame=getattr(_cpp.LawFrame, options.frame),
        moving_segments=options.tangent == "full",
        tie=None if tied is None else getattr(_cpp.TieGap, tied),
        distances=_cpp.SearchDistances(
            **distances, depth_is_default=search.depth is None
        ),
        strategy=getattr(_cpp.Strategy, search.strategy.replace("-", "_")),
        subdivide=search.subdivide,
        segment_rules=quadrature.segment_rules(surface.shape, degree),
        facet_rule=quadrature.facet_rule(surface.shape, degree),
    )
    results = facet_dof_table(result_space, zone.slave)
    return ZoneData(
        zone,
        _cpp.Zone(comm.py2f(), made_of),
        table,
        nodes,
        results,
        friction is not None or tied is not None,
        tied is not None,
        distances,
        search.depth is None,
        thickness,
        nothing(surface.gdim),
        MasterTags(zone, comm),
        Motions(zone.bodies),
    )
