"""Solids of revolution: coordinates (r, z) of a half plane, about the axis r = 0."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx.mesh import Mesh

from ..compat import Array
from ..errors import ContactError, ContactWarning, together
from ..rigid.body import Body
from .facets import Facets, coordinates, format_point, node_table
from .joined import parts_of

# A radius below this share of the mesh's size counts as zero
_ON_AXIS = 1e-12
# A force below this share of the stiffness is rounding error, if all radii grow by one
_NO_HOOPS = 1e6 * float(np.finfo(float).eps)


def weight(mesh: Mesh) -> Any:
    """2 pi r of the undeformed mesh, for UFL forms. Length."""
    return 2.0 * np.pi * ufl.SpatialCoordinate(mesh)[0]


def check_half_plane(u: Any) -> None:
    """Refuse meshes that are not 2D, or that have nodes with r < 0. Collective."""
    for mesh in (part.function_space.mesh for part in parts_of(u)):
        with together(mesh.comm):
            if mesh.geometry.dim != 2:
                raise ContactError(
                    "axisymmetric=True is for meshes in the (r, z) half plane, in 2D; "
                    f"this one is in {mesh.geometry.dim}D"
                )
            X = coordinates(mesh)
            behind = np.flatnonzero(X[:, 0] < -_ON_AXIS * _size(X))
            if len(behind):
                raise ContactError(
                    f"axisymmetric=True, but {len(behind)} node(s) have r = x[0] < 0, "
                    f"for example at {format_point(X[behind[0]])}: the axis is r = 0, "
                    "the mesh the half plane r >= 0"
                )


def _size(X: Array) -> float:
    """Largest magnitude of a coordinate on this rank."""
    return float(np.abs(X).max(initial=0.0))


def check_off_axis(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets on the axis, where the solid has no surface. Collective."""
    X = coordinates(mesh)
    nodes = X[node_table(mesh, facets)]
    on = (nodes[:, :, 0] <= _ON_AXIS * _size(X)).all(axis=1)
    with together(mesh.comm):
        if on.any():
            middle = nodes[on][0].mean(axis=0)
            raise ContactError(
                f"{int(on.sum())} facet(s) with tag {facets.tag} lie on the axis r = 0, "
                f"the first at {format_point(middle)}: in a full turn they are no surface"
            )


def check_revolved(bodies: Sequence[Body]) -> None:
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
        if _ON_AXIS * radius < centre < (1.0 - _ON_AXIS) * radius:
            warnings.warn(
                f"axisymmetric=True, and the rigid {body.name} crosses the axis r = 0 "
                f"with its centre at r = {body.shape.place[0]:.4g}: in a full turn it is "
                "no ball, but a solid with a tip or a dimple on the axis. A ball has "
                "its centre at r = 0",
                ContactWarning,
                stacklevel=2,
            )


def off_axis_fault(bodies: Sequence[Body]) -> str | None:
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


def _off_axis(body: Body, moved: float) -> str:
    """Name the fault of a motion along r, if any: beside the axis it widens a ring."""
    points = getattr(body.shape, "points", body.shape.place[None])
    radius = getattr(body.shape, "radius", 0.0)
    nearest, tolerance = points[:, 0].min() - radius, _ON_AXIS * _size(points)
    if nearest <= tolerance:
        return "left the axis" if moved else ""
    ends = radius > 0.0 or hasattr(body.shape, "points")
    return "crossed the axis" if ends and nearest + moved < -tolerance else ""


def warn_of_plane_form(forces: Array, diagonal: Array, comm: Any) -> None:
    """Warn if the form does not resist a growth of the radius, as hoops do. Collective.

    The forces are those when all radii grow by 1, the diagonal that of the stiffness,
    both at this rank's dofs.
    """
    sums = np.array([forces @ forces, diagonal @ diagonal])
    hoops, stiffness = np.sqrt(comm.allreduce(sums))
    if stiffness > 0.0 and hoops <= _NO_HOOPS * stiffness:
        warnings.warn(
            "axisymmetric=True, but the form resists no growth of the radius: it needs "
            "the hoop strain u_r / r and the weight 2 pi r in all of its integrals",
            ContactWarning,
            stacklevel=2,
        )
