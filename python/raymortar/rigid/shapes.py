"""Shapes of closed form: exact normals and curvature, without mesh and tags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import _cpp
from ..compat import Array
from ..errors import ContactError
from .checked import direction, positive, same_dimension, truth, vector

Vector = Sequence[float] | Array


class Shape:
    """Surface of a rigid solid. Lengths are in the mesh's unit."""

    @property
    def gdim(self) -> int | None:
        """Dimension of the problems that it is for; None: any."""
        raise NotImplementedError

    def cpp(self) -> _cpp.Tool:
        """The shape as C++ has it."""
        raise NotImplementedError

    @property
    def place(self) -> Array:
        """Default centre of rotations of a `Body`, (3,)."""
        return np.zeros(3)


@dataclass(frozen=True)
class Plane(Shape):
    """Half-space whose boundary passes through a point. For 2D see `Line`.

    Parameters
    ----------
    point
        On the boundary. Length.
    normal
        Out of the solid, of any length.
    """

    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        vector("point", self.point)
        direction("normal", self.normal)
        same_dimension("Plane", (self.point, self.normal))

    @property
    def gdim(self) -> int:
        return len(self.point)

    @property
    def place(self) -> Array:
        return vector("point", self.point)

    def cpp(self) -> _cpp.Tool:
        return _cpp.plane(self.place, direction("normal", self.normal))


@dataclass(frozen=True)
class Sphere(Shape):
    """Ball, or with ``hollow=True`` everything around it. For 2D see `Circle`.

    Parameters
    ----------
    centre, radius
        Length.
    hollow
        Whether the solid is outside of it.
    """

    centre: Vector
    radius: float
    hollow: bool = False

    def __post_init__(self) -> None:
        vector("centre", self.centre)
        positive("radius", self.radius)
        truth("hollow", self.hollow)

    @property
    def gdim(self) -> int:
        return len(self.centre)

    @property
    def place(self) -> Array:
        return vector("centre", self.centre)

    def cpp(self) -> _cpp.Tool:
        return _cpp.sphere(self.place, float(self.radius), self.hollow)


@dataclass(frozen=True)
class Cylinder(Shape):
    """Cylinder without ends.

    Parameters
    ----------
    point, axis
        A point on the axis and its direction. Length.
    radius
        Length.
    hollow
        Whether the solid is outside of it: a bore.
    """

    point: Vector
    axis: Vector
    radius: float
    hollow: bool = False

    def __post_init__(self) -> None:
        vector("point", self.point, 3)
        direction("axis", self.axis)
        positive("radius", self.radius)
        truth("hollow", self.hollow)
        same_dimension("Cylinder", (self.point, self.axis))

    @property
    def gdim(self) -> int:
        return 3

    @property
    def place(self) -> Array:
        return vector("point", self.point)

    def cpp(self) -> _cpp.Tool:
        return _cpp.cylinder(
            self.place,
            direction("axis", self.axis),
            float(self.radius),
            self.hollow,
        )


@dataclass(frozen=True)
class Cone(Shape):
    """Cone with a tip and without an end. For 2D see `Wedge`.

    Rays hit the flanks only: the flanks next to the tip press on a surface that faces
    the tip.

    Parameters
    ----------
    tip
        Length.
    axis
        From the tip into the cone.
    half_angle
        Between axis and flank, radians, between 0 and pi / 2.
    hollow
        Whether the solid is outside of it: a seat.
    """

    tip: Vector
    axis: Vector
    half_angle: float
    hollow: bool = False

    def __post_init__(self) -> None:
        vector("tip", self.tip)
        direction("axis", self.axis)
        truth("hollow", self.hollow)
        if not positive("half_angle", self.half_angle) < 0.5 * np.pi:
            raise ContactError(
                f"half_angle = {self.half_angle} must be less than pi / 2, in radians"
            )
        same_dimension(type(self).__name__, (self.tip, self.axis))

    @property
    def gdim(self) -> int:
        return len(self.tip)

    @property
    def place(self) -> Array:
        return vector("tip", self.tip)

    def cpp(self) -> _cpp.Tool:
        return _cpp.cone(
            self.place,
            direction("axis", self.axis),
            float(self.half_angle),
            self.hollow,
        )


@dataclass(frozen=True)
class Torus(Shape):
    """Tube around a circle.

    Parameters
    ----------
    centre, axis
        Of the circle. Length.
    major, minor
        Radii of the circle and of the tube, minor < major. Length.
    hollow
        Whether the solid is outside of the tube.
    """

    centre: Vector
    axis: Vector
    major: float
    minor: float
    hollow: bool = False

    def __post_init__(self) -> None:
        vector("centre", self.centre, 3)
        direction("axis", self.axis)
        truth("hollow", self.hollow)
        positive("major", self.major)
        if not positive("minor", self.minor) < self.major:
            raise ContactError(
                f"minor = {self.minor} must be less than major = {self.major}"
            )
        same_dimension("Torus", (self.centre, self.axis))

    @property
    def gdim(self) -> int:
        return 3

    @property
    def place(self) -> Array:
        return vector("centre", self.centre)

    def cpp(self) -> _cpp.Tool:
        return _cpp.torus(
            self.place,
            direction("axis", self.axis),
            float(self.major),
            float(self.minor),
            self.hollow,
        )


class Line(Plane):
    """Half-plane of 2D problems, see `Plane`."""


class Circle(Sphere):
    """Disc of 2D problems, see `Sphere`."""


class Wedge(Cone):
    """Wedge of 2D problems, see `Cone`."""
