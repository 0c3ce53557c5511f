"""Motion of a free body: its unknowns, and the forces on it other than contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _cpp
from ..core.compat import Array, Mask
from ..core.errors import ContactError, is_real_number
from .turning import rotation_matrix, rotation_vector

# Axis of each freedom, and whether it is a rotation
SPACE = {
    "x": (0, False),
    "y": (1, False),
    "z": (2, False),
    "rx": (0, True),
    "ry": (1, True),
    "rz": (2, True),
}
PLANE = {"x": (0, False), "y": (1, False), "r": (2, True)}


def _freedoms(free: Any, gdim: int | None) -> dict[str, tuple[int, bool]]:
    """Axis of each free motion, and whether it is a rotation, by name."""
    if isinstance(free, str) or not isinstance(free, Sequence):
        raise ContactError(f'free = {free!r} must be names in a tuple, as in ("z",)')
    plane = gdim == 2 or (gdim is None and "r" in free)
    known = PLANE if plane else SPACE
    for name in free:
        if not (isinstance(name, str) and name in known):
            raise ContactError(
                f"free has {name!r}: in {2 if plane else 3}D a body is free along "
                f"{', '.join(known)}"
            )
    twice = [name for name in known if list(free).count(name) > 1]
    if twice:
        raise ContactError(f"free = {tuple(free)} has {twice[0]!r} more than once")
    return {name: known[name] for name in known if name in free}


class Freedom:
    """Unknowns of a free body; `_cpp.RigidBody` has their values and kinematics.

    Attributes
    ----------
    names
        Names of the unknowns, in their order.
    axis, is_turn
        Axis of each unknown, and whether it is a rotation, (n,).
    velocity, acceleration, static
        Of a body with mass at the accepted time step, and the forces on it without
        inertia, (n,).
    moments
        Of a body with inertia that turns about all axes: rate of the moment of its
        momentum, and the moment on it without inertia, (2, 3).
    spins
        Whether inertia resists its rotations, in a time step.
    """

    def __init__(
        self,
        free: Any,
        gdim: int | None,
        stiffness: Any,
        damping: Any,
        centre: Array,
    ) -> None:
        found = _freedoms(free, gdim)
        self.names = names = tuple(found)
        self.axis = np.array([axis for axis, _ in found.values()], dtype=np.int32)
        self.is_turn = np.array([turns for _, turns in found.values()], dtype=bool)
        self.stiffness = _resistance("stiffness", stiffness, names, self.is_turn)
        self.damping = _resistance("damping", damping, names, self.is_turn)
        of_unknowns = self.axis, self.is_turn, self.stiffness, self.damping
        self.cpp = _cpp.RigidBody(centre, *(one.tolist() for one in of_unknowns))
        self._lever: float | None = None
        self.velocity, self.acceleration, self.static = np.zeros((3, len(names)))
        self.moments, self.spins = np.zeros((2, 3)), False
        # Whether a time step's inertia acts: then a flight is motion in that step
        self.has_inertia = False

    def __len__(self) -> int:
        return len(self.names)

    @property
    def turns_freely(self) -> bool:
        """Whether it may turn about all axes of space."""
        return int(np.count_nonzero(self.is_turn)) == 3

    @property
    def is_resisted(self) -> Mask:
        """Whether a spring, a damper or inertia resists each unknown, (n,)."""
        resisted = (self.stiffness > 0.0) | (self.damping > 0.0)
        return resisted | (self.is_turn & self.spins)

    def spring_forces(self) -> float:
        """Norm of what springs do to the rows of the unknowns. Force."""
        unit = np.where(self.is_turn, self.lever or 1.0, 1.0)
        return float(np.linalg.norm(self.stiffness * self.totals / unit))

    @property
    def values(self) -> Array:
        """Translations and rotations theta, (n,). Lengths and radians."""
        return self.cpp.values

    @values.setter
    def values(self, values: Array) -> None:
        self.cpp.values = values

    @property
    def lever(self) -> float | None:
        """Length that stands for a radian; None until a `Contact` has set it."""
        return self._lever

    @lever.setter
    def lever(self, value: float) -> None:
        self._lever = self.cpp.lever = value

    @property
    def totals(self) -> Array:
        """Translations, and the sums of rotations over all steps, (n,)."""
        return np.where(self.is_turn, self.cpp.accepted, 0.0) + self.values

    def rotation(self, prescribed: Array) -> Array:
        """Rotation vector of the body, (3,); rotations about one axis add up."""
        sums = np.zeros(3)
        axes = self.axis[self.is_turn]
        sums[axes] = self.totals[self.is_turn]
        if len(axes) == 0 or (
            len(axes) == 1 and not np.any(np.delete(prescribed, axes))
        ):
            return prescribed + sums
        return rotation_vector(self.cpp.turn() @ rotation_matrix(prescribed))

    def settle_turn(self) -> None:
        """Take the present rotation as that of the accepted step."""
        cpp = self.cpp
        cpp.accepted_turn = cpp.turn()
        cpp.accepted = np.where(self.is_turn, self.totals, cpp.accepted)
        cpp.values = np.where(self.is_turn, 0.0, cpp.values)

    def state(self) -> Array:
        """All values that `restore` needs, (5 n + 9,), and 6 more of a body that turns
        about all axes."""
        cpp = self.cpp
        place = cpp.values, cpp.accepted, cpp.accepted_turn.ravel()
        moments = self.moments.ravel() if self.turns_freely else np.empty(0)
        motion = self.velocity, self.acceleration, self.static, moments
        return np.concatenate([*place, *motion])

    def restore(self, state: Array) -> None:
        """Go back to a `state`."""
        n, cpp = len(self), self.cpp
        *place, motion, moments = np.split(state, [n, 2 * n, 2 * n + 9, 5 * n + 9])
        cpp.values, cpp.accepted, cpp.accepted_turn = place
        self.velocity, self.acceleration, self.static = motion.reshape(3, n).copy()
        if self.turns_freely:
            self.moments = moments.reshape(2, 3).copy()

    def totals_of(self, state: Array) -> Array:
        """`totals` of a state."""
        n = len(self)
        return np.where(self.is_turn, state[n : 2 * n], 0.0) + state[:n]

    def rates(self) -> tuple[Array, Array, Array]:
        """Derivatives of points by the unknowns: drift (n, 3), spin (n, 3, 3) and
        second derivatives (n, n, 3, 3)."""
        return self.cpp.rates()


def _resistance(what: str, given: Any, names: tuple[str, ...], is_turn: Array) -> Array:
    """Stiffness or damping of each unknown, (n,)."""
    if given is None:
        return np.zeros(len(names))
    if is_real_number(given):
        given = {name: given for name, turns in zip(names, is_turn) if not turns}
    found = by_name(what, given, names)
    for name, value in zip(names, found.tolist()):
        if value < 0.0:
            raise ContactError(f"{what} of {name} = {value!r} must not be negative")
    return found


def by_name(what: str, given: Any, names: tuple[str, ...]) -> Array:
    """Numbers by the names of unknowns, 0 where there is none, (n,)."""
    table = given if isinstance(given, Mapping) else {}
    others = [f": {name!r} is not in free" for name in table if name not in names]
    finite = all(is_real_number(one) and np.isfinite(one) for one in table.values())
    if table is not given or others or not finite:
        raise ContactError(
            f"{what} must be numbers by the names in free = {names}, finite ones, not "
            f"{given!r}{''.join(others[:1])}"
        )
    return np.array([float(table.get(name, 0.0)) for name in names])


# Share of the largest moment by which a tensor may miss what it must be
ROUNDING = 1e-9


def inertia_tensor(given: Any) -> Array:
    """Inertia tensor (3, 3) from a number, three moments or a tensor."""
    fault = f"inertia = {given!r} must be a number, three moments or a tensor (3, 3)"
    if is_real_number(given):
        given = [float(given)] * 3
    try:
        tensor = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ContactError(fault) from None
    if tensor.shape == (3,):
        tensor = np.diag(tensor)
    if tensor.shape != (3, 3) or not np.all(np.isfinite(tensor)):
        raise ContactError(fault)
    most = float(np.abs(tensor).max())
    if np.abs(tensor - tensor.T).max() > ROUNDING * most:
        raise ContactError(f"inertia = {given!r} must be symmetric")
    a, b, c = np.linalg.eigvalsh(tensor)
    if a <= 0.0 or c > (a + b) * (1.0 + ROUNDING):
        raise ContactError(
            f"no body has the principal moments of inertia {a:.6g}, {b:.6g}, {c:.6g}: "
            "each is above 0, and none above the sum of the others"
        )
    return 0.5 * (tensor + tensor.T)
