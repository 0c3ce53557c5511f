"""Rigid bodies that turn without supports, and their closed forms."""

from __future__ import annotations

from types import SimpleNamespace

from petsc4py import PETSc

import numpy as np
from dolfinx import fem, mesh
from problems import COMM

from raymortar import rigid, tools
from raymortar.dynamics.moving_bodies import MovingBodies
from raymortar.rigid.turning import rotation_matrix

TURNS = ("rx", "ry", "rz")


def body(inertia, velocity, moment=None, turned=(0.0, 0.0, 0.0), **options):
    """A ball that turns about all axes, turned before it starts."""
    found = rigid.Body(
        rigid.Sphere((0.0, 0.0, 0.0), 0.5), free=TURNS, inertia=inertia, **options
    )
    found.cpp.accepted_turn = rotation_matrix(np.array(turned))
    found.velocity = dict(zip(TURNS, map(float, velocity)))
    if moment is not None:
        found.moment = moment
    return found


def balance(one):
    """Solve a body's equations of a step by Newton's method."""
    for _ in range(30):
        forces, slope = one.cpp.forces()
        change = np.linalg.solve(slope, forces)
        one.freedom.values = one.freedom.values + change
        if np.abs(change).max() <= 1e-13:
            return
    raise AssertionError("the step has no solution")


class _Alone:
    """A contact of one body that touches nothing."""

    def __init__(self, one):
        self._one = one
        self.u = fem.Function(
            tools.vector_space(mesh.create_unit_cube(COMM, 1, 1, 1), 1)
        )
        self.layout = SimpleNamespace(
            bodies=(one,), own_bodies=(one,), comm=COMM, begin=0,
            body_rows={one: np.arange(len(one.freedom))},
            create_vector=self._zeros,
        )  # fmt: skip

    @property
    def system(self):
        return self

    def _zeros(self):
        found = PETSc.Vec().createSeq(len(self._one.freedom))
        found.set(0.0)
        return found

    def add_residual(self, b):
        b.array[:] = -self._one.cpp.forces()[0]


def turn(one, scheme, dt, count):
    """Turn a body by time steps; velocities and momenta in space, rotations (3, 3)."""
    moving = MovingBodies(_Alone(one), scheme)
    moving.set_accelerations(_Alone(one))
    ends, turns, works = [], [], []
    for _ in range(count + 1):
        (end,) = moving.ends
        ends.append(end.spin)
        turns.append(one.cpp.accepted_turn.copy())
        works.append(moving.work())
        moving.begin(dt)
        balance(one)
        moving.solved()
        one.cpp.accept()
        moving.accept()
    velocity = np.array([end.velocity for end in ends])
    momentum = np.array([end.momentum for end in ends])
    return SimpleNamespace(
        velocity=velocity, momentum=momentum, turns=np.array(turns),
        in_body=np.einsum("nji,nj->ni", np.array(turns), velocity),
        kinetic=0.5 * np.einsum("ni,ni->n", velocity, momentum), works=np.array(works),
    )  # fmt: skip


def elliptic(u, m):
    """Jacobi's sn, cn, dn of arguments and the parameter m, by arithmetic and
    geometric means (Abramowitz and Stegun 16.4)."""
    a, b, c = [1.0], np.sqrt(1.0 - m), [np.sqrt(m)]
    while c[-1] > 1e-16:
        c.append(0.5 * (a[-1] - b))
        a_next = 0.5 * (a[-1] + b)
        b = np.sqrt(a[-1] * b)
        a.append(a_next)
    phi = 2.0 ** (len(a) - 1) * a[-1] * np.asarray(u, dtype=float)
    for a_i, c_i in zip(a[:0:-1], c[:0:-1]):
        phi = 0.5 * (phi + np.arcsin(c_i / a_i * np.sin(phi)))
    sn = np.sin(phi)
    return sn, np.cos(phi), np.sqrt(1.0 - m * sn**2)


def flipping(J, energy, momentum, t):
    """Velocity about the axes of a body that turns without moments, (times, 3), from
    principal moments J1 < J2 < J3 and a time at which that about the second axis is 0
    (Landau and Lifshitz, Mechanics, section 37)."""
    J1, J2, J3 = J
    double, square = 2.0 * energy, momentum**2
    one, three = square - double * J1, double * J3 - square
    if square < double * J2:
        # The velocity about the first axis keeps its sign
        J1, J3, one, three = J3, J1, -three, -one
    rate = np.sqrt((J3 - J2) * one / (J1 * J2 * J3))
    m = (J2 - J1) * three / ((J3 - J2) * one)
    sn, cn, dn = elliptic(rate * np.asarray(t), m)
    a = np.sqrt(three / (J1 * (J3 - J1)))
    b = np.sqrt(three / (J2 * (J3 - J2)))
    c = np.sqrt(one / (J3 * (J3 - J1)))
    found = [a * cn, b * sn, c * dn]
    if J1 > J3:
        found = [found[2], -found[1], found[0]]
    return np.stack(found, axis=1)
