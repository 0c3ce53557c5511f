"""Rigid bodies: shapes that are moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError
from .checked import vector
from .shapes import Shape, Vector


def rotation_matrix(rotation: Array) -> Array:
    """Turn about the direction of a vector by its length in radians, (3, 3).

    Rodrigues' formula.
    """
    angle = float(np.linalg.norm(rotation))
    if angle == 0.0:
        return np.eye(3)
    a, b, c = rotation / angle
    cross = np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


class Body:
    """A shape that is moved by prescribed translations and rotations.

    Parameters
    ----------
    shape
        What it looks like, where it is before it moves.
    centre
        What it turns about; None: the shape's own centre, point or tip. Length.
    name
        Of its pairs, as in `Contact.resultant` and the columns of `History`; None: that
        of the shape, such as ``"Sphere"``.

    Attributes
    ----------
    shape, name
        As they were given.
    centre
        Before any motion, (3,), 2D padded with 0.
    translation, rotation
        Since it was made, (3,) each: a length, and a vector along the axis of rotation
        whose length is the angle in radians.
    """

    def __init__(
        self, shape: Shape, centre: Vector | None = None, name: str | None = None
    ) -> None:
        if not isinstance(shape, Shape):
            raise ContactError(f"shape must be one of rigid, not {shape!r}")
        if name is not None and not isinstance(name, str):
            raise ContactError(f"name must be a string, not {name!r}")
        self.name = type(shape).__name__ if name is None else name
        self.shape = shape
        self.centre = (
            shape.place if centre is None else vector("centre", centre, shape.gdim)
        )
        self.translation, self.rotation = np.zeros(3), np.zeros(3)

    def move(
        self, translation: Vector | None = None, rotation: float | Vector | None = None
    ) -> None:
        """Take the body to where it is to be, counted from where it was made.

        It takes effect with the next `Contact.update`, as prescribed displacements do;
        in `LoadSteps` call it in ``apply(t)``. Friction sees the motion since the last
        accepted step. Call it on all ranks alike.

        Parameters
        ----------
        translation
            Of the centre; None: none. Length.
        rotation
            About the centre: in 2D an angle in radians, counter-clockwise; in 3D a
            vector along the axis whose length is the angle, of any size. None: none.

        Raises
        ------
        ContactError
            If they are no finite vectors of the shape's dimension.
        """
        gdim = self.shape.gdim
        moved = np.zeros(3)
        if translation is not None:
            moved = vector("translation", translation, gdim)
        self.rotation = _rotation(rotation, gdim)
        self.translation = moved

    def motion(self) -> tuple[Array, Array]:
        """Translation and rotation, (3,) each."""
        return self.translation.copy(), self.rotation.copy()

    def pose_of(self, translation: Array, rotation: Array) -> tuple[Array, Array]:
        """Rotation R (3, 3) and shift b (3,) of its points after a motion:
        x = R X + b."""
        R = rotation_matrix(rotation)
        return R, self.centre + translation - R @ self.centre

    def __repr__(self) -> str:
        return f"Body({self.shape!r})"


def _rotation(rotation: Any, gdim: int | None) -> Array:
    """As a vector, (3,)."""
    if rotation is None:
        return np.zeros(3)
    if is_real_number(rotation):
        if gdim == 3:
            raise ContactError(
                f"rotation = {rotation!r} must be a vector along the axis in 3D"
            )
        if not np.isfinite(rotation):
            raise ContactError(f"rotation = {rotation!r} must be finite")
        return np.array([0.0, 0.0, float(rotation)])
    if gdim == 2:
        raise ContactError(f"rotation = {rotation!r} must be an angle in 2D")
    return vector("rotation", rotation, 3)


def as_body(master: Any) -> Body | None:
    """The body that a pair's master is, if it is one."""
    if isinstance(master, Body):
        return master
    return Body(master) if isinstance(master, Shape) else None
