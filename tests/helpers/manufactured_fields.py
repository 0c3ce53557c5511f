"""Exact states of bodies in contact, in closed form, for UFL and for NumPy alike.

The slave's deformed face slides on the graph of a quadratic function, so that the gap
is zero by construction. The traction on it is chosen (frictionless, or on the friction
cone); dead loads make up for what the stress of the exact field does not carry. All
materials are Saint Venant-Kirchhoff's.

Fields take positions X, a slide s and the scale c of the strain in the bulk; the trace
on the contact face does not depend on c.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import ufl
from materials import MATERIALS, lame

MU = 0.3


def square_on_parabola(X, s, c=1.0):
    """Slides along y = -0.05 (x - 1/2)^2."""
    x, y = X[0], X[1]
    return [
        s[0] - 0.2 * c * y**3 * (x - 0.5),
        -0.05 * (x + s[0] - 0.5) ** 2 * (1.0 + y) - 0.01 * y,
    ]


def cube_on_paraboloid(X, s, c=1.0):
    """Slides along z = -0.5 - 0.2 (x^2 + y^2)."""
    x, y, z = X[0], X[1], X[2]
    bulge = 0.2 * c * z**2 * x * y
    sag = 1.0 + (x + s[0]) ** 2 + (y + s[1]) ** 2
    return [
        s[0] + bulge,
        s[1] + bulge,
        -0.2 * sag * (1.0 + 0.01 * z) - 0.01 * z - 0.3,
    ]


def strip_under_square(X, s, c=1.0):
    """Bends the line y = 0 to that parabola and leaves y = -1 alone."""
    return [0.0 * X[0], -0.05 * (X[0] - 0.5) ** 2 * (1.0 + X[1]) ** 2]


def slab_under_cube(X, s, c=1.0):
    """Bends the plane z = -0.5 to that paraboloid and leaves z = -2 alone."""
    height = (2.0 + X[2]) / 1.5
    zero = 0.0 * X[0]
    return [zero, zero, -0.2 * (X[0] ** 2 + X[1] ** 2) * height]


@dataclasses.dataclass(frozen=True)
class Motion:
    """A step from the exact state at slide s0, c = 1, to the one at s1 and c.

    `share` is that of the friction cone that the tangential traction uses: against the
    chord of the slip, or, where s0 = s1, along a chosen tangent.
    """

    s0: tuple = (0.0, 0.0)
    s1: tuple = (0.0, 0.0)
    c: float = 1.0
    share: float = 0.0


@dataclasses.dataclass(frozen=True)
class Body:
    """Exact displacement and moduli of a body."""

    field: Callable
    E: float
    nu: float

    @property
    def moduli(self):
        return lame(self.E, self.nu)

    def exact(self, X, s, c=1.0):
        """Displacement, nominal stress and deformation gradient, in UFL."""
        u = ufl.as_vector(self.field(X, s, c))
        H = ufl.grad(u)
        return u, MATERIALS["svk"][0](H, *self.moduli), ufl.Identity(len(u)) + H

    def values(self, X, s, c=1.0):
        """Displacements (..., d) at X (..., d)."""
        return np.stack(self.field(np.moveaxis(X, -1, 0), s, c), axis=-1)

    def gradient(self, X, s, c=1.0):
        """Gradients (..., d, d) at X (..., d), to rounding: by complex steps."""
        d, step = X.shape[-1], 1e-30
        columns = [
            self.values(X + 1j * step * np.eye(d)[j], s, c).imag / step
            for j in range(d)
        ]
        return np.stack(columns, axis=-1)


@dataclasses.dataclass(frozen=True)
class Fields:
    """An upper body on a lower one (None: rigid), and the traction between them.

    Attributes
    ----------
    dim
        2 or 3.
    upper, lower
        The bodies. The upper one's contact face is its reference plane of height 0.
    along
        Reference direction that turns with the surface, of the traction in stick.
    foot
        Height of the lower body's reference contact face.
    fading
        The traction fades to zero at the rim of the contact face (linearly). Where the
        rims of both bodies meet, the least error uncovers a part of the face.
    """

    dim: int
    upper: Body
    lower: Body | None
    along: tuple
    foot: float = 0.0
    fading: bool = False

    @property
    def normal(self):
        """Outward, of the upper body's reference contact face."""
        return (0.0,) * (self.dim - 1) + (-1.0,)

    def _share(self, X):
        """Of the normal stress that contact carries; a dead load has the rest."""
        share = 1.0
        start = 0.0 if self.dim == 2 else -0.5
        for axis in range(self.dim - 1 if self.fading else 0):
            t = X[axis] - start
            share = share * 4.0 * t * (1.0 - t)
        return share

    def contact(self, X, motion):
        """Pressure (negative), traction on the upper body and normal, in UFL."""
        u, P, F = self.upper.exact(X, motion.s1, motion.c)
        N = ufl.as_vector(self.normal)
        n = ufl.inv(F).T * N
        n = n / ufl.sqrt(ufl.inner(n, n))
        p = self._share(X) * ufl.inner(P * N, n)
        if not motion.share:
            return p, p * n, n
        if motion.s0 == motion.s1:
            t = F * ufl.as_vector(self.along)
        else:
            t = u - ufl.as_vector(self.upper.field(X, motion.s0, motion.c))
        t = t - ufl.inner(t, n) * n
        return p, p * n + motion.share * MU * p * t / ufl.sqrt(ufl.inner(t, t)), n

    def contact_at(self, X, motion):
        """Pressure (n,), traction (n, d), normal (n, d) and ratio of deformed to
        reference area (n,) at points X (n, d) of the upper body's contact face."""
        H = self.upper.gradient(X, motion.s1, motion.c)
        F, N = np.eye(self.dim) + H, np.array(self.normal)
        P = MATERIALS["svk"][1](H, *self.upper.moduli)
        n = np.linalg.inv(F).swapaxes(-1, -2) @ N
        area = np.linalg.det(F) * np.linalg.norm(n, axis=-1)
        n /= np.linalg.norm(n, axis=-1, keepdims=True)
        p = self._share(X.T) * np.einsum("qi,qi->q", P @ N, n)
        traction = p[:, None] * n
        if motion.share:
            if motion.s0 == motion.s1:
                t = F @ np.array(self.along)
            else:
                t = self.upper.values(X, motion.s1) - self.upper.values(X, motion.s0)
            t = t - np.einsum("qi,qi->q", t, n)[:, None] * n
            t /= np.linalg.norm(t, axis=1)[:, None]
            traction += motion.share * MU * p[:, None] * t
        return p, traction, n, area

    def above(self, X, motion):
        """Point of the upper body on the point X of the lower one: a list, or (n, d)."""
        slide = (*motion.s1[: self.dim - 1], self.foot)
        if isinstance(X, np.ndarray):
            return X - np.array(slide)
        return [X[i] - slide[i] for i in range(self.dim)]


# B2, B1 (both with B3's slides), and B4 with the same upper bodies
SQUARE = Fields(2, Body(square_on_parabola, 1.0, 0.3), None, (1.0, 0.0))
CUBE = Fields(3, Body(cube_on_paraboloid, 1.0, 0.0), None, (1.0, 0.5, 0.0), -0.5)
TWO_SQUARES, TWO_CUBES = (
    dataclasses.replace(fields, lower=Body(lower, 2.0, 0.25), fading=True)
    for fields, lower in ((SQUARE, strip_under_square), (CUBE, slab_under_cube))
)
