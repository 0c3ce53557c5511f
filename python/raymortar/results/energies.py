"""Work of friction, and the energy that a penalty stores."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..interface.point_results import OPEN, along_normal, pressures
from ..interface.zone_data import ZoneData


def friction_work(zones: Sequence[ZoneData], comm: MPI.Comm) -> float:
    """Integrate what tractions take over the step's slip. Collective."""
    return _integral(
        zones, lambda p: -np.einsum("qi,qi->q", p["traction"], p["slip"]), comm
    )


def stored_energy(zones: Sequence[ZoneData], comm: MPI.Comm, part: str) -> float:
    """Integrate |t|^2 / (2 gamma), or that of a part of t. Collective."""

    def density(points: dict[str, Array]) -> Array:
        normal = along_normal(points, points["traction"])
        tangential = points["traction"] - normal
        t = {"total": points["traction"], "normal": normal, "tangential": tangential}
        squared = np.einsum("qi,qi->q", t[part], t[part])
        # Points of a tie that meet no master have no coefficient
        return np.divide(
            squared, 2.0 * points["gamma"], np.zeros_like(squared), where=squared > 0.0
        )

    return _integral(zones, density, comm)


def work_on_gaps(zones: Sequence[ZoneData], comm: MPI.Comm) -> float:
    """Integrate |t_n g|, which a law at each point leaves zero. Collective."""

    def density(points: dict[str, Array]) -> Array:
        hit = points["status"] >= OPEN
        return np.abs(pressures(points) * np.where(hit, points["gap"], 0.0))

    return _integral(zones, density, comm)


def _integral(
    zones: Sequence[ZoneData],
    density: Callable[[dict[str, Array]], Array],
    comm: MPI.Comm,
) -> float:
    """Integrate over the slave surfaces of all ranks. Collective."""
    total = 0.0
    for zone in zones:
        points = zone.points()
        total += float(points["weight"] @ density(points))
    return float(comm.allreduce(total))
