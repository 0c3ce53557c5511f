"""Rigid bodies that prescribed motions or forces move, and their motions by step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .. import _cpp
from ..arguments import vector
from ..core.compat import Array
from ..core.errors import ContactError, is_real_number, positive
from ..core.target import Target
from .freedom import Freedom, by_name, inertia_tensor
from .shapes import Frame, Shape, Vector, follower


class Body(Target):
    """A shape that moves by prescribed translations and rotations, or by forces.

    Parameters
    ----------
    shape
        Its shape, at its place before any motion.
    centre
        Centre of rotations; None: the centre, point or tip of the shape. Length.
    name
        Name in `Contact.resultant` and in the columns of `History`; None: the name of
        the shape, such as ``"Sphere"``.
    free
        Translations ``"x"``, ``"y"``, ``"z"`` and rotations ``"rx"``, ``"ry"``,
        ``"rz"`` about axes through the centre, in 2D ``"x"``, ``"y"``, ``"r"``, that
        follow from forces. `move` prescribes the others.
    force, moment
        Force on the body, and moment about its centre, which in 2D is a number. Their
        directions are fixed in space. In 2D both are per thickness. Set these
        attributes between steps to change the loads.
    stiffness, damping
        Springs and dampers at the centre, by the names in `free`. A stiffness is a
        force per length or a moment per radian; a damping is that times time. A number
        stands for all free translations. Springs pull to the place where the body was
        made. Dampers resist the motion of a step over `Contact.dt`.
    mass
        Mass of a body that time steps move. In 2D per thickness, as its inertia.
    inertia
        Moment of inertia about the axis of its one free rotation. Of a body in space
        that is free to turn about all axes the tensor about its centre before any
        motion: (3, 3), three moments about x, y and z, or one number for a ball or a
        cube. Mass times length squared.

    Attributes
    ----------
    shape, name, force, moment
        As they were given.
    masses
        Mass, or moment of inertia, of each unknown, (n,); 0 where `inertia` is a tensor.
    inertia
        Tensor of a body that may turn about all axes, (3, 3); None for others.
    springs
        Stiffness of each unknown, (n,).
    centre
        Before any motion, (3,), 2D padded with 0.
    freedom
        Unknowns of a free body.
    cpp
        Position, unknowns and loads in C++.

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
        mass: float | None = None,
        inertia: float | Array | Sequence[Any] | None = None,
    ) -> None:
        if not isinstance(shape, Shape):
            raise ContactError(f"shape must be one of rigid, not {shape!r}")
        if name is not None and not isinstance(name, str):
            raise ContactError(f"name must be a string, not {name!r}")
        self.name = type(shape).__name__ if name is None else name
        self.is_named = name is not None
        self.shape, self.has_surface = shape, not isinstance(shape, Frame)
        gdim = shape.gdim
        self.centre: Array = (
            shape.place if centre is None else vector("centre", centre, gdim)
        )
        self.freedom = Freedom(free, gdim, stiffness, damping, self.centre)
        self.springs: Array = self.freedom.stiffness
        self.inertia: Array | None = None
        if inertia is not None and self.freedom.turns_freely:
            self.inertia, inertia = inertia_tensor(inertia), None
        self.masses = self._masses(mass, inertia)
        self.cpp = self.freedom.cpp
        self.force = force  # type: ignore[assignment]
        self.moment = moment  # type: ignore[assignment]

    @property
    def force(self) -> Array:
        return _read_only(self.cpp.force[: self.shape.gdim])

    @force.setter
    def force(self, value: Vector | None) -> None:
        force = _shift("force", value, self.shape.gdim)
        self._refuse_held("force", force, turns=False)
        self.cpp.force = force

    @property
    def moment(self) -> float | Array:
        if self.shape.gdim == 2:
            return float(self.cpp.moment[2])
        return _read_only(self.cpp.moment)

    @moment.setter
    def moment(self, value: float | Vector | None) -> None:
        moment = _turn("moment", value, self.shape.gdim)
        self._refuse_held("moment", moment, turns=True)
        self.cpp.moment = moment

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the motions that follow from forces; they never change."""
        return self.freedom.names

    @property
    def stiffness(self) -> dict[str, float]:
        """Stiffness of the springs by name; it never changes."""
        return dict(zip(self.freedom.names, self.springs.tolist()))

    @property
    def velocity(self) -> dict[str, float]:
        """Velocity of a body with mass by the names in `free`: lengths, or radians, per
        time. Set it before time steps begin."""
        return dict(zip(self.freedom.names, self.freedom.velocity.tolist()))

    @velocity.setter
    def velocity(self, value: Mapping[str, float]) -> None:
        self.freedom.velocity = by_name("velocity", value, self.freedom.names)

    def _masses(self, mass: float | None, inertia: Any) -> Array:
        """Check mass and moment of inertia, and place them at the unknowns."""
        turns, given = self.freedom.is_turn, []
        for name, value in (("mass", mass), ("inertia", inertia)):
            given.append(0.0 if value is None else positive(name, value))
        if inertia is not None and np.count_nonzero(turns) != 1:
            raise ContactError(
                "inertia is about the axis of one free rotation, or about all three, and "
                f"the {self.name} has free = {self.freedom.names}"
            )
        has_inertia = inertia is not None or self.inertia is not None
        if mass is not None and not np.any(~turns) and not has_inertia:
            raise ContactError(f"mass needs a free translation of the {self.name}")
        return np.where(turns, given[1], given[0])

    def pushed(self) -> tuple[Array, Array]:
        """Forces along its unknowns other than contact, (n,), and minus their
        derivative, (n, n). Force, and force per length."""
        return self.cpp.forces()

    def _refuse_held(self, what: str, value: Array, turns: bool) -> None:
        """Raise for a component of a load along which the body cannot move."""
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
        """Translation of the centre since the body was made, (3,). Length."""
        return self.cpp.moved + self.cpp.translation()

    @property
    def rotation(self) -> Array:
        """Rotation since the body was made, (3,): a vector along the axis whose length
        is the angle in radians. Free rotations about one axis add up over all steps."""
        return self.freedom.rotation(self.cpp.turned)

    @cached_property
    def tool(self) -> _cpp.Tool:
        """The shape as C++ has it."""
        return self.shape.cpp()

    @cached_property
    def follower(self) -> _cpp.Tool:
        """The tool that stands for it where surfaces are tied, as C++ has it."""
        return follower()

    def move(
        self, translation: Vector | None = None, rotation: float | Vector | None = None
    ) -> None:
        """Set the position relative to the place where the body was made.

        It takes effect with the next `Contact.update`, as prescribed displacements do.
        With `LoadSteps`, call it in ``apply(t)``. Friction follows the motion since the
        last accepted step. Call it with the same values on all ranks.

        Parameters
        ----------
        translation
            Translation of the centre; None: no translation. Length.
        rotation
            Rotation about the centre: in 2D an angle in radians, counter-clockwise; in
            3D a vector along the axis whose length is the angle, of any size. None: no
            rotation. Free rotations are added to it.

        Raises
        ------
        ContactError
            If the values are not finite, have not the shape's dimension, or are not 0
            along a free motion.
        """
        moved = _shift("translation", translation, self.shape.gdim)
        turned = _turn("rotation", rotation, self.shape.gdim)
        freedom = self.freedom
        parts = np.where(freedom.is_turn, turned[freedom.axis], moved[freedom.axis])
        for name in np.array(freedom.names)[parts != 0.0]:
            raise ContactError(
                f"move prescribes {name} of the {self.name}, which is free"
            )
        self.cpp.moved, self.cpp.turned = moved, turned

    def motion(self) -> Array:
        """Everything that determines the position, (15,): the translation with its free
        part, the prescribed rotation, and the free rotation."""
        return self.cpp.motion()

    def pose_of(self, motion: Array) -> tuple[Array, Array]:
        """Rotation R (3, 3) and shift b (3,) of its points after a motion:
        x = R X + b."""
        return self.cpp.pose_of(motion)

    @property
    def place(self) -> Array:
        """Present place of the centre, (3,)."""
        return self.centre + self.translation

    def __repr__(self) -> str:
        free = f", free={self.free}" if self.free else ""
        return f"Body({self.shape!r}, name={self.name!r}{free})"


def _read_only(values: Array) -> Array:
    """Make a read-only copy, as writing to it would change nothing."""
    copy = values.copy()
    copy.flags.writeable = False
    return copy


def _shift(name: str, value: Any, gdim: int | None) -> Array:
    """A translation or a force as a vector, (3,)."""
    return np.zeros(3) if value is None else vector(name, value, gdim)


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


def as_body(master: Any) -> Any:
    """The body of a pair's master; what is no shape stays what it is."""
    return Body(master) if isinstance(master, Shape) else master
