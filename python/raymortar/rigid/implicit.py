"""Rigid shapes where a function is zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _cpp
from ..core.compat import Array
from ..core.errors import ContactError
from .shapes import Shape

# Most Newton steps along a ray, and the length of the last one, over the distance that
# the function gives
_STEPS, _SETTLED = 60, 1e-13

# Error of a difference quotient that is allowed, relative to the derivative, and its step
# over the size of the scene
_OFF, _STEP = 0.1, 1e-6

Field = Callable[[Array], Array]


@dataclass(frozen=True, repr=False)
class Implicit(Shape):
    """Solid where a function is negative.

    Each pairing calls it with all points at once, in the coordinates in which the body
    was made. Newton's method finds the hit along each ray, which is easiest if the
    function is nearly a distance.

    Parameters
    ----------
    phi
        Function of positions, (3, n) to (n,), as DOLFINx's ``interpolate`` takes it; in
        2D x[2] is 0.
    gradient
        To (3, n), or (2, n) in 2D; it must not vanish on the surface.
    hessian
        To (3, 3, n), or (2, 2, n) in 2D.
    """

    phi: Field
    gradient: Field
    hessian: Field

    def __post_init__(self) -> None:
        for name in ("phi", "gradient", "hessian"):
            if not callable(getattr(self, name)):
                raise ContactError(f"{name} must be a function of points, (3, n)")

    def __repr__(self) -> str:
        # This text is equal on all ranks; that of a function has an address
        return f"Implicit({getattr(self.phi, '__name__', type(self.phi).__name__)})"

    @property
    def gdim(self) -> None:
        return None

    def cpp(self) -> _cpp.Tool:
        return _cpp.called_tool(cast=self._cast, distance=self._distance)

    def _value(self, x: Array) -> Array:
        """Values at points (n, 3)."""
        return self._call("phi", x, ())

    def _gradient(self, x: Array) -> Array:
        """(n, 3)."""
        return self._call("gradient", x, (3,))

    def _hessian(self, x: Array) -> Array:
        """(n, 3, 3)."""
        return self._call("hessian", x, (3, 3))

    def _call(self, name: str, x: Array, shape: tuple[int, ...]) -> Array:
        """Call a function at points (n, 3), check its values and give them, (n, ...)."""
        found = np.asarray(getattr(self, name)(x.T.copy()), dtype=np.float64)
        axes, full = len(shape), (*shape, len(x))
        # Two components in 2D
        if axes and found.ndim == axes + 1 and found.shape[:axes] == (2,) * axes:
            found = np.pad(found, [(0, 1)] * axes + [(0, 0)])
        if found.shape != full:
            raise ContactError(
                f"{name} returns an array of shape {found.shape} for {len(x)} points: "
                f"it must be {full}"
            )
        if not np.isfinite(found).all():
            raise ContactError(f"{name} returns values that are not finite")
        return np.ascontiguousarray(np.moveaxis(found, -1, 0))

    def _distance(self, x: Array) -> float:
        point = x.reshape(1, 3)
        size = float(np.linalg.norm(self._gradient(point)))
        return float(self._value(point)[0]) / size if size > 0.0 else 0.0

    def _check_derivatives(self, x: Array, n: Array) -> None:
        """Raise if gradient or hessian differ from difference quotients at the first
        points. Kinks at some of these points are no fault."""
        if not len(x) or getattr(self, "_is_checked", False):
            return
        object.__setattr__(self, "_is_checked", True)
        step = _STEP * max(float(np.abs(x).max()), 1e-300)
        way = _oblique(n)
        ahead, behind = x + step * way, x - step * way
        slope, bend = self._gradient(x), self._hessian(x)
        found = {
            "gradient": (
                np.einsum("nd,nd->n", slope, way),
                self._value(ahead) - self._value(behind),
                np.linalg.norm(slope, axis=1),
            ),
            "hessian": (
                np.einsum("nij,nj->ni", bend, way),
                self._gradient(ahead) - self._gradient(behind),
                np.linalg.norm(bend, axis=(1, 2)),
            ),
        }
        for name, (given, change, size) in found.items():
            off = np.abs(given - change / (2.0 * step)).reshape(len(x), -1).max(axis=1)
            # Rounding of the gradient, over the step
            size = size + 1e-3 * np.linalg.norm(slope, axis=1) / max(
                float(np.ptp(x, axis=0).max()), step
            ) * (name == "hessian")
            if np.median(off - _OFF * size) > 0.0:
                raise ContactError(
                    f"{name} is not the derivative: it differs from "
                    f"differences by up to {off.max():.3g}, of {size.max():.3g}"
                )

    def _cast(self, x: Array, n: Array) -> tuple[Any, Array, Array, Array]:
        """Find where rays enter the solid: see `_cpp.called_tool`."""
        self._check_derivatives(x, n)
        g, settled = np.zeros(len(x)), np.zeros(len(x), dtype=bool)
        normal, bend = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
        if not len(x):
            return settled.astype(np.int8), g, normal, bend
        start = self._value(x)
        for _ in range(_STEPS):
            moving = np.flatnonzero(~settled)
            if not len(moving):
                break
            at = x[moving] + g[moving, None] * n[moving]
            value, slope = self._value(at), self._gradient(at)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = -value / np.einsum("nd,nd->n", slope, n[moving])
                # no ray is far more oblique
                most = 4.0 * np.abs(value) / np.linalg.norm(slope, axis=1)
            step = np.clip(np.nan_to_num(step), -most, most)
            g[moving] += np.nan_to_num(step)
            scale = np.maximum(np.abs(g[moving]), np.linalg.norm(at, axis=1))
            settled[moving] = np.abs(step) <= _SETTLED * scale
        at = x + g[:, None] * n
        slope = self._gradient(at)
        size = np.linalg.norm(slope, axis=1)
        # From outside ahead, from inside behind, and into the solid
        way = np.where(start < 0.0, g <= 0.0, g >= 0.0) | (np.abs(g) <= _SETTLED)
        found = settled & way & (np.einsum("nd,nd->n", slope, n) < 0.0) & (size > 0.0)
        normal[found] = slope[found] / size[found, None]
        bend[found] = self._hessian(at)[found] / size[found, None, None]
        return found.astype(np.int8), g, normal, bend


def _oblique(n: Array) -> Array:
    """Directions at 45 degrees to the given ones, in the plane in 2D, (n, 3)."""
    across = np.cross(n, [0.0, 0.0, 1.0])
    flat = np.linalg.norm(across, axis=1) < 0.5
    across[flat] = np.cross(n[flat], [1.0, 0.0, 0.0])
    way = n + across
    return way / np.linalg.norm(way, axis=1)[:, None]
