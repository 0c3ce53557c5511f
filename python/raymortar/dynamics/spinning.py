"""Rotation of free rigid bodies about all axes, by the moment of their momentum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compat import Array
from ..rigid.body import Body
from ..rigid.turning import rotation_matrix
from .schemes import Midpoint, Scheme, end_of_step, velocity_in_step


@dataclass(frozen=True)
class SpinEnd:
    """Rotation of a body at the end of a step, about the axes of space, (3,) each.

    `acceleration` is the rate of the velocity that turns with the body, `rate` that of
    the moment of `momentum`, and `moment` the one on the body without inertia.
    """

    velocity: Array
    acceleration: Array
    momentum: Array
    rate: Array
    moment: Array


class Spin:
    """Rotation of a free rigid body about all axes [theory (6.13) to (6.16)].

    Parameters
    ----------
    body
        Body with an inertia tensor.
    scheme
        Time integration scheme.

    Attributes
    ----------
    now
        `SpinEnd` at the accepted step.
    """

    def __init__(self, body: Body, scheme: Scheme) -> None:
        self._body, self._scheme, self._dt = body, scheme, 0.0
        self._turns = body.freedom.is_turn
        assert body.inertia is not None
        self._inertia = body.inertia

    def tensor(self) -> Array:
        """Inertia tensor at the accepted rotation, about the axes of space, (3, 3)."""
        Q = self._body.cpp.accepted_turn
        return np.asarray(Q @ self._inertia @ Q.T)

    @property
    def now(self) -> SpinEnd:
        freedom = self._body.freedom
        velocity = freedom.velocity[self._turns]
        return SpinEnd(
            velocity, freedom.acceleration[self._turns], self.tensor() @ velocity,
            *freedom.moments,
        )  # fmt: skip

    def start(self, moment: Array) -> SpinEnd:
        """Find the acceleration that motion starts with, from the moment on the body,
        (3,). Take the present rotation as accepted."""
        self._body.freedom.settle_turn()
        J, velocity = self.tensor(), self._body.freedom.velocity[self._turns]
        momentum = J @ velocity
        # The velocity that turns with the body changes as Euler's equations say
        acceleration = np.linalg.solve(J, moment - np.cross(velocity, momentum))
        return SpinEnd(velocity, acceleration, momentum, moment, moment)

    def begin(self, dt: float) -> None:
        """Put the inertia of a step on the body."""
        self._dt, scheme, now = dt, self._scheme, self.now
        cpp, freedom = self._body.cpp, self._body.freedom
        if isinstance(scheme, Midpoint):
            whole, factor, rate = 2.0, 1.0 / dt, 4.0 / dt
            start, kept = -now.velocity, -now.momentum / dt
        else:
            beta, gamma = scheme.beta, scheme.gamma
            alpha_m, alpha_f = scheme.alphas
            whole = 1.0
            factor = (1.0 - alpha_m) / ((1.0 - alpha_f) * gamma * dt)
            rate, start = velocity_in_step(scheme, dt, now.velocity, now.acceleration)
            kept = -factor * (now.momentum + (1.0 - gamma) * dt * now.rate)
            kept += (alpha_m * now.rate - alpha_f * now.moment) / (1.0 - alpha_f)
        self._whole, self._factor, self._kept = whole, factor, kept
        self._J = self.tensor()
        cpp.set_spin(
            J=self._J, whole=whole, factor=factor, rate=rate, start=start, kept=kept
        )
        freedom.spins = True

    def release(self) -> None:
        """Take inertia off the body."""
        self._body.cpp.clear_spin()
        self._body.freedom.spins = False

    def end(self) -> SpinEnd:
        """Find the end of the solved step, which is not yet accepted."""
        dt, scheme, now = self._dt, self._scheme, self.now
        theta = self._body.freedom.values[self._turns]
        turn = rotation_matrix(self._whole * theta)
        begun, gamma = (0.0 * theta, now.velocity, now.acceleration), scheme.gamma
        _, velocity, acceleration = end_of_step(scheme, dt, begun, theta)
        momentum = turn @ self._J @ velocity
        rate = (momentum - now.momentum) / (gamma * dt)
        rate -= (1.0 - gamma) / gamma * now.rate
        moment = self._factor * momentum + self._kept
        return SpinEnd(turn @ velocity, turn @ acceleration, momentum, rate, moment)

    def accept(self, end: SpinEnd) -> None:
        """Go over to an end; the body has the place of the end of the step."""
        freedom, turns = self._body.freedom, self._turns
        freedom.settle_turn()
        freedom.velocity[turns] = end.velocity
        freedom.acceleration[turns] = end.acceleration
        freedom.moments = np.array([end.rate, end.moment])
