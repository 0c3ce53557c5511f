"""Meshes, facets and tools of solids of revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh

from ..core.discretization.facets import ON_AXIS, Facets, coordinates, on_axis, size_of
from ..core.discretization.joined import parts_of
from ..core.discretization.tagged import ZoneFacets
from ..core.errors import (
    ContactError,
    SetUpError,
    format_point,
    raise_everywhere,
    together,
    warn,
)
from ..core.target import Target


def check(u: Any, zones: Sequence[ZoneFacets]) -> None:
    """Refuse what is no half plane, has facets on the axis, or meets tools that may leave
    it. Collective."""
    _check_half_plane(u)
    meshes = [part.function_space.mesh for part in parts_of(u)]
    for zone in zones:
        _check_revolved(zone.bodies)
        _check_off_axis(meshes[zone.slave_part], zone.slave)
        for master in zone.masters:
            _check_off_axis(meshes[zone.master_part], master)


def check_tools(bodies: Sequence[Target], comm: MPI.Comm) -> None:
    """Refuse tools that have left the axis, or have turned. Collective."""
    raise_everywhere(comm, _off_axis_fault(bodies), SetUpError)


def _check_half_plane(u: Any) -> None:
    """Refuse meshes that are not 2D, or that have nodes with r < 0."""
    for mesh in (part.function_space.mesh for part in parts_of(u)):
        with together(mesh.comm):
            if mesh.geometry.dim != 2:
                raise ContactError(
                    "axisymmetric=True is for meshes in the (r, z) half plane, in 2D; "
                    f"this one is in {mesh.geometry.dim}D"
                )
            X = coordinates(mesh)
            behind = np.flatnonzero(X[:, 0] < -ON_AXIS * size_of(X))
            if len(behind):
                raise ContactError(
                    f"axisymmetric=True, but {len(behind)} node(s) have r = x[0] < 0, "
                    f"for example at {format_point(X[behind[0]], X)}: the axis is r = 0, "
                    "the mesh the half plane r >= 0"
                )


def _check_off_axis(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets on the axis, where the solid has no surface."""
    on, nodes = on_axis(mesh, facets)
    with together(mesh.comm):
        if on.any():
            middle = nodes[on][0].mean(axis=0)
            raise ContactError(
                f"{int(on.sum())} facet(s) with {facets.spoken} lie on the axis r = 0, "
                f"the first at {format_point(middle, nodes)}: in a full turn they are "
                "no surface"
            )


def _check_revolved(bodies: Sequence[Target]) -> None:
    """Refuse rigid bodies that are free to leave the axis, or to tilt.

    The tool is what the part of a section at r >= 0 makes in a full turn, which is a
    solid wherever the section crosses the axis. A circle with its centre beside the
    axis is then no ball, which is warned of.
    """
    for body in bodies:
        others = [name for name in body.freedom.names if name != "y"]
        if others:
            raise ContactError(
                f"axisymmetric=True, but the rigid {body.name} is free along "
                f"{', '.join(others)}: a solid of revolution stays one if it moves "
                'along the axis only, free = ("y",)'
            )
        radius, centre = getattr(body.shape, "radius", 0.0), abs(body.shape.place[0])
        if ON_AXIS * radius < centre < (1.0 - ON_AXIS) * radius:
            warn(
                f"axisymmetric=True, and the rigid {body.name} crosses the axis r = 0 "
                f"with its centre at r = {body.shape.place[0]:.4g}: in a full turn it is "
                "no ball. A ball has its centre at r = 0",
            )


def _off_axis_fault(bodies: Sequence[Target]) -> str | None:
    """Name a rigid body that has left or crossed the axis, or has turned."""
    for body in bodies:
        motion = body.motion()
        off, turn = _off_axis(body, motion[0]), motion[5]
        if off or turn:
            way = f"{off} by {motion[0]:.4g}" if off else f"turned by {turn:.4g}"
            return (
                f"axisymmetric=True, but the rigid {body.name} has {way}: a solid of "
                "revolution stays one if it moves along the axis only, move((0, z))"
            )
    return None


def _off_axis(body: Target, moved: float) -> str:
    """Name the fault of a motion along r, if any: beside the axis it widens a ring."""
    points = getattr(body.shape, "points", body.shape.place[None])
    radius = getattr(body.shape, "radius", 0.0)
    nearest, tolerance = points[:, 0].min() - radius, ON_AXIS * size_of(points)
    if nearest <= tolerance:
        return "left the axis" if moved else ""
    ends = radius > 0.0 or hasattr(body.shape, "points")
    return "crossed the axis" if ends and nearest + moved < -tolerance else ""
