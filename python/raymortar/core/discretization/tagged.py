"""Facets of every slave tag and of its masters, and of all bodies, on one mesh or on several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices
from ..errors import ContactError, spoken_tag, together
from ..hooks import hooks
from ..target import Target
from . import checks
from .facets import (
    N_CORNERS,
    Facets,
    Global,
    all_exterior_facets,
    check_tags,
    join,
    middle_normals,
    tagged_facets,
    units,
)
from .joined import parts_of
from .ranks import index_among, of_all
from .surfaces import Bodies, Smooth, Surface, build_surface, find_bodies

# Coordinates of bodies that differ by less than this share of the model's size are the
# same: nodes on round bodies that are alike need not be
_SAME_PLACE = 1e-3
# Facets that share a vertex and turn away from each other by more than 45 degrees, their
# middles behind each other, have a wedge of material between them
_SHARP, _IN_PLANE = np.cos(np.pi / 4.0), 1e-6


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


def all_facets(
    u: Any, mesh: Mesh, facet_tags: Any
) -> tuple[list[Facets], tuple[Part, ...]]:
    """Sort all exterior facets of a mesh by tag and body. Collective.

    Tags may be None. Parts are the same on all ranks, and bodies are numbered by the
    place of their middle.
    """
    if facet_tags is not None:
        check_tags(mesh, facet_tags)
    facets, _ = all_exterior_facets(mesh)
    tags = _tags(facets, facet_tags)
    bodies = find_bodies(u.function_space)
    number = _by_place(u, bodies)[
        bodies.dofs[compat.dofmap_array(u.function_space)[facets.cells, 0]]
    ]
    rows = np.column_stack([tags, number])
    known = np.unique(of_all(mesh.comm, np.unique(rows, axis=0))[0], axis=0)
    of_tag = known[:, 0].tolist()
    parts, chosen = [], []
    for tag, body in known.tolist():
        alone = tag >= 0 and of_tag.count(tag) == 1
        parts.append(Part(None if tag < 0 else tag, None if alone else body))
        mine = facets.some((rows == (tag, body)).all(axis=1))
        chosen.append(replace(mine, tag=tag))
    return chosen, tuple(parts)


def _tags(facets: Facets, facet_tags: Any) -> Global:
    """Tag of each facet, -1: none."""
    if facet_tags is None:
        return np.full(len(facets.facets), -1)
    place = index_among(facet_tags.indices, facets.facets)
    return np.append(facet_tags.values, -1).astype(np.int64)[place]


def _by_place(u: Any, bodies: Bodies) -> Indices:
    """Number of each body in the order of the middles of their boxes. Collective.

    Means of nodes depend on the mesh, which another unit of length may change.
    """
    V = u.function_space
    n = V.dofmap.index_map.size_local
    x, body = V.tabulate_dof_coordinates()[:n], bodies.dofs[:n]
    ends = np.full((bodies.count, 6), np.inf)
    np.minimum.at(ends, body, np.column_stack([x, -x]))
    V.mesh.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    size = float(-ends.min(axis=0).reshape(2, 3).sum(axis=0).min())
    order = in_order(0.5 * (ends[:, :3] - ends[:, 3:]), _SAME_PLACE * size)
    return np.argsort(order).astype(np.int32)


def levels(coordinates: Array, tolerance: float) -> npt.NDArray[np.int64]:
    """Whole numbers in the order of each coordinate, (n, d), equal where values next to
    each other differ by no more than a tolerance."""
    order = np.argsort(coordinates, axis=0, kind="stable")
    steps = np.diff(np.take_along_axis(coordinates, order, axis=0), axis=0)
    counts = np.cumsum(steps > tolerance, axis=0)
    found = np.zeros(coordinates.shape, dtype=np.int64)
    np.put_along_axis(found, order[1:], counts, axis=0)
    return found


def in_order(places: Array, tolerance: float) -> Indices:
    """Order of places (n, 3) by x, then y, then z, whose values may be off by rounding.

    Values next to each other that differ by no more than the tolerance are the same.
    """
    return np.lexsort(levels(places, tolerance).T[::-1])


def corner_ids(surface: Surface) -> Global:
    """Global numbers of the corners of facets, (n_facets, n)."""
    corners = surface.facet_dofs[:, : N_CORNERS[surface.shape]]
    return surface.dof_ids[corners]


def facets_that_never_meet(
    slave: Surface, master: Surface, comm: MPI.Comm
) -> tuple[Global, Global]:
    """List the master facets of all ranks that each slave facet never meets.

    They are itself and those beyond a sharp edge or corner, behind which the material
    is [theory (3.14)]. Returns offsets (slave facets + 1,) and global numbers,
    ascending for each slave facet. Collective.
    """
    middles, n = _middles(master)
    ids, corners, middles, n = of_all(
        comm, master.facet_ids, corner_ids(master), middles, n
    )
    mine, mine_n = _middles(slave)
    row, other = _pairs_at_vertices(corner_ids(slave), corners)
    way = middles[other] - mine[row]
    cosine = np.einsum("pd,pd->p", mine_n[row], n[other])
    # Height of either middle over the other facet, relative to their distance, but to the
    # facet's size where that is larger: closed faces of a crack differ by rounding alone
    size = np.linalg.norm(slave.nodes[:, 0] - mine, axis=1)
    length = np.maximum(np.linalg.norm(way, axis=1), size[row])
    heights = np.einsum("pd,kpd->kp", way, np.array([mine_n[row], -n[other]])) / length
    is_notch = (heights > -_IN_PLANE).all(axis=0)
    never = (slave.facet_ids[row] == ids[other]) | ((cosine < _SHARP) & ~is_notch)
    row, number = row[never], ids[other[never]]
    order = np.lexsort([number, row])
    offsets = np.searchsorted(row[order], np.arange(len(mine) + 1))
    return offsets.astype(np.int64), number[order].astype(np.int64)


def _middles(surface: Surface) -> tuple[Array, Array]:
    """Middles of the undeformed facets, by their corners, and unit normals, (n, d)."""
    nodes = surface.nodes[:, : N_CORNERS[surface.shape]]
    return nodes.mean(axis=1), units(middle_normals(surface.shape, 1, nodes))


def _pairs_at_vertices(mine: Global, others: Global) -> tuple[Indices, Indices]:
    """Rows of two tables (facets, corners) that have a number in common, each once."""
    from scipy.sparse import csr_array

    corners = np.concatenate([mine, others])
    known, number = np.unique(corners, return_inverse=True)
    row = np.repeat(np.arange(len(corners)), corners.shape[1])
    shape = len(corners), len(known)
    has = csr_array((np.ones(len(row)), (row, number.ravel())), shape=shape)
    row, met = (has[: len(mine)] @ has[len(mine) :].T).nonzero()
    return row, met


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
    if axisymmetric:
        checks.check_half_plane(u)
    tagged, gdim = Tagged(u, facet_tags, names), u.function_space.mesh.geometry.dim
    zones = []
    for group in groups:
        slave_tag, given = group.slave, group.masters
        bodies = tuple(master for master in given if isinstance(master, Target))
        a = tagged.mesh_of((slave_tag,))
        b = a if bodies or slave_tag == ALL else tagged.mesh_of(given)
        slaves, labels = tagged.parts(u, a, slave_tag, axisymmetric)
        slave, masters = join(slaves) if slave_tag == ALL else slaves[0], [NO_FACETS]
        for body in bodies:
            if body.shape.gdim not in (None, gdim):
                raise ContactError(
                    f"the rigid {type(body.shape).__name__} that slave "
                    f"{tagged.spoken(slave_tag)} meets is made for "
                    f"{body.shape.gdim}D, the mesh is in {gdim}D"
                )
        if axisymmetric:
            checks.check_revolved(bodies)
        if group.meets_itself:
            masters = slaves
        elif not bodies:
            masters = [tagged.facets(b, tag, "master") for tag in given]
        for k, facets in ((a, slave), *((b, master) for master in masters)):
            checks.check_areas(tagged.meshes[k], facets)
            checks.check_cells(tagged.meshes[k], facets)
            if axisymmetric:
                checks.check_off_axis(tagged.meshes[k], facets)
        shares, tips = group.meets_itself, False
        for master in masters if a == b and not bodies and not shares else []:
            if not may_share:
                tips |= checks.check_pair(tagged.meshes[a], slave, master, may_crack)
            elif checks.shared_vertices(tagged.meshes[a], slave, master)[0]:
                shares = True
        surface = _surface(u, tagged.meshes[a], slaves, a, axisymmetric, smooth)
        other = surface
        if not group.meets_itself:
            other = _surface(u, tagged.meshes[b], masters, b, axisymmetric, smooth)
        sides = slave_tag, given, slave, masters, surface, other, join(masters)
        found = a, b, bodies, shares, labels, names, tips
        zones.append(ZoneFacets(*sides, *found))
    with together(tagged.comm):
        if len({zone.slave_part for zone in zones}) > 1:
            raise ContactError(
                f"the slave {tagged.spoken(*(z.slave_tag for z in zones))} are on "
                "different meshes: the multiplier has one, so swap slave and master of "
                "some pairs"
            )
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
        self._names = names
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
        name = self._names.get(tag)
        return tagged_facets(self.meshes[k], self._tags[k], tag, role, name)

    def spoken(self, *tags: Any) -> str:
        """Tags for messages, with their names."""
        if len(tags) > 1 and not any(tag in self._names for tag in tags):
            return f"tags {list(tags)}"
        return ", ".join(spoken_tag(tag, self._names.get(tag)) for tag in tags)

    def parts(
        self, u: Any, k: int, tag: int | str, axisymmetric: bool
    ) -> tuple[list[Facets], tuple[Part, ...]]:
        """Facets with a tag, or all facets, and what they are. Collective.

        Those on the axis of a solid of revolution are no surface.
        """
        if not isinstance(tag, str):
            return [self.facets(k, tag, "slave")], (Part(tag, None),)
        sets, parts = all_facets(u, self.meshes[k], self._tags[k])
        if axisymmetric:
            sets = [checks.off_axis(self.meshes[k], facets) for facets in sets]
        return sets, parts

    def mesh_of(self, tags: tuple[int | str, ...]) -> int:
        """Number of the mesh that has facets with given tags; 0 if none has."""
        if len(self.meshes) == 1:
            return 0
        with together(self.comm):
            if ALL in tags:
                raise ContactError(
                    "pairs='all' is for bodies on one mesh, and the displacement is on "
                    f"{len(self.meshes)}: name the pairs, or join the meshes"
                )
        here = [
            {tag for tag in tags if np.any(getattr(one, "values", []) == tag)}
            for one in self._tags
        ]
        have = [set().union(*self.comm.allgather(found)) for found in here]
        found = [k for k, some in enumerate(have) if some]
        with together(self.comm):
            for tag in tags:
                if sum(tag in some for some in have) > 1:
                    raise ContactError(
                        f"facets with the {self.spoken(tag)} are on several meshes: use "
                        "each tag number on one mesh only"
                    )
            if len(found) > 1:
                raise ContactError(
                    f"facets with the {self.spoken(*tags)} are on several meshes, and the "
                    "masters of one slave have to be on one: make a Contact for each of "
                    "these, and give NonlinearProblem the list of contacts"
                )
        return found[0] if found else 0
