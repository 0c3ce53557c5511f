"""Rigid shapes in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from .. import _cpp
from ..arguments import direction, vector
from ..core.compat import Array
from ..core.errors import ContactError, positive, truth

Vector = Sequence[float] | Array

# Checks of the fields of closed forms; places are in `_ClosedForm`
_CHECKS: dict[str, Callable[[str, Any], Any]] = {
    "normal": direction,
    "axis": direction,
    "radius": positive,
    "half_angle": positive,
    "major": positive,
    "minor": positive,
    "hollow": truth,
}
# Shapes of 2D problems, and what they are called in 3D
_OF_THE_PLANE = {"Line": "Plane", "Circle": "Sphere", "Wedge": "Cone"}


class Shape:
    """Surface of a rigid solid. Lengths are in the mesh's unit."""

    # Whether every place is in the solid or outside
    has_inside: ClassVar[bool] = True

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


class _ClosedForm(Shape):
    """Shape whose fields, a place and then others, are the arguments of C++."""

    _make: ClassVar[Callable[..., _cpp.Tool]]
    _only_gdim: ClassVar[int | None] = None

    def __post_init__(self) -> None:
        given = self._arguments()
        name = type(self).__name__
        if name in _OF_THE_PLANE and self.gdim != 2:
            first = fields(self)[0].name
            raise ContactError(
                f"{first} = {getattr(self, first)!r} of a {name} must be 2 numbers: it is "
                f"for problems in 2D, {_OF_THE_PLANE[name]} for those in 3D"
            )
        sizes = {
            len(getattr(self, f.name))
            for f, value in zip(fields(self), given)
            if isinstance(value, np.ndarray)
        }
        if len(sizes) > 1:
            raise ContactError(f"{name} has vectors of different lengths")

    def _arguments(self) -> list[Any]:
        """Check the fields, and convert them for C++."""
        (first, *others) = ((f.name, getattr(self, f.name)) for f in fields(self))
        found = [_CHECKS[name](name, value) for name, value in others]
        return [vector(*first, self._only_gdim), *found]

    @property
    def gdim(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    @property
    def place(self) -> Array:
        name = fields(self)[0].name
        return vector(name, getattr(self, name))

    def cpp(self) -> _cpp.Tool:
        return type(self)._make(*self._arguments())


def follower() -> _cpp.Tool:
    """Tool that every ray enters where it begins: what is tied to a body follows it,
    whatever the body's shape."""

    def cast(x: Array, n: Array) -> tuple[Any, Array, Array, Array]:
        hits = np.ones(len(x), dtype=np.int8)
        return hits, np.zeros(len(x)), -n, np.zeros((len(x), 3, 3))

    return _cpp.called_tool(cast=cast, distance=lambda x: 0.0)


@dataclass(frozen=True)
class Frame(Shape):
    """A point and axes without a surface: the shape of hubs, bolts and levers.

    Surfaces follow it by a `Tie`; nothing touches it.

    Parameters
    ----------
    point
        Centre of rotations and moments: 2 numbers, or 3. Length.
    """

    point: Vector

    def __post_init__(self) -> None:
        vector("point", self.point, None)

    @property
    def gdim(self) -> int:
        return len(self.point)

    @property
    def place(self) -> Array:
        return vector("point", self.point)

    def cpp(self) -> _cpp.Tool:
        return follower()


@dataclass(frozen=True)
class Plane(_ClosedForm):
    """Half-space whose boundary passes through a point. For 2D see `Line`.

    Parameters
    ----------
    point
        On the boundary. Length.
    normal
        Out of the solid, of any length.
    """

    _make = staticmethod(_cpp.plane)
    point: Vector
    normal: Vector


@dataclass(frozen=True)
class Sphere(_ClosedForm):
    """Ball, or with ``hollow=True`` everything around it. For 2D see `Circle`.

    Parameters
    ----------
    centre, radius
        Length.
    hollow
        Whether the solid is outside of it.
    """

    _make = staticmethod(_cpp.sphere)
    centre: Vector
    radius: float
    hollow: bool = False


@dataclass(frozen=True)
class Cylinder(_ClosedForm):
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

    _make, _only_gdim = staticmethod(_cpp.cylinder), 3
    point: Vector
    axis: Vector
    radius: float
    hollow: bool = False


@dataclass(frozen=True)
class Cone(_ClosedForm):
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

    _make = staticmethod(_cpp.cone)
    tip: Vector
    axis: Vector
    half_angle: float
    hollow: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.half_angle < 0.5 * np.pi:
            raise ContactError(
                f"half_angle = {self.half_angle} must be less than pi / 2, in radians"
            )


@dataclass(frozen=True)
class Torus(_ClosedForm):
    """Tube around a circle.

    Parameters
    ----------
    centre, axis
        Centre of the circle, length, and direction of its axis.
    major, minor
        Radii of the circle and of the tube, minor < major. Length.
    hollow
        Whether the solid is outside of the tube.
    """

    centre: Vector
    axis: Vector
    _make, _only_gdim = staticmethod(_cpp.torus), 3
    major: float
    minor: float
    hollow: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.minor < self.major:
            raise ContactError(
                f"minor = {self.minor} must be less than major = {self.major}"
            )


class Line(Plane):
    """Half-plane of 2D problems, see `Plane`."""


class Circle(Sphere):
    """Disc of 2D problems, see `Sphere`."""


class Wedge(Cone):
    """Wedge of 2D problems, see `Cone`."""
