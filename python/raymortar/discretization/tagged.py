"""Facets of every slave tag and of its masters, on one mesh or on several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..errors import ContactError, together
from ..rigid.body import Body
from . import checks
from .curving import Smooth, curve
from .facets import Facets, join, tagged_facets
from .joined import parts_of
from .surfaces import Surface, build_surface

_NONE = np.empty(0, dtype=np.int32)
NO_FACETS = Facets(-1, _NONE, _NONE, _NONE)


@dataclass
class ZoneFacets:
    """A slave tag, the master tags it meets, and their facets on this rank."""

    slave_tag: int
    master_tags: tuple[int, ...] | tuple[Body, ...]
    slave: Facets
    masters: list[Facets]
    slave_surface: Surface
    master_surface: Surface
    master: Facets  # of all tags, in the order of the surface
    slave_part: int = 0  # which of several meshes
    master_part: int = 0
    bodies: tuple[Body, ...] = ()  # rigid ones in place of masters

    @property
    def sides(self) -> tuple[Surface, Surface]:
        """Surfaces of slave and masters."""
        return self.slave_surface, self.master_surface


def find_facets(
    u: Any,
    facet_tags: Any,
    groups: Mapping[int, tuple[Any, ...]],
    axisymmetric: bool = False,
    smooth: Smooth = False,
) -> list[ZoneFacets]:
    """Facets of every zone, by the masters of its slave tag, checked. Collective."""
    if axisymmetric:
        checks.check_half_plane(u)
    tagged, gdim = Tagged(u, facet_tags), u.function_space.mesh.geometry.dim
    zones = []
    for slave_tag, given in groups.items():
        bodies = tuple(master for master in given if isinstance(master, Body))
        a = tagged.mesh_of((slave_tag,))
        b = a if bodies else tagged.mesh_of(given)
        slave, masters = tagged.facets(a, slave_tag, "slave"), [NO_FACETS]
        for body in bodies:
            if body.shape.gdim not in (None, gdim):
                raise ContactError(
                    f"the rigid {type(body.shape).__name__} that slave tag {slave_tag} "
                    f"meets is made for {body.shape.gdim}D, the mesh is in {gdim}D"
                )
        if axisymmetric:
            checks.check_revolved(bodies)
        if not bodies:
            masters = [tagged.facets(b, tag, "master") for tag in given]
        for k, facets in ((a, slave), *((b, master) for master in masters)):
            checks.check_areas(tagged.meshes[k], facets)
            checks.check_cells(tagged.meshes[k], facets)
            if axisymmetric:
                checks.check_off_axis(tagged.meshes[k], facets)
        for master in masters if a == b and not bodies else []:
            checks.check_pair(tagged.meshes[a], slave, master)
        surface, other = (
            _surface(u, tagged.meshes[k], parts, k, axisymmetric, smooth)
            for k, parts in ((a, [slave]), (b, masters))
        )
        surfaces, joined = (surface, other), join(masters)
        zones.append(
            ZoneFacets(
                slave_tag, given, slave, masters, *surfaces, joined, a, b, bodies
            )
        )
    with together(tagged.comm):
        if len({zone.slave_part for zone in zones}) > 1:
            raise ContactError(
                f"the slave tags {[zone.slave_tag for zone in zones]} are on different "
                "meshes: the multiplier has one, so swap slave and master of some pairs"
            )
    return zones


def _surface(
    u: Any, mesh: Any, parts: list[Facets], k: int, axisymmetric: bool, smooth: Smooth
) -> Surface:
    """Arrays of the facets of one side, on the k-th mesh. Collective."""
    surface = build_surface(u, parts, k, axisymmetric)
    if smooth and surface.is_straight and parts[0] is not NO_FACETS:
        return curve(surface, mesh, join(parts), smooth)
    return surface


class Tagged:
    """Facets by tag, of MeshTags on one mesh or of a list on several. Collective."""

    def __init__(self, u: Any, facet_tags: Any) -> None:
        self.meshes = [part.function_space.mesh for part in parts_of(u)]
        self.comm: MPI.Comm = self.meshes[0].comm
        n, is_list = len(self.meshes), isinstance(facet_tags, (list, tuple))
        with together(self.comm):
            if n > 1 and not (is_list and len(facet_tags) == n):
                raise ContactError(
                    f"facet_tags must be a list of {n}, one for each mesh"
                )
        self._tags = list(facet_tags) if n > 1 else [facet_tags]

    def facets(self, k: int, tag: int, role: str) -> Facets:
        """Facets with a tag on the k-th mesh, after checks."""
        return tagged_facets(self.meshes[k], self._tags[k], tag, role)

    def mesh_of(self, tags: tuple[int, ...]) -> int:
        """Number of the mesh that has facets with given tags; 0 if none has."""
        if len(self.meshes) == 1:
            return 0
        here = [
            {tag for tag in tags if np.any(getattr(one, "values", []) == tag)}
            for one in self._tags
        ]
        have = [set().union(*self.comm.allgather(found)) for found in here]
        found = [k for k, some in enumerate(have) if some]
        with together(self.comm):
            if len(found) > 1:
                raise ContactError(
                    f"facets with the tags {list(tags)} are on several meshes: a tag has "
                    "to be on one, and so have the masters of one slave. For masters on "
                    "several meshes make a Contact for each of these, and give "
                    "NonlinearProblem the list of contacts"
                )
        return found[0] if found else 0
