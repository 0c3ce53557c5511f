"""Sort the rows of a coupled system into groups that are judged separately."""

from __future__ import annotations

from functools import partial

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array, Indices
from ..convergence.balance import Groups, largest_by, sum_by_group
from ..discretization.facets import shape_functions
from ..discretization.ranks import marked_everywhere
from ..discretization.surfaces import find_parts, surface_areas, surface_normals
from ..hooks import hooks
from .assembly import ContactAssembly
from .coupled import CoupledSystem


def groups_of(system: CoupledSystem) -> Groups:
    """Sort the rows of a system by body, patch of contact and field. Collective."""
    layout, V, fields = system.layout, system.u.function_space, system.unknowns.fields()
    comm, bodies = layout.comm, system.parts[0].surfaces.bodies
    of_row, mass = np.empty(layout.size, dtype=np.int32), [np.empty(0)]
    bs = V.dofmap.index_map_bs
    of_row[fields[0].rows] = np.repeat(bodies.dofs[: layout.n_u // bs], bs)
    sides, count, begin = [], bodies.count, layout.n
    for part in system.parts:
        own, c = part.layout.owned_multipliers, part.layout.components
        of_node, area, patches = _patches(part, count)
        mass.append(np.repeat(area[own], c))
        of_row[begin : begin + len(mass[-1])] = np.repeat(of_node[own], c)
        begin, count = begin + len(mass[-1]), count + patches
        sides += [(zone, of_node[zone.multiplier_nodes]) for zone in part.zones]
    free = count + np.arange(len(layout.bodies))
    of_bodies = [len(body.freedom) for body in layout.own_bodies]
    of_row[begin:] = np.repeat(free[: len(of_bodies)], of_bodies)
    forces = count + len(free)
    for group, field in enumerate(fields[1:], forces):
        of_row[field.rows] = group
    count = forces + len(fields) - 1

    stiffness, volume = np.zeros(layout.size), system.parts[0].volume
    assert volume is not None
    stiffness[fields[0].rows] = volume.diagonal
    stiffness[layout.n : begin] = np.concatenate(mass)
    couplings = np.zeros((len(fields), layout.size))
    if len(fields) > 1:
        couplings[:, : layout.n] = volume.couplings
    add = partial(sum_by_group, comm, of_row, count)
    rows, sums, squares = add(np.ones(layout.size), stiffness, stiffness**2)
    met = np.zeros((len(sides), 2 + count))
    for row, (zone, of_nodes) in zip(met, sides):
        slave, master = zone.facets.slave_surface, zone.facets.master_surface
        row[:2] = surface_areas(slave).sum(), len(slave.dofs)
        row[2 + bodies.dofs[np.append(slave.dofs, master.dofs)]] = 1.0
        row[2 + of_nodes] = 1.0
        row[2 + free] = [body in zone.facets.bodies for body in layout.bodies]
    met = comm.allreduce(met)
    size, largest = _sizes(system, count)

    def springs() -> Array:
        return np.array([body.freedom.spring_forces() for body in layout.bodies])

    found = Groups(
        comm=comm,
        of_row=of_row,
        count=count,
        forces=forces,
        bodies=bodies.count,
        free=len(free),
        fields=fields,
        mass=stiffness[layout.n : begin].copy(),
        size=size,
        largest=largest,
        mean=sums / rows,
        norm=np.sqrt(squares),
        coupling=np.sqrt(add(*couplings**2)).reshape(-1, count),
        mean_coupling=(add(*couplings) / rows).reshape(-1, count),
        area=met[:, 0],
        nodes=met[:, 1],
        met=met[:, 2:] > 0.0,
        gammas=lambda: np.array([p.gamma_scale for p in system.parts for _ in p.zones]),
        springs=springs,
        names=lambda: hooks.names(system, found),
    )
    return found


def _patches(part: ContactAssembly, first: int) -> tuple[Indices, Array, int]:
    """Connected patches of a contact. Collective.

    Returns
    -------
    of_node, area, count
        By the multiplier's block dofs: number of the patch, from `first` on, and int
        N_a dG over the undeformed facets, whether or not rays hit. The number of
        patches.
    """
    if part.surfaces.multiplier is None:
        return np.empty(0, dtype=np.int32), np.empty(0), 0
    W = part.surfaces.multiplier.function_space
    degree, index_map = compat.element_info(W).degree, W.dofmap.index_map
    area = compat.create_la_vector(index_map, 1)
    for zone in part.zones:
        surface = zone.facets.slave_surface
        points, weights, m = surface_normals(surface)
        N, _ = shape_functions(surface.shape, degree, points)
        areas = np.linalg.norm(m, axis=-1) * weights
        np.add.at(area.array, zone.multiplier_table, areas @ N)
    compat.scatter_reverse_add(area)
    table = np.concatenate([zone.multiplier_table for zone in part.zones])
    used = marked_everywhere(W, np.unique(table))
    of_node, count = find_parts(part.layout.comm, index_map, table, used)
    return of_node + first, area.array.copy(), count


def _sizes(system: CoupledSystem, count: int) -> tuple[Array, float]:
    """Size of each group and of all together: the diagonal of the box, or its distance
    from the origin if that is larger. Length. Collective."""
    bodies = system.parts[0].surfaces.bodies
    X = system.u.function_space.tabulate_dof_coordinates()
    ends = np.stack([largest_by(bodies.dofs, x, bodies.count) for x in (X, -X)])
    system.layout.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    boxes = np.append(ends, ends.max(axis=1)[:, None], axis=1)
    corners = np.max([boxes.sum(axis=0), *abs(boxes)], axis=0)
    *sizes, largest = np.linalg.norm(corners, axis=1)
    # Gaps are differences of positions of any two bodies
    return np.append(sizes, np.full(count - bodies.count, largest)), float(largest)
