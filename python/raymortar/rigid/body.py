"""Rigid bodies: shapes that are moved, or free to move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .. import _cpp
from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError
from .checked import vector
from .freedom import Freedom, freedoms_of
from .shapes import Shape, Vector
from .turning import rotation_matrix


class Body:
    """A shape that is moved by prescribed translations and rotations, or by forces.

    Parameters
    ----------
    shape
        What it looks like, where it is before it moves.
    centre
        What it turns about; None: the shape's own centre, point or tip. Length.
    name
        Of its pairs, as in `Contact.resultant` and the columns of `History`; None: that
        of the shape, such as ``"Sphere"``.
    free
        Translations ``"x"``, ``"y"``, ``"z"`` and rotations ``"rx"``, ``"ry"``, ``"rz"``
        about axes through the centre, in 2D ``"x"``, ``"y"``, ``"r"``, which forces
        decide; `move` prescribes the others.
    force, moment
        On the body, the moment about its centre, in 2D a number; fixed directions in
        space. In 2D per thickness. Set these attributes anew between steps, as loads.
    stiffness, damping
        Of springs and dampers at the centre, by the names in `free`: force per length
        and moment per radian, times time. A number: of all translations that are free.
        Springs pull to where the body was made; dampers resist the motion of a step,
        over `Contact.dt`.

    Attributes
    ----------
    shape, name, force, moment
        As they were given.
    centre
        Before any motion, (3,), 2D padded with 0.
    freedom
        Unknowns of a free body.

    Raises
    ------
    ContactError
        For input that cannot work, such as a force along an axis that is not free.
    """

    def __init__(
        self,
        shape: Shape,
        centre: Vector | None = None,
        name: str | None = None,
        *,
        free: Sequence[str] = (),
        force: Vector | None = None,
        moment: float | Vector | None = None,
        stiffness: float | Mapping[str, float] | None = None,
        damping: float | Mapping[str, float] | None = None,
    ) -> None:
        if not isinstance(shape, Shape):
            raise ContactError(f"shape must be one of rigid, not {shape!r}")
        if name is not None and not isinstance(name, str):
            raise ContactError(f"name must be a string, not {name!r}")
        self.name = type(shape).__name__ if name is None else name
        self.shape = shape
        gdim = shape.gdim
        self.centre: Array = (
            shape.place if centre is None else vector("centre", centre, gdim)
        )
        self.freedom = Freedom(freedoms_of(free, gdim), gdim, stiffness, damping)
        self._moved, self._turned = np.zeros(3), np.zeros(3)
        self.force = force  # type: ignore[assignment]
        self.moment = moment  # type: ignore[assignment]

    @property
    def is_free(self) -> bool:
        """Whether forces decide any of its motions."""
        return len(self.freedom) > 0

    @property
    def force(self) -> Array:
        return _read_only(self._force[: self.shape.gdim])

    @force.setter
    def force(self, value: Vector | None) -> None:
        zero = np.zeros(3)
        self._force = zero if value is None else vector("force", value, self.shape.gdim)
        self._refuse_held("force", self._force, turns=False)

    @property
    def moment(self) -> float | Array:
        if self.shape.gdim == 2:
            return float(self._moment[2])
        return _read_only(self._moment)

    @moment.setter
    def moment(self, value: float | Vector | None) -> None:
        self._moment = _turn("moment", value, self.shape.gdim)
        self._refuse_held("moment", self._moment, turns=True)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the motions that forces decide. They are given when it is made."""
        return self.freedom.names

    @property
    def stiffness(self) -> dict[str, float]:
        """Of the springs by name. They are given when it is made."""
        return dict(zip(self.freedom.names, self.freedom.stiffness.tolist()))

    def pushed(self) -> tuple[Array, Array]:
        """What pushes along its unknowns besides contact, (n,), and minus the
        derivative, (n, n). Forces, and forces per length."""
        return self.freedom.forces(self._force, self._moment)

    def _refuse_held(self, what: str, value: Array, turns: bool) -> None:
        """Raise for a part that works on nothing."""
        freedom = self.freedom
        held = np.delete(np.arange(3), freedom.axis[freedom.is_turn == turns])
        for axis in held[value[held] != 0.0]:
            kind = "about" if turns else "along"
            raise ContactError(
                f"{what} has a part {kind} {'xyz'[axis]}, and the {self.name} is not "
                f"free there: free = {freedom.names}"
            )

    @property
    def translation(self) -> Array:
        """Of the centre since it was made, (3,). Length."""
        return self._moved + self.freedom.translation

    @property
    def rotation(self) -> Array:
        """Since it was made, (3,): a vector along the axis whose length is the angle in
        radians. Of free turns about one axis the sum of all steps."""
        return self.freedom.rotation(self._turned)

    @cached_property
    def tool(self) -> _cpp.Tool:
        """The shape as C++ has it."""
        return self.shape.cpp()

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
            Turns that are free come on top of it.

        Raises
        ------
        ContactError
            If they are no finite vectors of the shape's dimension, or prescribe what is
            free.
        """
        gdim = self.shape.gdim
        moved = np.zeros(3)
        if translation is not None:
            moved = vector("translation", translation, gdim)
        turned = _turn("rotation", rotation, gdim)
        self._refuse_free(moved, turned)
        self._moved, self._turned = moved, turned

    def _refuse_free(self, moved: Array, turned: Array) -> None:
        """Raise where a motion prescribes what forces decide."""
        freedom = self.freedom
        parts = np.where(freedom.is_turn, turned[freedom.axis], moved[freedom.axis])
        for name in np.array(freedom.names)[parts != 0.0]:
            raise ContactError(
                f"move prescribes {name} of the {self.name}, which is free"
            )

    def motion(self) -> Array:
        """All that says where it is: prescribed translation and rotation, and the turn
        that is free, (15,). The translation has its free part."""
        parts = [self.translation, self._turned, self.freedom.turn.ravel()]
        return np.concatenate(parts)

    def pose_of(self, motion: Array) -> tuple[Array, Array]:
        """Rotation R (3, 3) and shift b (3,) of its points after a motion:
        x = R X + b."""
        R = motion[6:].reshape(3, 3) @ rotation_matrix(motion[3:6])
        return R, self.centre + motion[:3] - R @ self.centre

    @property
    def place(self) -> Array:
        """Where its centre is, (3,)."""
        return self.centre + self.translation

    def __repr__(self) -> str:
        free = f", free={self.free}" if self.free else ""
        return f"Body({self.shape!r}, name={self.name!r}{free})"


def _read_only(values: Array) -> Array:
    """A copy that refuses to be written, which would change nothing."""
    copy = values.copy()
    copy.flags.writeable = False
    return copy


def _turn(name: str, rotation: Any, gdim: int | None) -> Array:
    """A rotation or a moment as a vector, (3,)."""
    if rotation is None:
        return np.zeros(3)
    if is_real_number(rotation):
        if gdim == 3:
            raise ContactError(
                f"{name} = {rotation!r} must be a vector along the axis in 3D"
            )
        if not np.isfinite(rotation):
            raise ContactError(f"{name} = {rotation!r} must be finite")
        return np.array([0.0, 0.0, float(rotation)])
    if gdim == 2:
        raise ContactError(f"{name} = {rotation!r} must be a number in 2D")
    return vector(name, rotation, 3)


def as_body(master: Any) -> Body | None:
    """The body that a pair's master is, if it is one."""
    if isinstance(master, Body):
        return master
    return Body(master) if isinstance(master, Shape) else None
