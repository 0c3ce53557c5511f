"""Parameters of contact, by which functionals are differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core import compat
from ..core.compat import Array
from ..core.contact import Contact
from ..core.errors import ContactError, of_type
from ..core.options.methods import Penalty
from ..rigid import Body, Circle, Cylinder, Polyline, Sphere, Surface
from .controls import Control, function_of
from .linear import Linearised


class OfSlave(Control):
    """A field on the slave: its offset, its friction coefficient, or gamma."""

    def __init__(self, contact: Contact, kind: str, number: float | None) -> None:
        self._contact, self._kind, self._number = contact, kind, number

    def check(self, problem: Any, forms: Sequence[Any]) -> None:
        if not any(one is self._contact for one in problem.contact.contacts):
            raise ContactError("controls: a contact is none of the problem's")

    def kink(self) -> str | None:
        """Friction with a multiplier makes couples over gaps that an offset leaves open
        [theory (3)]: at an offset of zero these couples begin with a jump."""
        contact = self._contact
        if self._kind != "offset" or contact.multiplier is None:
            return None
        for zone in contact.zones:
            acts = zone.frictional or zone.facets.bodies
            own = zone.whole_offset
            is_zero = own is None or bool(np.any(own == 0.0))
            if acts and is_zero and not zone.couples_over_gaps:
                return (
                    f"offset: that of {zone.facets.spoken} is zero somewhere, where "
                    "couples over gaps begin with a jump: the derivative returned is "
                    "that without them; Contact(offset=...) that is small has one"
                )
        return None

    def start(self, problem: Any) -> Array:
        contact = self._contact
        V = contact.surfaces.slave_u.function_space
        own = [d.u.function_space for d in problem.contact.unknowns.displacements]
        self._k, self._d = own.index(V), V.mesh.geometry.dim
        self._V = compat.scalar_space(V.mesh, compat.element_info(V).degree)
        self._place = np.zeros(len(contact.surfaces.slave_u.x.array) // self._d, int)
        self._place[compat.dofmap_array(V)] = compat.dofmap_array(self._V)
        return np.zeros(1 if self._number is not None else len(self._place))

    def by_contact(self, at: Linearised) -> Array | float:
        kind, component = ("gamma", 0) if self._kind == "gamma" else ("fields", 0)
        if self._kind == "friction":
            component = 1
        values = at.of_displacement(at.by_fields(self._contact, kind), self._k)
        nodal = np.zeros(len(self._place))
        nodal[self._place] = values.reshape(-1, self._d)[:, component]
        if self._number is None:
            return nodal
        own = nodal[: self._V.dofmap.index_map.size_local].sum()
        return np.atleast_1d(at.problem.comm.allreduce(own)) / self._number

    def result(self, found: Array) -> Any:
        return (
            float(found[0]) if self._number is not None else function_of(self._V, found)
        )


class OfTool(Control):
    """Motions of a rigid tool, and changes of its size that are such motions."""

    def __init__(self, body: Body, kinds: tuple[str, ...]) -> None:
        self._body, self._kinds = body, kinds

    def check(self, problem: Any, forms: Sequence[Any]) -> None:
        body = self._body
        self._zones = [z for z in problem.contact.zones if body in z.facets.bodies]
        if not self._zones:
            raise ContactError(
                f"controls: no contact of the problem meets the rigid {body.name}"
            )

    def start(self, problem: Any) -> Array:
        motions = [self._motions(kind, self._body.motion()) for kind in self._kinds]
        return np.zeros(sum(map(len, motions)))

    def by_contact(self, at: Linearised) -> Array | float:
        found = []
        for kind in self._kinds:
            sums = np.zeros(self._body.shape.gdim)
            for zone in self._zones:
                number = zone.facets.bodies.index(self._body)
                motions = self._body.motion(), zone.motions.old[number]
                now, old = (self._motions(kind, motion) for motion in motions)
                y = at.by_parameter([zone], "tool", tool=number, now=now, old=old)
                sums += at.owned_sums(y)
                y.destroy()
            found.append(sums[: len(now)])
        return np.concatenate(found)

    def _motions(self, kind: str, motion: Array) -> Array:
        """Rows of shift and slope of points, where the body has a given motion
        [theory (8.9)]."""
        body, d = self._body, self._body.shape.gdim
        R, b = body.pose_of(motion)
        centre, I = R @ body.centre + b, np.eye(3)
        if kind == "shift":
            rows = [(axis, np.zeros((3, 3))) for axis in I[:d]]
        elif kind == "turn":
            axes = I[2:] if d == 2 else R.T
            slopes = [np.cross(I, axis) for axis in axes]
            rows = [(-slope @ centre, slope) for slope in slopes]
        else:
            shape: Any = body.shape
            slope = I / shape.radius
            if isinstance(shape, Cylinder):
                axis = R @ (np.array(shape.axis) / np.linalg.norm(shape.axis))
                slope -= np.outer(axis, axis) / shape.radius
            rows = [(-slope @ (R @ shape.place + b), slope)]
        return np.array([np.concatenate([a, B.ravel()]) for a, B in rows])

    def result(self, found: Array) -> Any:
        return float(found[0]) if self._kinds == ("size",) else found


def offset(contact: Contact) -> Control:
    """The length that is added to the gap, at the slave's nodes.

    Its derivative is a Function in the scalar space of the displacement's degree on the
    slave's mesh, by its dofs on the slave; see `Contact.set_offset`.
    """
    of_type("contact", contact, Contact, "a Contact")
    return OfSlave(contact, "offset", None)


def friction(contact: Contact) -> Control:
    """The coefficient of Coulomb's or Tresca's law.

    Its derivative is a number, or where the coefficient is a field a Function by its
    values at the slave's nodes, as that by the `offset`.
    """
    of_type("contact", contact, Contact, "a Contact")
    law = contact.friction
    if law is None or law.quantity is None:
        raise ContactError(
            f"friction: the contact has {law!r}, and no coefficient of Coulomb or Tresca"
        )
    return OfSlave(contact, "friction", 1.0 if law.field is None else None)


def gamma(contact: Contact) -> Control:
    """The coefficient of a penalty that is a number: traction per penetration."""
    of_type("contact", contact, Contact, "a Contact")
    value = contact.gamma
    if not isinstance(contact.method, Penalty) or not isinstance(value, float):
        raise ContactError(
            f"gamma: the contact has {contact.method!r}: with a multiplier solutions "
            "hardly depend on gamma, and of a penalty it must be a number, "
            "Penalty(gamma=...)"
        )
    return OfSlave(contact, "gamma", value)


def radius(body: Body) -> Control:
    """The radius of a rigid `Circle`, `Sphere` or `Cylinder`, about its centre."""
    _require_led("radius", body)
    if not isinstance(body.shape, (Circle, Sphere, Cylinder)):
        raise ContactError(
            f"radius: a {type(body.shape).__name__} has none: a Circle, Sphere or "
            "Cylinder has"
        )
    return OfTool(body, ("size",))


def place(body: Body) -> Control:
    """The place of a rigid tool, in all states of its motion.

    Its derivative is by the translation, and by the rotation about the centre before
    any motion: (3,) in 2D, (6,) in 3D.
    """
    _require_led("place", body)
    if isinstance(body.shape, (Surface, Polyline)):
        raise ContactError(
            f"place: facets of a {type(body.shape).__name__} cut segments, whose motion "
            "is left out: take a shape of closed form"
        )
    return OfTool(body, ("shift", "turn"))


def _require_led(name: str, body: Any) -> None:
    """Raise unless something is a body whose motion is prescribed."""
    of_type("body", body, Body, "a rigid.Body")
    if body.is_free:
        raise ContactError(
            f"{name}: the rigid {body.name} is free, and equilibrium places it"
        )
