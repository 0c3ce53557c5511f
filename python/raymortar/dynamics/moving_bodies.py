"""Free rigid bodies with mass: a step's inertia is a spring and a force on each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..compat import Array
from ..errors import ContactError
from ..rigid.body import Body
from .schemes import Midpoint, Scheme, StepEquation


class MovingBodies:
    """The free rigid bodies that have mass, and how they move.

    In a step inertia m a = m (factor q + b) is a spring of the stiffness m factor and a
    force -m b, so that nothing else has to know of it [theory (6.11)].

    Parameters
    ----------
    contact
        Contact, or several.
    scheme
        Time integration scheme.

    Raises
    ------
    ContactError
        For a body in space with mass that may turn about more than one axis.
    """

    def __init__(self, contact: Any, scheme: Scheme) -> None:
        self._scheme = scheme
        self.bodies: list[Body] = [
            body for body in contact.layout.bodies if body.masses.any()
        ]
        self._d = contact.u.function_space.mesh.geometry.dim
        for body in self.bodies:
            turns = np.count_nonzero(body.freedom.is_turn)
            if turns > 1:
                raise ContactError(
                    f"the rigid {body.name} may turn about {turns} axes: in dynamics a "
                    "body with mass may turn about one"
                )
        self._equation = StepEquation(0.0, 0.0, 0.0, 0.0, 0.0)
        self._dt = 0.0
        # Unknowns at the accepted step, and what pushed them there
        self._last: list[Array] = []
        self._work = self._of_contact = 0.0
        self._given = [
            (body.cpp.force.copy(), body.cpp.moment.copy()) for body in self.bodies
        ]
        self._active = False
        self.take_accepted()

    def take_accepted(self) -> None:
        """Take places, velocities and accelerations as the bodies have them now."""
        self._new = [
            (b.freedom.totals, b.freedom.velocity, b.freedom.acceleration)
            for b in self.bodies
        ]
        self._push = [self._load(body) for body in self.bodies]

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
                self._set_stiffness(body, body.springs)
        self._active = False

    def begin(self, dt: float) -> None:
        """Put the inertia of a step on the bodies, whose loads have been set."""
        self._dt, self._equation = dt, self._scheme.equation(dt)
        self._given, self._last, self._active = [], [], True
        one = self._equation
        for body in self.bodies:
            cpp, freedom, m = body.cpp, body.freedom, body.masses
            self._given.append((cpp.force.copy(), cpp.moment.copy()))
            q = freedom.totals
            self._last.append(q)
            b = one.position * q + one.velocity * freedom.velocity
            b += one.acceleration * freedom.acceleration
            self._add_load(body, -m * b - one.kept * freedom.static)
            self._set_stiffness(body, body.springs + one.factor * m)

    @staticmethod
    def _set_stiffness(body: Body, stiffness: Array) -> None:
        body.freedom.stiffness = body.cpp.stiffness = stiffness

    @staticmethod
    def _add_load(body: Body, load: Array) -> None:
        """Add forces and moments along the unknowns of a body, (n,)."""
        freedom = body.freedom
        force, moment = body.cpp.force.copy(), body.cpp.moment.copy()
        force[freedom.axis[~freedom.is_turn]] += load[~freedom.is_turn]
        moment[freedom.axis[freedom.is_turn]] += load[freedom.is_turn]
        body.cpp.force, body.cpp.moment = force, moment

    def _load(self, body: Body) -> Array:
        """Loads and springs of a body along its unknowns, (n,)."""
        freedom = body.freedom
        load = np.where(
            freedom.is_turn, body.cpp.moment[freedom.axis], body.cpp.force[freedom.axis]
        )
        return np.asarray(load - freedom.stiffness * freedom.totals)

    def set_accelerations(self, contact: Any) -> None:
        """Find the accelerations that motion starts with, from the forces at the last
        update. Collective."""
        self.take_accepted()
        if not self.bodies:
            return
        b, layout = contact.create_vector(), contact.layout
        contact.assemble_vector(b)
        b.assemble()
        for body in self.bodies:
            freedom, m = body.freedom, body.masses
            found = np.zeros(len(freedom))
            if layout.own_bodies:
                found = -b.array_r[layout.body_rows[body] - layout.begin]
            unit = np.where(freedom.is_turn, 1.0 / (freedom.lever or 1.0), 1.0)
            force = layout.comm.bcast(found, root=0) / unit
            none = np.zeros(len(m))
            freedom.acceleration = np.divide(force, m, out=none, where=m > 0.0)
            freedom.static = -m * freedom.acceleration
        b.destroy()

    # Ends

    def _ends(self) -> list[tuple[Array, Array, Array]]:
        """Unknowns, velocities and accelerations of each body at the end of the solved
        step [theory (6.7), (6.9)]."""
        dt, scheme, found = self._dt, self._scheme, []
        for body, q in zip(self.bodies, self._last):
            now, freedom = body.freedom.totals, body.freedom
            v, a = freedom.velocity, freedom.acceleration
            if isinstance(scheme, Midpoint):
                end = 2.0 * now - q
                new_v = 2.0 * (end - q) / dt - v
                found.append((end, new_v, (new_v - v) / dt))
            else:
                new_a = (now - q - dt * v) / (scheme.beta * dt**2)
                new_a -= (0.5 / scheme.beta - 1.0) * a
                mean = (1.0 - scheme.gamma) * a + scheme.gamma * new_a
                found.append((now, v + dt * mean, new_a))
        return found

    def solved(self) -> None:
        """Take the end of the solved step, which is not yet accepted."""
        before, self._work = self.kinetic(), 0.0
        self._new = self._ends()
        middle = isinstance(self._scheme, Midpoint)
        # Without what stands for inertia
        forces = [body.cpp.force.copy() for body in self.bodies]
        moments = [body.cpp.moment.copy() for body in self.bodies]
        stiffness = [body.freedom.stiffness for body in self.bodies]
        self.release()
        push = [self._load(body) for body in self.bodies]
        for k, (body, q, (end, _, _)) in enumerate(
            zip(self.bodies, self._last, self._new)
        ):
            mean = push[k] if middle else 0.5 * (push[k] + self._push[k])
            self._work += float(mean @ (end - q))
            body.cpp.force, body.cpp.moment = forces[k], moments[k]
            self._set_stiffness(body, stiffness[k])
        self._push, self._active = push, True
        self._of_contact = self.kinetic() - before - self._work

    def accept(self) -> None:
        """Go over to the end of the solved step, after contact has accepted it."""
        self.release()
        one = self._equation
        for body, q, (end, v, a) in zip(self.bodies, self._last, self._new):
            freedom, m = body.freedom, body.masses
            solved = freedom.totals
            b = one.position * q + one.velocity * freedom.velocity
            b += one.acceleration * freedom.acceleration
            static = -m * (one.factor * solved + b) - one.kept * freedom.static
            freedom.velocity, freedom.acceleration, freedom.static = v, a, static
            freedom.values = freedom.values + (end - solved)

    # Sums

    def work(self) -> float:
        """Work of loads and springs on the bodies in the solved step."""
        return self._work

    def work_of_contact(self) -> float:
        """Work of contact on the bodies in the solved step: what else they gained."""
        return self._of_contact

    def kinetic(self) -> float:
        """Kinetic energy at the end of the solved step."""
        pairs = zip(self.bodies, self._new)
        return sum(0.5 * float(body.masses @ v**2) for body, (_, v, _) in pairs)

    def momentum(self) -> Array:
        """Momentum and moment of momentum about the origin at the end of the solved
        step, (d + 1,) in the plane, (6,) in space."""
        found = np.zeros(6)
        for body, (end, v, _) in zip(self.bodies, self._new):
            freedom, p, turn = body.freedom, np.zeros(3), np.zeros(3)
            moves = ~freedom.is_turn
            p[freedom.axis[moves]] = (body.masses * v)[moves]
            turn[freedom.axis[~moves]] = (body.masses * v)[~moves]
            place = body.centre + body.cpp.moved
            place[freedom.axis[moves]] += end[moves]
            found[:3] += p
            found[3:] += np.cross(place, p) + turn
        return found if self._d == 3 else found[[0, 1, 5]]
