"""Motion of a free body: its unknowns, and the forces on it other than contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError
from .turning import axial, rotation_matrix, rotation_vector, turning

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


def freedoms_of(free: Any, gdim: int | None) -> tuple[str, ...]:
    """Names of free motions, in their order.

    Raises
    ------
    ContactError
        For an unknown name, one of the other dimension, or one that is there twice.
    """
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
    return tuple(name for name in known if name in free)


class Freedom:
    """Unknowns of a free body.

    Translations are relative to the place where the body was made. Rotations are the
    components of a rotation vector theta about the centre, relative to the last
    accepted step: R = exp(theta) Q P, with the free rotation Q of all accepted steps
    and the prescribed rotation P. In the coupled system a rotation is a length, theta
    times `lever`, and its equation is a force.

    Parameters
    ----------
    names
        Names from `freedoms_of`.
    gdim
        Dimension of the shape; None: any.
    stiffness, damping
        Springs and dampers, see `Body`.

    Attributes
    ----------
    names
        Names of the unknowns, in their order.
    values
        Translations and turns theta, (n,). Lengths and radians.
    lever
        Length that stands for a radian; None until a `Contact` has set it.
    dt
        Time of the present step, for dampers.
    """

    def __init__(
        self, names: tuple[str, ...], gdim: int | None, stiffness: Any, damping: Any
    ) -> None:
        known = PLANE if gdim == 2 or "r" in names else SPACE
        found = [known[name] for name in names]
        self.names = names
        self.axis = np.array([axis for axis, _ in found], dtype=np.int32)
        self.is_turn = np.array([turns for _, turns in found], dtype=bool)
        self._turns = any(turns for _, turns in found)
        self.stiffness = _by_name("stiffness", stiffness, names, self.is_turn)
        self.damping = _by_name("damping", damping, names, self.is_turn)
        self.values = np.zeros(len(names))
        self.lever: float | None = None
        self.dt = 1.0
        # At the accepted step: translations, sums of rotations, and the rotation Q
        self._accepted = np.zeros(len(names))
        self._turned = np.eye(3)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def _units(self) -> Array:
        """Unit of each unknown of the coupled system, in lengths or radians."""
        lever = 1.0 if self.lever is None else self.lever
        return np.where(self.is_turn, 1.0 / lever, 1.0)

    @property
    def unknowns(self) -> Array:
        """Unknowns of the coupled system, (n,). Lengths."""
        return self.values / self._units

    @unknowns.setter
    def unknowns(self, values: Array) -> None:
        self.values = values * self._units

    @property
    def theta(self) -> Array:
        """Rotation vector since the accepted step, (3,)."""
        return self._spread(self.values, True)

    def _spread(self, values: Array, turns: bool) -> Array:
        """Translations or rotations along all axes; 0 where they are not free."""
        vector = np.zeros(3)
        of = self.is_turn == turns
        vector[self.axis[of]] = values[of]
        return vector

    @property
    def translation(self) -> Array:
        """Translation since the body was made, (3,)."""
        return self._spread(self.values, False)

    @property
    def turn(self) -> Array:
        """exp(theta) Q, (3, 3)."""
        if not self._turns:
            return self._turned
        turned: Array = rotation_matrix(self.theta) @ self._turned
        return turned

    @property
    def totals(self) -> Array:
        """Translations, and the sums of rotations over all steps, (n,)."""
        return np.where(self.is_turn, self._accepted, 0.0) + self.values

    def rotation(self, prescribed: Array) -> Array:
        """Rotation vector of the body, (3,); rotations about one axis add up."""
        sums = self._spread(self.totals, True)
        count = int(np.count_nonzero(self.is_turn))
        if count == 0 or (count == 1 and not np.any(np.delete(prescribed, self._axis))):
            return prescribed + sums
        return rotation_vector(self.turn @ rotation_matrix(prescribed))

    @property
    def _axis(self) -> int:
        """Axis of the only free rotation."""
        return int(self.axis[self.is_turn][0])

    def accept(self) -> None:
        """Take the present pose as that of the accepted step."""
        self._accepted = self.totals
        self._turned = self.turn
        self.values = np.where(self.is_turn, 0.0, self.values)

    def state(self) -> Array:
        """All values that `restore` needs, (2 n + 9,)."""
        return np.concatenate([self.values, self._accepted, self._turned.ravel()])

    def restore(self, state: Array) -> None:
        """Go back to a `state`."""
        n = len(self)
        self.values, self._accepted = state[:n].copy(), state[n : 2 * n].copy()
        self._turned = state[2 * n :].reshape(3, 3).copy()

    def totals_of(self, state: Array) -> Array:
        """`totals` of a state."""
        n = len(self)
        return np.where(self.is_turn, state[n : 2 * n], 0.0) + state[:n]

    def rates(self) -> tuple[Array, Array, Array]:
        """Derivatives of points by the unknowns: drift (n, 3), spin (n, 3, 3) and
        second derivatives (n, n, 3, 3), see `_cpp.Freedom`."""
        n, units = len(self), self._units
        drift, spin, bend = (
            np.zeros((n, 3)),
            np.zeros((n, 3, 3)),
            np.zeros((n, n, 3, 3)),
        )
        straight = np.flatnonzero(~self.is_turn)
        drift[straight, self.axis[straight]] = 1.0
        turns = np.flatnonzero(self.is_turn)
        if len(turns):
            R, first, second = turning(self.theta)
            axes = self.axis[turns]
            spin[turns] = first[axes] @ R.T
            bend[np.ix_(turns, turns)] = second[np.ix_(axes, axes)] @ R.T
        spin *= units[:, None, None]
        bend *= np.multiply.outer(units, units)[:, :, None, None]
        return drift, spin, bend

    def forces(self, force: Array, moment: Array) -> tuple[Array, Array]:
        """Forces along the unknowns other than contact, (n,), and minus their
        derivative, (n, n): the given force and moment, (3,) each, springs and
        dampers."""
        drift, spin, bend = self.rates()
        units = self._units
        pushed = drift @ force + axial(spin) @ moment
        # The direction of a moment is fixed in space: its work depends on the rotation
        changed = bend + np.einsum("jab,kcb->jkac", spin, spin)
        slope = -(axial(changed) @ moment)
        moved = self.values - np.where(self.is_turn, 0.0, self._accepted)
        pushed -= units * (
            self.stiffness * self.totals + self.damping / self.dt * moved
        )
        slope += np.diag(units**2 * (self.stiffness + self.damping / self.dt))
        return pushed, slope


def _by_name(what: str, given: Any, names: tuple[str, ...], is_turn: Array) -> Array:
    """Stiffness or damping of each unknown, (n,)."""
    if given is None:
        return np.zeros(len(names))
    if is_real_number(given):
        given = {name: given for name, turns in zip(names, is_turn) if not turns}
    if not isinstance(given, Mapping):
        raise ContactError(
            f"{what} = {given!r} must be a number, or numbers by the names in free"
        )
    for name, value in given.items():
        if name not in names:
            raise ContactError(f"{what} has {name!r}, which is not in free = {names}")
        if not (is_real_number(value) and np.isfinite(value) and value >= 0.0):
            raise ContactError(f"{what} of {name} = {value!r} must not be negative")
    return np.array([float(given.get(name, 0.0)) for name in names])
