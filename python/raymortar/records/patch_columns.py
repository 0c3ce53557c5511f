"""Columns of a history on where contact is, torques, and the work of supports."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np

from ..arguments import direction, vector
from ..core import compat
from ..core.compat import Array
from ..core.errors import ContactError
from ..core.interface.pairs import as_label
from ..core.interface.point_results import CLOSED
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem
from ..core.state import Quantity, of_part
from ..results.sums import Resultant
from ..results.tractions import largest_pressure
from ..rigid.body import Body

# Label, slave surface, index of the master (None: all), and what finds the resultant
Part = tuple[str, int, int | None, Callable[[], Resultant]]
Columns = Iterator[tuple[list[str], Callable[[], Any]]]


def patch_columns(problem: CoupledProblem, parts: Sequence[Part]) -> Columns:
    """Yield area, centre and largest of the pressure of surfaces and pairs."""
    zones = problem.contact.zones
    axes = "xyz"[: zones[0].facets.slave_surface.gdim]
    for label, zone, master, _ in parts:
        names = [f"area_{label}", *(f"centre_{label}_{x}" for x in axes)]
        find = partial(_patch, zones[zone], master)
        yield [*names, f"max_pressure_{label}"], find


def _patch(zone: ZoneData, master: int | None) -> Array:
    """Find area, centre and largest of the pressure, NaN where nothing presses.
    Collective."""
    points = zone.points()
    closed = points["status"] >= CLOSED
    if master is not None:
        closed &= zone.masters_of(points) == master
    area, x, p = (points[name][closed] for name in ("weight", "x", "pressure"))
    sums = np.array([area.sum(), area @ p, *((area * p) @ x)])
    zone.comm.Allreduce(MPI.IN_PLACE, sums)
    largest = zone.comm.allreduce(largest_pressure(zone, points, closed), op=MPI.MAX)
    centre = sums[2:] / sums[1] if sums[1] > 0.0 else np.full(len(sums) - 2, np.nan)
    return np.array([sums[0], *centre, largest])


def checked_axes(problem: CoupledProblem, axes: Any) -> dict[str, tuple[Array, Array]]:
    """Point (3,) and unit direction (3,) of each axis by name."""
    gdim = problem.contact.u.function_space.mesh.geometry.dim
    if axes is None:
        return {}
    if not isinstance(axes, Mapping):
        raise ContactError(f"axes must be axes by name, not {axes!r}")
    if axes and problem.contact.system.axisymmetric:
        raise ContactError("axes: a solid of revolution has no torque")
    found = {}
    for name, axis in axes.items():
        if gdim == 2:
            point, along = vector(f"axes[{name!r}]", axis, 2), np.array([0, 0, 1.0])
        else:
            if not (isinstance(axis, (list, tuple)) and len(axis) == 2):
                raise ContactError(
                    f"axes[{name!r}] must be a point and a direction, not {axis!r}"
                )
            point = vector(f"axes[{name!r}]", axis[0], 3)
            along = direction(f"axes[{name!r}]", axis[1])
        found[str(name)] = point, along
    return found


def torque_columns(
    axes: Mapping[str, tuple[Array, Array]], parts: Sequence[Part]
) -> Columns:
    """Yield the torque of contact on slaves about each axis."""
    for name, (point, along) in axes.items():
        for label, *_, find in parts:
            yield [f"torque_{name}_{label}"], partial(_torque, find, point, along)


def _torque(find: Callable[[], Resultant], point: Array, along: Array) -> float:
    """Find a torque about an axis. Collective."""
    found = find()
    force = np.pad(found.force, (0, 3 - len(found.force)))
    moment = np.atleast_1d(found.moment)
    moment = np.pad(moment, (3 - len(moment), 0))
    return float(along @ (moment - np.cross(point, force)))


class SupportWork:
    """Sums up what supports have done on the bodies, step by step. Collective.

    The mean of the forces at both ends of a step works on the motion of each dof.
    """

    def __init__(self, problem: CoupledProblem, supports: Mapping[str, Any]) -> None:
        self._problem, self._supports = problem, supports
        self.names = [f"work_{name}" for name in supports]
        unknowns, n = problem.contact.unknowns, problem.contact.layout.n_u
        # Whether each support holds an owned dof of u
        held = [unknowns.prescribed_u(bcs)[0][:n] == 1 for bcs in supports.values()]
        self._held = np.array(held, dtype=float).reshape(-1, n)
        self.begin_here()

    def _now(self) -> tuple[Array, Array]:
        """Forces that hold the dofs of u, ghosts included, and u. Collective."""
        contact = self._problem.contact
        dofmap, u = contact.u.function_space.dofmap, contact.u.x.array.copy()
        if not (self.names and contact.system.updates):
            return np.zeros(len(u)), u
        forces = compat.create_la_vector(dofmap.index_map, dofmap.index_map_bs)
        forces.array[: contact.layout.n_u] = self._problem.forces()
        forces.scatter_forward()
        return forces.array.copy(), u

    def begin_here(self) -> None:
        """Take the present state as the beginning of the next step. Collective."""
        self._forces, self._u = self._now()

    def quantities(self) -> Iterator[Quantity]:
        """Yield forces and displacement at the last record."""
        unknowns = self._problem.contact.unknowns
        for k, one in enumerate(unknowns.displacements if self.names else ()):
            places, V = unknowns.u_places(k), one.u.function_space
            yield of_part(f"forces of supports {k}", self, "_forces", places, V)
            yield of_part(f"places of supports {k}", self, "_u", places, V)

    def values(self, last: Mapping[str, float] | None) -> list[float]:
        """Work so far, given the last record. Collective."""
        forces, u = self._now()
        power = 0.5 * (forces + self._forces) * (u - self._u)
        done = self._held @ power[: self._held.shape[1]]
        self._forces, self._u = forces, u
        done = self._problem.comm.allreduce(done)
        before = [0.0 if last is None else last[name] for name in self.names]
        return [float(a + b) for a, b in zip(before, done)]


def rigid_bodies(zones: Sequence[Any]) -> list[Body]:
    """List the rigid bodies that slaves meet, each once."""
    return list(dict.fromkeys(b for zone in zones for b in zone.facets.bodies))


class BodyColumns:
    """Record force, moment, motion and work of the rigid bodies of a contact."""

    def __init__(self, contact: Any) -> None:
        self._contact = contact
        self._bodies = rigid_bodies(contact.zones)
        self._dim = contact.u.function_space.mesh.geometry.dim
        plain = [as_label(body.name) for body in self._bodies]
        labels = [
            f"{label}_{k}" if plain.count(label) > 1 else label
            for k, label in enumerate(plain)
        ]
        self._columns = [self._names(label) for label in labels]
        self._begin = [self._motion(body) for body in self._bodies]
        self.names = [name for columns in self._columns for name in columns]

    def _names(self, label: str) -> list[str]:
        """Name push, translation, moment, rotation and work of a body."""
        axes = [f"_{x}" for x in "xyz"[: self._dim]]
        turns = axes if self._dim == 3 else [""]
        names = [f"push_{label}", f"translation_{label}"]
        found = [name + x for name in names for x in axes]
        names = [f"moment_{label}", f"rotation_{label}"]
        return [*found, *(name + x for name in names for x in turns), f"work_{label}"]

    def _motion(self, body: Body) -> Array:
        """Join translation and rotation."""
        turn = body.rotation if self._dim == 3 else body.rotation[2:]
        return np.concatenate([body.translation[: self._dim], turn])

    def values(self, last: Mapping[str, float] | None) -> list[float]:
        """Find the columns at the last update, given the last record. Collective."""
        found: list[float] = []
        for body, names, begin in zip(self._bodies, self._columns, self._begin):
            on = self._contact.results.resultant_on(body)
            force, moment = on.force, np.atleast_1d(on.moment)
            if on.radial is not None:  # work is done where a ring is widened
                force = np.array([on.radial, force[1]])
            load, motion = np.concatenate([force, moment]), self._motion(body)
            before, work, d = np.zeros_like(load), 0.0, self._dim
            if last is not None:
                *row, work = (last[name] for name in names)
                push, way, twist, turn = np.split(row, [d, 2 * d, d + len(load)])
                before, begin = np.append(push, twist), np.append(way, turn)
            work -= float(0.5 * (load + before) @ (motion - begin))
            found += [*force, *motion[:d], *moment, *motion[d:], work]
        return list(map(float, found))


def parts_of(find: Callable[[], Resultant], parts: Sequence[str]) -> Array:
    """Join some parts of a resultant. Collective."""
    found = find()
    return np.hstack([getattr(found, part) for part in parts])
