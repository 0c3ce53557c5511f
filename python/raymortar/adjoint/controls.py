"""What functionals are differentiated by: coefficients of forms, parameters of contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dolfinx import fem

from ..core import compat
from ..core.compat import Array
from ..core.contact import Contact
from ..core.errors import ContactError, of_type
from ..core.interface.point_results import OPEN
from ..rigid import Body, Circle, Cylinder, Sphere
from ..rigid.polyline import Polyline
from ..rigid.surface import Surface
from .forms import by_constant, by_coordinates, by_function, has
from .linear import Linearised


class Control(ABC):
    """A parameter. Derivatives of several steps are added up in `start`'s arrays."""

    def require_in(self, forms: Sequence[Any]) -> None:
        """Raise unless it is in one of the forms, if it should be."""

    @abstractmethod
    def start(self, problem: Any) -> Array:
        """Check that the problem has it; its derivative before any step: zeros."""

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        """Derivative of some functionals in UFL, times a sign each. Collective."""
        return 0.0

    def by_contact(self, at: Linearised) -> Array | float:
        """Derivative of contact's residual, times the weights of `at`. Collective."""
        return 0.0

    def result(self, found: Array) -> Any:
        """What the user gets of the whole derivative."""
        return found


class OfForm(Control):
    """A Constant or a Function that is a coefficient of the forms."""

    def __init__(self, given: Any) -> None:
        self._given, self._is_function = given, isinstance(given, fem.Function)

    def require_in(self, forms: Sequence[Any]) -> None:
        if not any(has(form, self._given) for form in forms):
            name = self._given.name if self._is_function else "a Constant"
            raise ContactError(
                f"controls: {name} is neither in the forms of the problem nor in J"
            )

    def start(self, problem: Any) -> Array:
        given, unknowns = self._given, problem.contact.unknowns
        if any(given is f for f in unknowns.functions):
            raise ContactError(f"controls: {given.name} is an unknown of the problem")
        if self._is_function:
            return np.zeros(len(given.x.array))
        meshes = [f.function_space.mesh for f in unknowns.functions]
        fits = [m for m in meshes if m.ufl_domain() == given.ufl_domain()]
        if not fits:
            raise ContactError(
                "controls: a Constant is on a mesh that no unknown of the problem is on"
            )
        self._mesh = fits[0]
        return np.zeros(given.ufl_shape)

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        found: Array | float = 0.0
        for form, sign in zip(forms, signs):
            if not has(form, self._given):
                continue
            if self._is_function:
                found = found + sign * by_function(form, self._given)
            else:
                found = found + sign * by_constant(form, self._given, self._mesh)
        return found

    def result(self, found: Array) -> Any:
        if not self._is_function:
            return float(found) if found.ndim == 0 else found
        return function_of(self._given.function_space, found)


class OfSlave(Control):
    """A field on the slave: its offset, or its friction coefficient."""

    def __init__(self, contact: Contact, component: int, is_number: bool) -> None:
        self._contact, self._component = contact, component
        self._is_number = is_number

    def start(self, problem: Any) -> Array:
        contact, unknowns = self._contact, problem.contact.unknowns
        require_contact(problem, contact)
        slave_u = contact.surfaces.slave_u
        own = [d.u for d in unknowns.displacements]
        self._k = [u.function_space is slave_u.function_space for u in own].index(True)
        V = slave_u.function_space
        degree = compat.element_info(V).degree
        self._V = compat.scalar_space(V.mesh, degree)
        self._d = V.mesh.geometry.dim
        return np.zeros(1 if self._is_number else len(slave_u.x.array) // self._d)

    def by_contact(self, at: Linearised) -> Array | float:
        values = at.of_displacement(at.fields(self._contact), self._k)
        nodal: Array = values.reshape(-1, self._d)[:, self._component]
        if not self._is_number:
            return nodal
        own = self._V.dofmap.index_map.size_local
        return np.atleast_1d(at.problem.comm.allreduce(nodal[:own].sum()))

    def result(self, found: Array) -> Any:
        return float(found[0]) if self._is_number else function_of(self._V, found)


class OfTool(Control):
    """Motions of a rigid tool, and changes of its size that are such motions."""

    def __init__(self, body: Body, is_size: bool) -> None:
        self._body, self._is_size = body, is_size

    def start(self, problem: Any) -> Array:
        zones = [z for z in problem.contact.zones if self._body in z.facets.bodies]
        if not zones:
            raise ContactError(
                f"controls: no contact of the problem meets the rigid {self._body.name}"
            )
        self._zones = zones
        if self._is_size:
            return np.zeros(1)
        return np.zeros(3 if self._body.shape.gdim == 2 else 6)

    def by_contact(self, at: Linearised) -> Array | float:
        d = at.system.u.function_space.mesh.geometry.dim
        found = []
        for kind in ("size",) if self._is_size else ("shift", "turn"):
            found.append(np.zeros(d))
            for zone in self._zones:
                number = zone.facets.bodies.index(self._body)
                poses = self._body.motion(), zone.motions.old[number]
                now, old = (self._motions(kind, d, motion) for motion in poses)
                y = at.by_parameter([zone], "tool", tool=number, now=now, old=old)
                found[-1] += at.owned_sums(y)
                y.destroy()
        if self._is_size:
            return found[0][:1]
        return np.concatenate([found[0], found[1][: 1 if d == 2 else 3]])

    def _motions(self, kind: str, d: int, motion: Array) -> Array:
        """Rows of shift and slope, where the motion of the body is a given one."""
        R, b = self._body.pose_of(motion)
        centre = R @ self._body.centre + b
        if kind == "shift":
            rows = [(np.eye(3)[i], np.zeros((3, 3))) for i in range(d)]
        elif kind == "turn":
            axes = np.eye(3)[2:] if d == 2 else R.T
            slopes = [np.cross(np.eye(3), axis) for axis in axes]
            rows = [(-slope @ centre, slope) for slope in slopes]
        else:
            shape = self._body.shape
            slope = np.eye(3) / shape.radius
            if isinstance(shape, Cylinder):
                axis = R @ (np.array(shape.axis) / np.linalg.norm(shape.axis))
                slope -= np.outer(axis, axis) / shape.radius
            rows = [(-slope @ (R @ shape.place + b), slope)]
        return np.array([np.concatenate([a, B.ravel()]) for a, B in rows])

    def result(self, found: Array) -> Any:
        return float(found[0]) if self._is_size else found


class OfMesh(Control):
    """Undeformed positions of a mesh's nodes."""

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def start(self, problem: Any) -> Array:
        unknowns, mesh = problem.contact.unknowns, self._mesh
        own = [d.u.function_space for d in unknowns.displacements]
        fits = [k for k, V in enumerate(own) if V.mesh is mesh]
        if not fits:
            raise ContactError(
                "coordinates: no displacement of the problem is on this mesh"
            )
        self._k = fits[0]
        p, g = compat.element_info(own[self._k]).degree, compat.geometry_degree(mesh)
        if g > p:
            raise ContactError(
                f"coordinates: the mesh has degree {g} and its displacement {p}, which "
                "does not move all of its nodes"
            )
        for contact in problem.contact.contacts:
            if contact.method.condition == "nodes":
                raise ContactError(
                    "coordinates: a law at nodes, and a dual multiplier, depend on "
                    "undeformed areas in ways that have no derivative here: take "
                    "condition='points' or Penalty"
                )
            if any(side.arcs is not None for z in contact.zones for side in z.sides):
                raise ContactError(
                    "coordinates: smooth=True curves facets by positions"
                )
            if contact.multiplier is not None and any(
                map(_partly_covered, contact.zones)
            ):
                raise ContactError(
                    "coordinates: a slave facet is partly uncovered, where a multiplier "
                    "depends on undeformed areas: take a slave that lies on its master, "
                    "or Penalty"
                )
        self._X = fem.Function(compat.vector_space(mesh, g), name="coordinates")
        self._to_nodes = positions_of_dofs(own[self._k], self._X.function_space)
        return np.zeros(len(self._X.x.array))

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        found: Array | float = 0.0
        for form, sign in zip(forms, signs):
            if form.ufl_domain() == self._mesh.ufl_domain():
                found = found + sign * by_coordinates(form, self._X)
        return found

    def by_contact(self, at: Linearised) -> Array | float:
        """x = X + u at present and at the accepted step, and areas  [theory (8.7)]."""
        zones = at.problem.contact.zones
        y = at.by_unknowns()
        for kind in ("old", "reference"):
            if kind == "reference" or any(zone.frictional for zone in zones):
                more = at.by_parameter(zones, kind)
                y.axpy(1.0, more)
                more.destroy()
        values = at.of_displacement(at.displacements(y), self._k)
        y.destroy()
        return self._to_nodes(values)

    def result(self, found: Array) -> Any:
        return function_of(self._X.function_space, found)


def function_of(V: Any, values: Array) -> Any:
    """A Function with given values of its dofs."""
    f = fem.Function(V, name="gradient")
    f.x.array[:] = values
    return f


def positions_of_dofs(V: Any, nodes: Any) -> Callable[[Array], Array]:
    """Make what takes derivatives by the positions of a displacement's dofs to those by
    the mesh's nodes, ghosted arrays. Collective when it is called."""
    d, mesh = V.mesh.geometry.dim, V.mesh
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    table, of_nodes = compat.dofmap_array(V), compat.dofmap_array(nodes)
    degree = compat.geometry_degree(mesh)
    N = compat.tabulate(compat.cell_name(mesh), degree, compat.element_points(V))[0]
    first, place = np.unique(table.ravel(), return_index=True)
    first, place = (
        first[first < index_map.size_local],
        place[first < index_map.size_local],
    )
    cells, local = np.divmod(place, table.shape[1])

    def to_nodes(values: Array) -> Array:
        vector = compat.create_la_vector(nodes.dofmap.index_map, bs)
        vector.array[:] = 0.0
        own = values.reshape(-1, d)[first]
        parts = N[local][:, :, None] * own[:, None, :]
        np.add.at(vector.array.reshape(-1, d), of_nodes[cells], parts)
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
        return np.array(vector.array)

    return to_nodes


def _partly_covered(zone: Any) -> bool:
    """Whether rays of some points of a facet hit, and others do not, on this rank."""
    points = zone.points()
    hit = points["status"] >= OPEN
    return bool(np.intersect1d(points["slave"][hit], points["slave"][~hit]).size)


def require_contact(problem: Any, contact: Contact) -> None:
    """Raise unless a contact is one of the problem's."""
    if not any(one is contact for one in problem.contact.contacts):
        raise ContactError("controls: a contact is none of the problem's")


def offset(contact: Contact) -> Control:
    """The length that is added to the gap, at the slave's nodes.

    Its derivative is a Function in the scalar space of the displacement's degree on the
    slave's mesh, by its dofs on the slave; see `Contact.set_offset`.
    """
    of_type("contact", contact, Contact, "a Contact")
    return OfSlave(contact, 0, False)


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
    return OfSlave(contact, 1, law.field is None)


def radius(body: Body) -> Control:
    """The radius of a rigid `Circle`, `Sphere` or `Cylinder`, about its centre."""
    body = of_led_body("radius", body)
    if not isinstance(body.shape, (Circle, Sphere, Cylinder)):
        raise ContactError(
            f"radius: a {type(body.shape).__name__} has none: a Circle, Sphere or "
            "Cylinder has"
        )
    return OfTool(body, True)


def place(body: Body) -> Control:
    """The place of a rigid tool, in all states of its motion.

    Its derivative is by the translation, and by the rotation about the centre before
    any motion: (3,) in 2D, (6,) in 3D.
    """
    body = of_led_body("place", body)
    if isinstance(body.shape, (Surface, Polyline)):
        raise ContactError(
            f"place: facets of a {type(body.shape).__name__} cut segments, whose motion "
            "is left out: take a shape of closed form"
        )
    return OfTool(body, False)


def coordinates(mesh: Any) -> Control:
    """Undeformed positions of the nodes of a mesh, for derivatives by shape.

    Its derivative is a Function in the vector space of the geometry's degree: by the
    position of each node. Coefficients of the forms keep their dofs, and `gamma` keeps
    its value.
    """
    return OfMesh(mesh)


def of_led_body(name: str, body: Any) -> Body:
    """Raise unless something is a body whose motion is prescribed."""
    of_type("body", body, Body, "a rigid.Body")
    if body.is_free:
        raise ContactError(
            f"{name}: the rigid {body.name} is free, and equilibrium places it"
        )
    return body


def as_control(given: Any) -> Control:
    """A control of anything that may be one."""
    if isinstance(given, Control):
        return given
    if isinstance(given, (fem.Constant, fem.Function)):
        return OfForm(given)
    raise ContactError(
        "controls must be Constants and Functions of the forms, or those of adjoint such "
        f"as offset(contact), not {given!r}"
    )
