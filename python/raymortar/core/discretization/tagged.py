"""Facets of every slave tag and of its masters, on one mesh or on several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mpi4py import MPI

import numpy as np

from ..errors import ContactError, spoken_tag, together
from ..hooks import hooks
from ..target import Target
from .facets import Facets, join, off_axis, tagged_facets
from .joined import parts_of
from .surfaces import Smooth, Surface, build_surface


@dataclass(frozen=True)
class Part:
    """Facets of a tag and of a body.

    Attributes
    ----------
    tag
        Their tag; None: they have none.
    body
        Number of their body, where facets of the tag are of several or have no tag;
        else None.
    """

    tag: int | None
    body: int | None


_NONE = np.empty(0, dtype=np.int32)
NO_FACETS = Facets(-1, _NONE, _NONE, _NONE)
# In place of a tag: all exterior facets
ALL = "all"


@dataclass(frozen=True)
class Group:
    """A slave surface by its tag, or `ALL`, and the masters that it meets."""

    slave: int | str
    masters: tuple[Any, ...]

    @property
    def meets_itself(self) -> bool:
        """Whether slave and master are the same facets."""
        return self.masters == (self.slave,)


@dataclass
class ZoneFacets:
    """A slave tag, the master tags it meets, and their facets on this rank."""

    slave_tag: int | str
    master_tags: tuple[int | str, ...] | tuple[Target, ...]
    slave: Facets
    masters: list[Facets]
    slave_surface: Surface
    master_surface: Surface
    master: Facets  # of all tags, in the order of the surface
    slave_part: int = 0  # which of several meshes
    master_part: int = 0
    bodies: tuple[Target, ...] = ()  # rigid ones in place of masters
    share_vertices: bool = False  # the two sides
    # Parts of a surface that meets itself, by number in `Surface.zone`
    parts: tuple[Part, ...] = ()
    names: Mapping[int, str] = field(default_factory=dict)  # by tag
    has_tips: bool = False  # nodes of both sides, which are faces of a crack

    @property
    def meets_itself(self) -> bool:
        """Whether slave and master are the same facets."""
        return self.slave_surface is self.master_surface

    @property
    def spoken(self) -> str:
        """The slave, for messages."""
        return f"slave {self.words(self.slave_tag)}"

    @property
    def spoken_masters(self) -> list[str]:
        """Each master, for messages."""
        if self.bodies:
            return [f"the rigid {body.name}" for body in self.bodies]
        return [f"master {self.words(tag)}" for tag in self.master_tags]

    def words(self, tag: Any) -> str:
        """A tag, for messages."""
        return spoken_tag(tag, self.names.get(tag))

    @property
    def sides(self) -> tuple[Surface, Surface]:
        """Surfaces of slave and masters."""
        return self.slave_surface, self.master_surface


def find_facets(
    u: Any,
    facet_tags: Any,
    groups: Sequence[Group],
    axisymmetric: bool = False,
    smooth: Smooth = False,
    may_share: bool = False,
    may_crack: bool = False,
    names: Mapping[int, str] = {},
) -> list[ZoneFacets]:
    """Facets of every zone, by the masters of its slave tag, checked. Collective.

    The sides of a zone may share vertices or not. Names are by tag.
    """
    tagged, zones = Tagged(u, facet_tags, names), []
    for group in groups:
        slave_tag, given = group.slave, group.masters
        bodies = tuple(master for master in given if isinstance(master, Target))
        a = tagged.mesh_of((slave_tag,))
        b = a if bodies or slave_tag == ALL else tagged.mesh_of(given)
        slaves, labels = tagged.parts(u, a, slave_tag, axisymmetric)
        slave, masters = join(slaves) if slave_tag == ALL else slaves[0], [NO_FACETS]
        if group.meets_itself:
            masters = slaves
        elif not bodies:
            masters = [tagged.facets(b, tag, "master") for tag in given]
        for k, facets in ((a, slave), *((b, master) for master in masters)):
            for check in hooks.on_facets:
                check(tagged.meshes[k], facets)
        shares, tips = group.meets_itself, False
        for master in masters if a == b and not bodies and not shares else []:
            at = hooks.shared(tagged.meshes[a], slave, master, may_share, may_crack)
            shares, tips = shares or at[0], tips or at[1]
        surface = _surface(u, tagged.meshes[a], slaves, a, axisymmetric, smooth)
        other = surface
        if not group.meets_itself:
            other = _surface(u, tagged.meshes[b], masters, b, axisymmetric, smooth)
        sides = slave_tag, given, slave, masters, surface, other, join(masters)
        found = a, b, bodies, shares, labels, names, tips
        zones.append(ZoneFacets(*sides, *found))
    for look in (*hooks.on_zones, *(hooks.on_revolved if axisymmetric else ())):
        look(u, zones)
    return zones


def _surface(
    u: Any, mesh: Any, parts: list[Facets], k: int, axisymmetric: bool, smooth: Smooth
) -> Surface:
    """Arrays of the facets of one side, on the k-th mesh. Collective."""
    surface = build_surface(u, parts, k, axisymmetric)
    if smooth and surface.is_straight and parts[0] is not NO_FACETS:
        assert hooks.curve is not None, "the core alone curves no facets"
        curved: Surface = hooks.curve(surface, mesh, join(parts), smooth)
        return curved
    return surface


class Tagged:
    """Facets by tag, of MeshTags on one mesh or of a list on several. Collective."""

    def __init__(self, u: Any, facet_tags: Any, names: Mapping[int, str]) -> None:
        self.names = names
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
        name = self.names.get(tag)
        return tagged_facets(self.meshes[k], self._tags[k], tag, role, name)

    def parts(
        self, u: Any, k: int, tag: int | str, axisymmetric: bool
    ) -> tuple[list[Facets], tuple[Part, ...]]:
        """Facets with a tag, or all facets, and what they are. Collective.

        Those on the axis of a solid of revolution are no surface.
        """
        if not isinstance(tag, str):
            return [self.facets(k, tag, "slave")], (Part(tag, None),)
        assert hooks.all_facets is not None, "the core alone pairs tags only"
        sets, parts = hooks.all_facets(u, self.meshes[k], self._tags[k])
        if axisymmetric:
            sets = [off_axis(self.meshes[k], facets) for facets in sets]
        return sets, parts

    def mesh_of(self, tags: tuple[int | str, ...]) -> int:
        """Number of the mesh that has facets with given tags; 0 if none has."""
        if len(self.meshes) == 1:
            return 0
        for look in hooks.on_meshes:
            look(self, tags)
        return next((k for k, some in enumerate(self.having(tags)) if some), 0)

    def having(self, tags: Sequence[int | str]) -> list[set[int | str]]:
        """Sort some tags by the mesh that has facets with them."""
        here = [
            {tag for tag in tags if np.any(getattr(one, "values", []) == tag)}
            for one in self._tags
        ]
        return [set().union(*self.comm.allgather(found)) for found in here]
