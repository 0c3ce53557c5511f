"""Positions and loads of rigid bodies, which differ by step."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np

from ..core.errors import raise_everywhere, require_agreement
from ..core.interface.zone_data import ZoneData
from ..core.target import Motions, Target
from ..rigid.turning import LARGEST_TURN
from .revolution import check_tools


def check(zone: ZoneData, has_friction: bool) -> None:
    """Refuse rigid bodies that differ between ranks or cannot be where they are.
    Collective."""
    bodies, comm = zone.facets.bodies, zone.comm
    if zone.facets.slave_surface.axisymmetric:
        check_tools(bodies, comm)
    _require_same_loads(bodies, comm)
    if has_friction:
        raise_everywhere(comm, _turned_too_far(zone.motions))


def _require_same_loads(bodies: Sequence[Target], comm: MPI.Comm) -> None:
    """Raise unless prescribed positions and loads agree on all ranks. Collective."""
    if comm.size == 1:
        return
    found = [
        {
            f"translation of the rigid {body.name}": body.cpp.moved,
            f"rotation of the rigid {body.name}": body.cpp.turned,
            f"force of the rigid {body.name}": body.force,
            f"moment of the rigid {body.name}": np.atleast_1d(body.moment),
        }
        for body in bodies
    ]
    for one in found:
        texts = {name: str(tuple(value.tolist())) for name, value in one.items()}
        require_agreement(comm, **texts)


def _turned_too_far(motions: Motions) -> str | None:
    """Message if a body turns too far in this step for friction, else None."""
    for body, was in zip(motions.bodies, motions.old):
        # The rotation between both is at most this; whole turns count too
        angle = float(np.linalg.norm(body.cpp.turned - was[3:6]))
        if angle >= LARGEST_TURN:
            return (
                f"{body!r} turns by {angle:.3g} rad since the accepted step: with "
                f"friction it has to be less than {LARGEST_TURN:.3g}; take more steps"
            )
    return None
