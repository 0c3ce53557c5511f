"""From tagged facets to the C++ zones: one per slave tag."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

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
    """Check pairs, and collect the master tags, or rigid bodies, of each slave tag."""
    try:
        given = [(slave, master) for slave, master in pairs]
    except (TypeError, ValueError):
        raise ContactError(
            f"pairs must be a list of (slave tag, master tag), not {pairs!r}"
        ) from None
    if not given:
        raise ContactError("pairs is empty: give at least one (slave, master)")
    groups: dict[int, list[Any]] = {}
    for slave, master in given:
        _check_tags(slave, master)
        slave = int(slave)
        master = master if isinstance(master, Body) else int(master)
        if slave == master:
            raise ContactError(
                f"tag {slave} is slave and master of the same pair: split it into two "
                "tags that share no vertex. Contact of a surface with itself is not "
                "offered yet"
            )
        if slave in groups.get(master, []):
            raise ContactError(
                f"pair ({master}, {slave}) is given in both orders: their contact "
                "would be counted twice"
            )
        masters = groups.setdefault(slave, [])
        if masters and isinstance(masters[0], Body) != isinstance(master, Body):
            raise ContactError(
                f"slave tag {slave} has masters with tags and rigid ones: give each kind "
                "a Contact of its own, NonlinearProblem(F, [one, other])"
            )
        if master not in masters:
            masters.append(master)
    return {slave: tuple(masters) for slave, masters in groups.items()}


def _check_tags(slave: Any, master: Any) -> None:
    """Raise unless both sides are tags, or the master a rigid body."""
    if as_body(slave) is not None:
        raise ContactError(
            f"{slave!r} is the slave of a pair: a rigid shape has no facets to "
            "integrate over, so it can be a master only"
        )
    for tag in (slave, master):
        if isinstance(tag, type) and issubclass(tag, (Shape, Body)):
            raise ContactError(
                f"pairs has the class rigid.{tag.__name__}, not a shape made of it, as "
                f"rigid.{tag.__name__}(...)"
            )
        if not (is_whole_number(tag) or isinstance(tag, Body)):
            raise ContactError(f"pairs has the tag {tag!r}, which is no whole number")


def described(masters: Masters) -> tuple[Any, ...]:
    """Masters as values that ranks can compare."""
    return tuple(repr(m) if isinstance(m, Body) else m for m in masters)


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
    found = {}
    for name, default in {"reach": 2.0, "depth": 2.0, "skin": 0.5}.items():
        given = getattr(search, name)
        found[name] = default * sizes if given is None else np.full_like(sizes, given)
    return found


def _multipliers(
    zone: ZoneFacets, layout: Layout
) -> tuple[_cpp.Multipliers, Indices, Indices]:
    """Convert the multiplier of a zone for C++, with its dof table and sorted dofs."""
    if layout.multiplier is None:
        none = np.empty((len(zone.slave.facets), 0), dtype=np.int32)
        return _cpp.Multipliers(), none, np.empty(0, dtype=np.int32)
    W = layout.multiplier.function_space
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
    """Make the C++ zone of some facets. Collective.

    Results are in a scalar space of the multiplier's degree. A tie is tied, ``"keep"``
    or ``"close"``: what becomes of its gaps. Cells are those of each mesh.
    """
    comm, search, friction = layout.comm, options.search, options.friction
    surface = zone.slave_surface
    slave = _cpp_surface(surface, layout, bodies)
    master = _cpp_surface(zone.master_surface, layout, bodies)
    distances = _distances(search, slave, comm)
    # With this thickness of both bodies, no depth is limited
    most = 2.0 * comm.allreduce(distances["depth"].max(initial=0.0), op=MPI.MAX)
    thickness = (
        thickness_behind(cells[zone.slave_part], zone.slave, most),
        thickness_behind(cells[zone.master_part], zone.master, most),
    )
    slave.set_thickness(thickness[0])
    master.set_thickness(thickness[1])
    multipliers, table, nodes = _multipliers(zone, layout)
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
    return ZoneData(
        zone,
        _cpp.Zone(comm.py2f(), made_of),
        table,
        nodes,
        facet_dof_table(result_space, zone.slave),
        friction is not None or tied is not None,
        tied is not None,
        distances,
        search.depth is None,
        thickness,
        nothing(surface.gdim),
        MasterTags(zone, comm),
        Motions(zone.bodies),
    )
