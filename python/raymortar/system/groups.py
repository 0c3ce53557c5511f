"""Sort the rows of a coupled system into groups that are judged separately."""

from __future__ import annotations

from functools import partial

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array, Indices
from ..convergence.balance import Groups, Interface, largest_by, sum_by_group
from ..host.bodies import find_parts
from ..host.facet_areas import surface_areas, surface_normals
from ..host.marks import marked_everywhere
from ..host.reference_facets import shape_functions
from .assembly import ContactAssembly
from .coupled import CoupledSystem


def groups_of(system: CoupledSystem) -> Groups:
    """Sort the rows of a system by body, patch of contact and field. Collective.

    Parameters
    ----------
    system
        After `CoupledSystem.prepare`.
    """
    layout, host, parts = system.layout, system.host, system.parts
    comm, n, bodies = layout.comm, layout.n, parts[0].surfaces.bodies
    of_contacts, contact = [], np.full(bodies.count, -1)
    for k, part in enumerate(parts):
        of_node, found = _patches(part, len(contact))
        of_contacts.append(of_node)
        contact = np.append(contact, np.full(found, k))
    free = len(contact) + np.arange(len(layout.bodies))
    fields, forces = host.fields(), len(contact) + len(free)
    count = forces + len(fields) - 1
    contact = np.append(contact, np.full(count - len(contact), -1))

    of_row = np.empty(layout.size, dtype=np.int32)
    of_u = np.repeat(bodies.dofs, system.u.function_space.dofmap.index_map_bs)
    of_row[fields[0].rows] = of_u[: layout.n_u]
    for group, field in enumerate(fields[1:], forces):
        of_row[field.rows] = group
    of_bodies = [len(body.freedom) for body in layout.own_bodies]
    of_row[n:] = np.concatenate(
        [
            *map(_on_rows, parts, of_contacts),
            np.repeat(free[: len(of_bodies)], of_bodies),
        ]
    )
    add = partial(sum_by_group, comm, of_row, count)

    mass = np.concatenate([_on_rows(part, _lumped_area(part)) for part in parts])
    stiffness = np.zeros(layout.size)
    stiffness[fields[0].rows] = system.stiffness_diagonal
    stiffness[n : n + len(mass)] = mass
    rows, sums, squares = add(np.ones(layout.size), stiffness, stiffness**2)
    couplings = np.zeros((len(fields), layout.size))
    if len(fields) > 1:
        couplings[:, :n] = system.couplings
    size, largest = _sizes(system, count)

    def names() -> list[str]:
        dim = system.u.function_space.mesh.geometry.dim
        found = []
        for group, centre in enumerate((add(*_places(system)[:dim]) / rows).T):
            place = ", ".join(f"{value:.3g}" for value in centre)
            kind = "the body" if group < bodies.count else "the contact"
            found.append(f"{kind} around ({place})")
        for group, body in zip(free, layout.bodies):
            found[group] = f"the rigid {body.name}"
        return found[:forces] + [f"the unknown {field.name}" for field in fields[1:]]

    return Groups(
        comm=comm,
        of_row=of_row,
        count=count,
        forces=forces,
        bodies=bodies.count,
        free=len(free),
        contact=contact,
        fields=fields,
        mass=mass,
        size=size,
        largest=largest,
        mean=sums / rows,
        norm=np.sqrt(squares),
        coupling=np.sqrt(add(*couplings**2)).reshape(-1, count),
        mean_coupling=(add(*couplings) / rows).reshape(-1, count),
        interface=_interface(system, of_contacts, free, count),
        gammas=lambda: np.array([part.gamma_scale for part in parts]),
        names=names,
    )


def contact_forces(system: CoupledSystem, mass: Array) -> Array:
    """Traction times area at each owned multiplier row, and the forces other than
    contact at the rows of free rigid bodies. Force."""
    layout = system.layout
    rows = np.zeros(layout.size)
    for part in system.parts:
        part.layout.multiplier_to(rows, 1.0)
    rows[layout.n : layout.n + len(mass)] *= mass
    for body in layout.own_bodies:
        rows[layout.body_rows[body] - layout.begin] = body.pushed()[0]
    return rows[layout.n :]


def _patches(part: ContactAssembly, first: int) -> tuple[Indices, int]:
    """Number the connected patches of a contact by the multiplier's block dofs, -1 for
    none, and count them. Collective."""
    multiplier = part.surfaces.multiplier
    if multiplier is None:
        return np.empty(0, dtype=np.int32), 0
    W = multiplier.function_space
    table = np.concatenate([zone.multiplier_table for zone in part.zones])
    used = marked_everywhere(W, np.unique(table))
    found, count = find_parts(part.layout.comm, W.dofmap.index_map, table, used)
    return np.where(found < 0, found, found + first), count


def _on_rows(part: ContactAssembly, nodal: Array | Indices) -> Array:
    """Values at the multiplier's block dofs for each of its owned rows."""
    return np.repeat(
        nodal[part.layout.owned_multipliers], part.layout.components, axis=0
    )


def _lumped_area(part: ContactAssembly) -> Array:
    """int N_a dG at the multiplier's block dofs, over the undeformed facets, whether or
    not rays hit. Collective."""
    multiplier = part.surfaces.multiplier
    if multiplier is None:
        return np.empty(0)
    W = multiplier.function_space
    degree = compat.element_info(W).degree
    lumped = compat.create_la_vector(W.dofmap.index_map, 1)
    for zone in part.zones:
        surface = zone.facets.slave_surface
        points, weights, m = surface_normals(surface)
        areas = np.linalg.norm(m, axis=-1) * weights
        N, _ = shape_functions(surface.shape, degree, points)
        np.add.at(lumped.array, zone.multiplier_table, areas @ N)
    compat.scatter_reverse_add(lumped)
    return lumped.array.copy()


def _places(system: CoupledSystem) -> Array:
    """Undeformed positions of the nodes of the owned rows, 0 for rows without nodes,
    (3, rows)."""
    layout, V = system.layout, system.u.function_space
    X = np.repeat(V.tabulate_dof_coordinates(), V.dofmap.index_map_bs, axis=0)
    found, begin = np.zeros((layout.size, 3)), layout.n
    found[system.host.fields()[0].rows] = X[: layout.n_u]
    for part in system.parts:
        if part.surfaces.multiplier is not None:
            W = part.surfaces.multiplier.function_space
            rows = _on_rows(part, W.tabulate_dof_coordinates())
            found[begin : begin + len(rows)] = rows
            begin += len(rows)
    return found.T


def _sizes(system: CoupledSystem, count: int) -> tuple[Array, float]:
    """Size of each group and of all together: the diagonal of the box, or its distance
    from the origin if that is larger. Length. Collective."""
    X, bodies = (
        system.u.function_space.tabulate_dof_coordinates(),
        system.parts[0].surfaces.bodies,
    )
    ends = np.stack([largest_by(bodies.dofs, x, bodies.count) for x in (X, -X)])
    system.layout.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    boxes = np.append(ends, ends.max(axis=1)[:, None], axis=1)
    corners = np.max([boxes.sum(axis=0), *abs(boxes)], axis=0)
    *sizes, largest = np.linalg.norm(corners, axis=1)
    # Gaps are differences of positions of any two bodies
    return np.append(sizes, np.full(count - bodies.count, largest)), float(largest)


def _interface(
    system: CoupledSystem, of_contacts: list[Indices], free: Indices, count: int
) -> Interface:
    """Find the groups on both sides of each slave surface. Collective."""
    layout, bodies = system.layout, system.parts[0].surfaces.bodies
    zones = [(k, zone) for k, part in enumerate(system.parts) for zone in part.zones]
    sums = np.zeros((len(zones), 2 + count))
    for (k, zone), row in zip(zones, sums):
        sides = zone.facets.slave_surface, zone.facets.master_surface
        row[:2] = surface_areas(sides[0]).sum(), len(sides[0].dofs)
        for side in sides:
            row[2 + bodies.dofs[side.dofs]] = 1.0
        row[2 + of_contacts[k][zone.multiplier_nodes]] = 1.0
        row[2 + free] = [body in zone.facets.bodies for body in layout.bodies]
    layout.comm.Allreduce(MPI.IN_PLACE, sums)
    parts = [system.parts[k] for k, _ in zones]
    return Interface(
        np.array([k for k, _ in zones]),
        np.array([part.surfaces.multiplier is not None for part in parts]),
        area=sums[:, 0],
        nodes=sums[:, 1],
        met=sums[:, 2:] > 0.0,
    )
