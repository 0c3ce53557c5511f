"""Free rigid bodies with mass: a step's inertia is a spring and a force on each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.errors import ContactError
from ..core.state import Quantity, of_array
from ..rigid.body import Body
from ..rigid.turning import rotation_matrix
from .schemes import Midpoint, Scheme, StepEquation, end_of_step, velocity_in_step


@dataclass(frozen=True)
class BodyEnd:
    """Unknowns, velocities and accelerations of a body at the end of a step, (n,) each.
    `spin` is that of a body which turns about all axes."""

    q: Array
    v: Array
    a: Array
    spin: SpinEnd | None = None


class MovingBodies:
    """The free rigid bodies that have mass, and how they move.

    In a step inertia m a = m (factor q + b) is a spring of the stiffness m factor and a
    force -m b, and dampers alike, so that nothing else has to know of them
    [theory (6.11)]. Rotations about all axes have an equation of their own, `Spin`.

    Attributes
    ----------
    bodies
        The bodies that have mass.
    ends
        `BodyEnd` of each at the solved step, or at the accepted one.
    work_of_contact
        Work of contact on the bodies in the solved step: what they gained beside `work`.
    """

    def __init__(self, contact: Any, scheme: Scheme) -> None:
        self._scheme = scheme
        self.bodies: list[Body] = [
            body
            for body in contact.layout.bodies
            if body.masses.any() or body.inertia is not None
        ]
        for body in contact.layout.bodies:
            if body not in self.bodies and body.freedom.velocity.any():
                raise ContactError(
                    f"the rigid {body.name} has velocity = {body.velocity} and no mass: "
                    "give it mass= or inertia=, or prescribe its motion by Body.move"
                )
        self._d = contact.u.function_space.mesh.geometry.dim
        for body in self.bodies:
            turns = np.count_nonzero(body.freedom.is_turn)
            if turns > 1 and body.inertia is None:
                raise ContactError(
                    f"the rigid {body.name} may turn about {turns} axes: in dynamics a "
                    "body with mass may turn about one, or about three with its inertia"
                )
        self._spins: list[Spin | None] = [
            None if body.inertia is None else Spin(body, scheme) for body in self.bodies
        ]
        self._equation = StepEquation(0.0, 0.0, 0.0, 0.0, 0.0)
        self._dt = 0.0
        # Unknowns at the accepted step; what pushed them there
        self._last: list[Array] = []
        self._work = self.work_of_contact = 0.0
        self._given = [
            (body.cpp.force.copy(), body.cpp.moment.copy()) for body in self.bodies
        ]
        self._active = False
        self.take_ends()
        self._push = self._pushes()

    def quantities(self) -> Iterator[Quantity]:
        """Yield what pushes bodies along their unknowns in the state that was solved."""
        for k, push in enumerate(self._push):
            yield of_array(f"push {k}", push)

    def take_ends(self) -> None:
        """Take places, velocities and accelerations as the bodies have them now."""
        self.ends = [
            BodyEnd(
                b.freedom.totals, b.freedom.velocity, b.freedom.acceleration,
                None if spin is None else spin.now,
            )
            for b, spin in zip(self.bodies, self._spins)
        ]  # fmt: skip

    def _pushes(self) -> list[Array]:
        """Forces and moments on each body now."""
        return [
            self._load(body, (body.cpp.force, body.cpp.moment), body.freedom.velocity)
            for body in self.bodies
        ]

    # Steps

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Leave loads and springs as they were given at the end."""
        try:
            yield
        finally:
            self.release()

    def release(self) -> None:
        """Take inertia off the bodies."""
        if self._active:
            for body, (force, moment) in zip(self.bodies, self._given):
                body.cpp.force, body.cpp.moment = force, moment
                body.cpp.damping = body.freedom.damping
                body.freedom.has_inertia = False
                self._set_stiffness(body, body.springs)
            for spin in filter(None, self._spins):
                spin.release()
        self._active = False

    def begin(self, dt: float) -> None:
        """Put the inertia of a step on the bodies, which have been released, and whose
        loads have been set."""
        self._dt, self._equation = dt, self._scheme.equation(dt)
        self._given, self._last, self._active = [], [], True
        self._velocity: list[tuple[float, Array]] = []
        one = self._equation
        for body in self.bodies:
            cpp, freedom, m = body.cpp, body.freedom, body.masses
            freedom.has_inertia = True
            self._given.append((cpp.force.copy(), cpp.moment.copy()))
            q = freedom.totals
            self._last.append(q)
            b = one.shift(q, freedom.velocity, freedom.acceleration)
            # The velocity that dampers see
            rate, start = velocity_in_step(
                self._scheme, dt, freedom.velocity, freedom.acceleration
            )
            start = start - rate * q
            self._velocity.append((rate, start))
            c, cpp.damping = freedom.damping, np.zeros(len(m))
            load = -m * b - one.kept * freedom.static - c * start
            force, moment = cpp.force.copy(), cpp.moment.copy()
            force[freedom.axis[~freedom.is_turn]] += load[~freedom.is_turn]
            moment[freedom.axis[freedom.is_turn]] += load[freedom.is_turn]
            cpp.force, cpp.moment = force, moment
            self._set_stiffness(body, body.springs + one.factor * m + rate * c)
        for spin in filter(None, self._spins):
            spin.begin(dt)

    @staticmethod
    def _set_stiffness(body: Body, stiffness: Array) -> None:
        body.freedom.stiffness = body.cpp.stiffness = stiffness

    @staticmethod
    def _load(body: Body, given: tuple[Array, Array], velocity: Array) -> Array:
        """Force and moment, springs and dampers along the unknowns of a body, (n,)."""
        freedom, (force, moment) = body.freedom, given
        load = np.where(freedom.is_turn, moment[freedom.axis], force[freedom.axis])
        load = load - freedom.damping * velocity
        return np.asarray(load - body.springs * freedom.totals)

    def set_accelerations(self, contact: Any) -> None:
        """Find the accelerations that motion starts with, from the forces at the last
        update. Collective."""
        self._push = self._pushes()
        if not self.bodies:
            self.take_ends()
            return
        layout = contact.layout
        b = layout.create_vector()
        contact.system.add_residual(b)
        for body, spin in zip(self.bodies, self._spins):
            freedom, m = body.freedom, body.masses
            found = np.zeros(len(freedom))
            if layout.own_bodies:
                found = -b.array_r[layout.body_rows[body] - layout.begin]
            unit = np.where(freedom.is_turn, 1.0 / (freedom.lever or 1.0), 1.0)
            force = layout.comm.bcast(found, root=0) / unit
            force -= freedom.damping * freedom.velocity
            none = np.zeros(len(m))
            freedom.acceleration = np.divide(force, m, out=none, where=m > 0.0)
            freedom.static = -m * freedom.acceleration
            if spin is not None:
                spin.accept(spin.start(force[freedom.is_turn]))
        b.destroy()
        self.take_ends()

    # Ends

    def solved(self) -> None:
        """Take the end of the solved step [theory (6.7), (6.9)], which is not yet
        accepted."""
        before, self._work = self.kinetic(), 0.0
        middle, self.ends = isinstance(self._scheme, Midpoint), []
        for k, (body, q) in enumerate(zip(self.bodies, self._last)):
            freedom, spin = body.freedom, self._spins[k]
            begun = q, freedom.velocity, freedom.acceleration
            found = end_of_step(self._scheme, self._dt, begun, freedom.totals)
            end = BodyEnd(*found, None if spin is None else spin.end())
            self.ends.append(end)
            rate, start = self._velocity[k]
            velocity = rate * body.freedom.totals + start
            push = self._load(body, self._given[k], velocity)
            mean = push if middle else 0.5 * (push + self._push[k])
            self._work += float(mean @ (end.q - q))
            self._push[k] = push
        self.work_of_contact = self.kinetic() - before - self._work

    def accept(self) -> None:
        """Go over to the end of the solved step, after contact has accepted it."""
        self.release()
        one = self._equation
        for body, q, end, spin in zip(self.bodies, self._last, self.ends, self._spins):
            freedom, m = body.freedom, body.masses
            solved = freedom.totals
            b = one.shift(q, freedom.velocity, freedom.acceleration)
            static = -m * (one.factor * solved + b) - one.kept * freedom.static
            freedom.velocity, freedom.acceleration = end.v.copy(), end.a.copy()
            freedom.static = static
            freedom.values = freedom.values + (end.q - solved)
            if spin is not None and end.spin is not None:
                spin.accept(end.spin)

    # Sums

    def work(self) -> float:
        """Work of loads and springs on the bodies in the solved step."""
        return self._work

    def kinetic(self) -> float:
        """Kinetic energy at the end of the solved step."""
        found = 0.0
        for body, end in zip(self.bodies, self.ends):
            found += 0.5 * float(body.masses @ end.v**2)
            if end.spin is not None:
                found += 0.5 * float(end.spin.velocity @ end.spin.momentum)
        return found

    def momentum(self) -> Array:
        """Momentum and moment of momentum about the origin at the end of the solved
        step, (d + 1,) in the plane, (6,) in space."""
        found = np.zeros(6)
        for body, end in zip(self.bodies, self.ends):
            freedom, p, turn = body.freedom, np.zeros(3), np.zeros(3)
            moves = ~freedom.is_turn
            p[freedom.axis[moves]] = (body.masses * end.v)[moves]
            turn[freedom.axis[~moves]] = (body.masses * end.v)[~moves]
            place = body.centre + body.cpp.moved
            place[freedom.axis[moves]] += end.q[moves]
            found[:3] += p
            found[3:] += np.cross(place, p) + turn
            if end.spin is not None:
                found[3:] += end.spin.momentum
        return found if self._d == 3 else found[[0, 1, 5]]


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
    """Rotation of a free rigid body about all axes [theory (6.13) to (6.16)]."""

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
        """Rotation at the accepted step."""
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
            gamma, whole = scheme.gamma, 1.0
            alpha_m, alpha_f = scheme.alphas
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
