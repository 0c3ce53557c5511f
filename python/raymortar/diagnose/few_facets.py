"""Contact that few facets carry, by which forces and tractions depend on gamma."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices
from ..core.discretization.surfaces import Bodies, bodies_of_facets
from ..core.finding import Finding, placed
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.zone_data import ZoneData, mean_facet_size
from ..core.problem import CoupledProblem
from .narrow import forces_on_facets, undeformed_middles

# Work of the law's residuals, over that of the bodies, from which on forces change with
# gamma by some percent (docs/measured/few_facets)
SHARE = 0.02
# Work from which on they change by 10 % and more
WRONG = 0.1
# Facets across from which on forces hold although that work is large, as where bodies
# bend (the shells of the demo: 36 facets, a work of 0.28, forces within 1.2 %)
ENOUGH = 4
# Pressure that is rounding error, of gamma times the size of a facet
NO_PRESSURE = 1e-10


class FewFacets:
    """Dependence of the forces on a slave surface on gamma, in one state. Collective.

    Forces depend on it by the work of the law's residuals over that of the bodies that
    touch there [theory (4.36)]. `points` are those of the surface.

    Attributes
    ----------
    force
        Sum of the normal forces on all points of all ranks. Force.
    """

    def __init__(self, zone: ZoneData, points: dict[str, Array]) -> None:
        self._zone = zone
        weight, gamma = points["weight"], points["gamma"]
        closed, is_open = points["status"] >= CLOSED, points["status"] == OPEN
        self._carried = forces_on_facets(zone, points)
        left = (points["traction"] ** 2).sum(axis=1) / gamma * is_open
        left += gamma * points["gap"] ** 2 * closed
        pressed = points["pressure"] ** 2 / gamma * closed
        mine = [self._carried.sum(), weight @ left, weight @ pressed]
        mine += [np.count_nonzero(self._carried), weight @ gamma, weight.sum()]
        *found, stiffness, area = map(float, zone.comm.allreduce(np.array(mine)))
        self.force, self._left, self._pressed, self._facets = found
        self._gamma = stiffness / area if area > 0.0 else 0.0

    def told(
        self, problem: CoupledProblem, pair: str, about: tuple[Any, ...]
    ) -> Iterator[Finding]:
        """Find that forces depend on gamma. Collective.

        The forms are assembled only if the residuals are large beside the pressure on
        the facets themselves, which do a part of the bodies' work.
        """
        if self._left <= SHARE * self._pressed:
            return
        if self.force <= rounding_force(self._zone, self._gamma):
            return
        work = _work_of_bodies(problem, self._zone)
        if not self._left > SHARE * work > 0.0:
            return
        middles = undeformed_middles(self._zone)
        most: tuple[float, tuple[float, ...]] = (0.0, ())
        if self._carried.any():
            k = int(np.argmax(self._carried))
            most = float(self._carried[k]), placed(middles[k], middles)
        place = max(self._zone.comm.allgather(most))[1]
        count, share = int(self._facets), self._left / work
        are_few = count < ENOUGH ** (len(place) - 1)
        carry = "1 facet carries" if count == 1 else f"{count} facets carry"
        yield Finding(
            pair,
            place,
            f"{carry} the contact, and forces depend on gamma (indicator {share:.2g})",
            "Make facets there smaller"
            + (f", until at least {ENOUGH} lie across" if are_few else ""),
            share,
            is_wrong=share > WRONG and are_few,
            about=about,
            force=self.force,
        )


def _work_of_bodies(problem: CoupledProblem, zone: ZoneData) -> float:
    """Work of the inner forces of the bodies on both sides, on their displacements less
    their mean motions, as these do no work. Collective.

    Forces at rest are loads, which are left out. Where a function sets the coefficients of
    the forms, they are unknown: then all forces count by their amounts, which is more.
    """
    unknowns, volume = problem.contact.unknowns, problem.volume
    surfaces = problem.contact.parts[0].surfaces
    forces = problem.forces_of_bodies()[unknowns.u_owned]
    V, bodies = surfaces.u.function_space, surfaces.bodies
    d = V.dofmap.index_map_bs
    u = unknowns.owned_values()[unknowns.u_owned].reshape(-1, d)
    body = bodies.dofs[: len(u)]
    X = V.tabulate_dof_coordinates()[: len(u), :d]
    u = _at_rest(problem.comm, X, u, (body, bodies.count), surfaces.axisymmetric)
    if volume.updated is not None:
        forces, u = np.abs(forces), np.abs(u)
    else:
        with unknowns.lent() as rest:
            rest[unknowns.u_local] = 0.0
            unknowns.set_values(rest)
            forces = forces - problem.forces_of_bodies()[unknowns.u_owned]
    touch = _touching(zone, bodies)
    work = np.bincount(body, (forces.reshape(-1, d) * u).sum(axis=1), bodies.count)
    touches, works = problem.comm.allreduce(np.array([touch, work]))
    # Parts of a body that have turned by themselves may do less than none
    return abs(float(works[touches > 0.0].sum()))


def approach(problem: CoupledProblem, zone: ZoneData) -> float:
    """Sum the largest displacements of the bodies on both sides, less their mean motions.
    Length. Collective."""
    unknowns, surfaces = problem.contact.unknowns, problem.contact.parts[0].surfaces
    bodies, V = surfaces.bodies, surfaces.u.function_space
    u = unknowns.owned_values()[unknowns.u_owned].reshape(-1, V.dofmap.index_map_bs)
    body, X = (
        bodies.dofs[: len(u)],
        V.tabulate_dof_coordinates()[: len(u), : u.shape[1]],
    )
    u = _at_rest(problem.comm, X, u, (body, bodies.count), surfaces.axisymmetric)
    most = np.zeros((2, bodies.count))
    np.maximum.at(most[0], body, np.linalg.norm(u, axis=1))
    most[1] = _touching(zone, bodies)
    problem.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
    return float((most[0] * most[1]).sum())


def _touching(zone: ZoneData, bodies: Bodies) -> Array:
    """Mark the bodies of a surface's two sides on this rank, (bodies,)."""
    touch = np.zeros(bodies.count)
    sides = zone.facets.slave_surface, zone.facets.master_surface
    touch[np.concatenate([bodies_of_facets(bodies, side) for side in sides])] = 1.0
    return touch


def _at_rest(
    comm: MPI.Comm, X: Array, u: Array, of: tuple[Indices, int], axisymmetric: bool
) -> Array:
    """Displacements of owned nodes at X less the rigid motion of their body that fits best
    in the mean, (n, d). `of` is the body of each node, and their number. Collective.

    A solid of revolution moves along its axis alone.
    """
    (body, count), d = of, X.shape[1]
    places = np.concatenate([np.ones((len(X), 1)), X, X + u], axis=1)
    sums = np.zeros((count, 1 + 2 * d))
    np.add.at(sums, body, places)
    sums = comm.allreduce(sums)
    means = sums[:, 1:] / sums[:, :1]
    if axisymmetric:
        return u - (means[:, d:] - means[:, :d])[body] * np.array([0.0, 1.0])
    before, now = np.split(places[:, 1:] - means[body], 2, axis=1)
    moments = np.zeros((count, d, d))
    np.add.at(moments, body, now[:, :, None] * before[:, None, :])
    left, _, right = np.linalg.svd(comm.allreduce(moments))
    left[:, :, -1] *= np.linalg.det(left @ right)[:, None]  # no reflection
    turned = np.einsum("nij,nj->ni", (left @ right)[body], before)
    return np.asarray(now - turned)


def rounding_force(zone: ZoneData, gamma: float) -> float:
    """Force on a slave facet of mean size that is rounding error. Collective."""
    size = mean_facet_size([zone])
    return float(NO_PRESSURE * gamma * size**zone.facets.slave_surface.gdim)
