"""Arguments of a contact: sides that lead or can be touched, meshes and displacements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function, FunctionSpace
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.discretization.facets import FACET_SHAPE
from ..core.discretization.tagged import ALL, Group
from ..core.errors import (
    ContactError,
    is_whole_number,
    raise_everywhere,
    spoken_tag,
    together,
)
from ..core.interface.contact_surfaces import Given
from ..core.interface.pairs import Pair, names_by_tag, plain
from ..core.options.methods import ContactOptions, Penalty
from ..core.target import Target, as_target


def check_pairs(pairs: Sequence[tuple[Any, Any]], names: Mapping[Any, str]) -> None:
    """Refuse sides that are no tags or targets, and pairs that cannot be beside each
    other."""
    # Masters by slave, and by whether the slave meets itself
    groups: dict[tuple[Any, bool], list[Any]] = {}
    for one, other in pairs:
        _check_tags(one, other)
        slave, master = plain(one), plain(other)
        masters = groups.setdefault((slave, slave == master), [])
        _check_order(slave, master, groups, names)
        masters.append(master)


def _check_tags(slave: Any, master: Any) -> None:
    """Raise unless both sides are tags, or the master a rigid body."""
    if as_target(slave) is not None:
        raise ContactError(
            f"{slave!r} is the slave of a pair: a rigid shape has no facets to "
            "integrate over, so it can be a master only"
        )
    for tag in (slave, master):
        if isinstance(tag, type) and ".rigid" in tag.__module__:
            raise ContactError(
                f"pairs has the class rigid.{tag.__name__}, not a shape made of it, as "
                f"rigid.{tag.__name__}(...)"
            )
        if not (is_whole_number(tag) or isinstance(tag, (Target, str))):
            raise ContactError(f"pairs has the tag {tag!r}, which is no whole number")
    if ALL in [tag for tag in (slave, master) if isinstance(tag, str)]:
        others = [tag for tag in (slave, master) if is_whole_number(tag)]
        if others:
            raise ContactError(
                f"pairs has 'all' with tag {others[0]}: all facets, that tag's among "
                "them, meet each other by pairs='all'"
            )


def _check_order(
    slave: Any,
    master: Any,
    groups: Mapping[tuple[Any, bool], list[Any]],
    names: Mapping[Any, str],
) -> None:
    """Raise for a pair that cannot be beside the earlier ones."""
    if slave in groups.get((master, False), []):
        both = [names.get(tag, tag) for tag in (master, slave)]
        raise ContactError(
            f"pair ({', '.join(map(str, both))}) is given in both orders: their contact "
            "would be counted twice"
        )
    others = groups[slave, slave == master]
    if any(isinstance(m, Target) != isinstance(master, Target) for m in others):
        raise ContactError(
            f"slave {spoken_tag(slave, names.get(slave))} has masters with tags and "
            "rigid ones: give each kind its own Contact, NonlinearProblem(F, "
            "[one, other])"
        )


def _check_beside_all(pairs: Sequence[Pair]) -> None:
    """Raise for a pair that is one of those of all facets."""
    masters = [pair.master for pair in pairs if pair.slave == ALL]
    for pair in pairs:
        meshed = not isinstance(pair.master, Target) and ALL in masters
        if pair.slave != ALL and (meshed or pair.master in masters):
            raise ContactError(
                f"pair {pair} is one of those of 'all': its contact would be counted "
                "twice; leave it out, or name all pairs"
            )


def check_arguments(given: Given) -> None:
    """Refuse displacements, and pairs of surfaces, that contact cannot handle.
    Collective."""
    groups, tied = given.groups, given.tied
    meshes = given.unknowns.displacements
    with together(given.unknowns.comm):
        names = names_by_tag(given.pairs.names_at(0))
        _check_beside_all(given.pairs.pairs)
        _require_leader(groups, given.options, tied, names, len(meshes))
        _require_surfaces(groups, tied)
    for part in meshes:
        check_space(part.u)


def _require_surfaces(groups: Sequence[Group], tied: str | None) -> None:
    """Raise for contact with a body that nothing can touch."""
    for group in groups if tied is None else []:
        for body in group.masters:
            if isinstance(body, Target) and not body.has_surface:
                raise ContactError(
                    f"the rigid {body.name} is a Frame, which has no surface to touch: "
                    "let a surface follow it by Tie(u, facet_tags, [(slave, body)])"
                )


def _require_leader(
    groups: Sequence[Group],
    options: ContactOptions,
    tied: str | None,
    names: Mapping[Any, str],
    meshes: int,
) -> None:
    """Raise for a surface that meets itself, or has facets of another one, if the method
    needs a slave."""
    if tied is None and isinstance(options.method, Penalty):
        return
    for group in groups:
        if not group.meets_itself:
            if group.slave == ALL and len(groups) > 1:
                raise ContactError(
                    "pairs has slave 'all' beside others, whose facets it has too, and a "
                    "multiplier is of one slave: give each its own Contact, "
                    "NonlinearProblem(F, [one, other])"
                )
            continue
        if group.slave == ALL:
            raise ContactError(
                "pairs has 'all', where each facet is slave and master, and a multiplier "
                "needs one side that leads: take method=Penalty(), or ('all', tool) alone, "
                "where the tool leads"
            )
        several = "use each tag number on one mesh only, or, if one surface is meant, "
        raise ContactError(
            f"{spoken_tag(group.slave, names.get(group.slave))} is slave and master of "
            f"the same pair: {several if meshes > 1 else ''}split it into two tags that "
            "share no vertex, of which the slave leads, or take method=Penalty(), which "
            "needs no side that leads"
        )


def _mesh_fault(mesh: Mesh) -> str | None:
    """A message on a mesh that cannot be used; None if it can."""
    gdim, cell = mesh.geometry.dim, compat.cell_name(mesh)
    if gdim not in (2, 3):
        return f"the mesh is in a space of dimension {gdim}; contact needs 2 or 3"
    if mesh.topology.dim != gdim:
        return (
            f"cells of dimension {mesh.topology.dim} in a space of dimension {gdim}: "
            "shells, membranes and beams are not supported"
        )
    if cell not in FACET_SHAPE:
        known = ", ".join(FACET_SHAPE)
        return f"the mesh has {cell} cells; supported are meshes of one of {known}"
    degree = compat.geometry_degree(mesh)
    if degree > 2:
        return f"the geometry of the mesh has degree {degree}; supported are 1 and 2"
    return None


def element_fault(V: FunctionSpace, shape: Any = None, needed: str = "") -> str | None:
    """Return what is wrong with the element of a field, None if nothing is.

    It must be continuous Lagrange of degree 1 or 2. Its values must have the shape, if
    one is given; the message says what needs it.
    """
    info = compat.element_info(V)
    faults = {
        "is mixed or holds values at quadrature points: give the part that is meant, as "
        "w.sub(1)": info.is_mixed,
        f"is of {V.ufl_element()}, not a Lagrange element": not info.is_lagrange,
        "is discontinuous: it must be a continuous Lagrange Function": (
            info.is_discontinuous
        ),
        f"has values of shape {info.value_shape}; {needed}": (
            shape is not None and info.value_shape != shape
        ),
        f"has degree {info.degree}; supported are 1 and 2": info.degree not in (1, 2),
    }
    return next((text for text, is_bad in faults.items() if is_bad), None)


def check_fields(name: str, fields: Any, shape: Any = None, needed: str = "") -> None:
    """Raise unless an argument has Functions of elements that are supported, or parts
    of mixed ones that are. Collective."""
    for f in fields:
        if not isinstance(f, Function):
            raise ContactError(f"{name} must be a Function, not {type(f).__name__}")
        V = f.function_space
        if compat.element_info(V).is_sub_space:
            V, _ = compat.collapsed(V)
        fault = element_fault(V, shape, needed)
        if fault is not None:
            raise ContactError(f"{name}, {f.name}, {fault}")


def _value_fault(u: Function) -> str | None:
    """A message on values of this rank that are not finite; None if all are."""
    values = u.x.array
    if not compat.scalar_type_is_real() or values.dtype != np.float64:
        kind = values.dtype if compat.scalar_type_is_real() else "complex PETSc"
        return f"contact needs real numbers in double precision, not {kind}"
    count = int(np.sum(~np.isfinite(values)))
    return f"the displacement has {count} value(s) not finite" if count > 0 else None


def check_space(u: Function) -> None:
    """Refuse displacements that raymortar cannot handle."""
    V = u.function_space
    shape, message = (V.mesh.geometry.dim,), _mesh_fault(V.mesh)
    if compat.element_info(V).is_sub_space:
        message = (
            message or "the displacement is a view into a larger space: collapse it"
        )
    fault = element_fault(V, shape, f"contact needs vectors of shape {shape}")
    message = message or (f"the displacement {fault}" if fault else _value_fault(u))
    raise_everywhere(V.mesh.comm, message)
