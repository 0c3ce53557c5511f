"""Tagged facets: their tags, their size and that of their cells, on one mesh or several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.discretization import facets as lookup
from ..core.discretization.facets import (
    FACET_SHAPE,
    FACETS_PER_CELL,
    Facets,
    coordinates,
    facets_of_mesh,
    midpoints,
    normals,
)
from ..core.discretization.ranks import count_marks
from ..core.discretization.surfaces import facet_areas
from ..core.discretization.tagged import ALL, Tagged, ZoneFacets
from ..core.errors import (
    ContactError,
    format_point,
    raise_everywhere,
    spoken_tag,
    together,
)

# A facet narrower than this fraction of its cell has no usable normal.
MIN_RELATIVE_WIDTH = 1e-12
# A cell thinner than this fraction of its edges has no volume.
MIN_RELATIVE_VOLUME = 1e-12
# A volume element of the other sign counts as zero below this share of the largest one:
# three vertices on a line give a zero with a rounding error.
MAX_FOLD = 1e-8


def check_tags(mesh: Mesh, facet_tags: Any, tag: int | None, spoken: str) -> None:
    """Refuse what are no tags of facets of a mesh, and a tag, if one is given, that does
    not occur or is inside a body. Collective."""
    _check_mesh(mesh, facet_tags)
    if tag is not None:
        _check_tag(mesh, facet_tags, tag, spoken)
        _check_exterior(mesh, _interior(mesh, facet_tags, tag), tag, spoken)


def _interior(mesh: Mesh, facet_tags: Any, tag: int) -> Indices:
    """Facets with a tag between two cells of which this rank owns one. Collective."""
    exterior, tdim = compat.exterior_facets(mesh), mesh.topology.dim
    # Without ghost cells a facet between two ranks has one local cell on each, so
    # the number of local cells does not tell inside from outside.
    others = np.setdiff1d(facet_tags.indices[facet_tags.values == tag], exterior)
    links = compat.connectivity(mesh, tdim - 1, tdim)
    owned = links.array < mesh.topology.index_map(tdim).size_local
    before = np.concatenate([[0], np.cumsum(owned)])[links.offsets]
    return others[before[others + 1] > before[others]]


def _check_mesh(mesh: Mesh, facet_tags: Any) -> None:
    """Refuse what are no tags, and tags of another dimension or mesh. Collective."""
    comm, tdim = mesh.comm, mesh.topology.dim
    with together(comm):
        if not all(hasattr(facet_tags, name) for name in ("dim", "indices", "values")):
            raise ContactError(
                f"facet_tags must be MeshTags, not {type(facet_tags).__name__}"
            )
        if facet_tags.dim != tdim - 1:
            raise ContactError(
                f"facet_tags are tags of entities of dimension {facet_tags.dim}; facets "
                f"of this mesh have dimension {tdim - 1}"
            )
        if not compat.on_mesh(facet_tags, mesh):
            raise ContactError("facet_tags are of another mesh than the displacement")


def _check_tag(mesh: Mesh, facet_tags: Any, tag: int, spoken: str) -> None:
    """Refuse an unknown tag. Collective."""
    comm = mesh.comm
    known = sorted(set().union(*comm.allgather(np.unique(facet_tags.values).tolist())))
    message = f"no facet has the {spoken}; the tags that exist are {known}"
    raise_everywhere(comm, None if tag in known else message)


def _check_exterior(mesh: Mesh, interior: Indices, tag: int, spoken: str) -> None:
    """Refuse the interior facets that carry the tag. Collective."""
    tdim = mesh.topology.dim
    found = midpoints(mesh, facets_of_mesh(mesh, tag, interior[:1]))
    # A facet between two ranks is found by both
    facet_map = mesh.topology.index_map(tdim - 1)
    marked = count_marks(facet_map, interior)[: facet_map.size_local] > 0
    count = mesh.comm.allreduce(int(marked.sum()))
    with together(mesh.comm):
        if len(found) > 0:
            raise ContactError(
                f"{count} facet(s) with the {spoken} lie inside the body, "
                "between two cells, for example at "
                f"{format_point(found[0], coordinates(mesh))}: contact needs boundary "
                "facets, so the bodies must not share nodes"
            )


def check_facets(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets that contact cannot integrate over. Collective."""
    check_areas(mesh, facets)
    check_cells(mesh, facets)


def _extent(points: Array) -> Array:
    """Diagonal of the bounding box of each set of points (n, n_points, d)."""
    return np.linalg.norm(np.ptp(points, axis=1), axis=-1)


def check_areas(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets without area, or at coordinates that are not finite.

    The width of a facet (its length in 2D, else its area over its diameter) is
    compared with the diameter of its cell: an edge is never short against itself.
    """
    degree, shape = compat.geometry_degree(mesh), FACET_SHAPE[compat.cell_name(mesh)]
    nodes = coordinates(mesh)[lookup.node_table(mesh, facets)]
    area = facet_areas(shape, degree, nodes)
    smallest = MIN_RELATIVE_WIDTH * _extent(lookup.cell_corners(mesh, facets))
    if mesh.geometry.dim == 3:
        smallest = smallest * _extent(lookup.facet_corners(mesh, facets))
    finite = np.isfinite(area) & np.isfinite(smallest)
    # Written so that NaN is bad
    small = finite & ~(area > smallest)
    faults = {"have coordinates not finite": ~finite, "have no area": small}
    _refuse(mesh, facets, faults)


def _refuse(mesh: Mesh, facets: Facets, faults: dict[str, Mask]) -> None:
    """Raise for the first fault that some facets have, with the place of one."""
    with together(mesh.comm):
        for fault, bad in faults.items():
            if bad.any():
                k = int(bad.argmax())
                at = lookup.midpoints(mesh, facets)[k]
                cell = lookup.facet_ids(mesh, facets)[k] // FACETS_PER_CELL
                raise ContactError(
                    f"{int(bad.sum())} facet(s) with {facets.spoken} {fault}, the first "
                    f"on cell {cell} at {format_point(at, coordinates(mesh))}"
                )


def check_cells(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets of cells that are folded or have no volume.

    The volume element may have either sign, which depends on the numbering of the
    cell's vertices, but one sign within a cell. It is checked at the nodes. It may
    vanish at some of them: at a vertex with an angle of 180 degrees, or at a node moved
    to the quarter of an edge.
    """
    element = compat.basix_element(compat.cell_name(mesh), compat.geometry_degree(mesh))
    X = coordinates(mesh)[compat.geometry_dofmap(mesh)[facets.cells]]
    with np.errstate(invalid="ignore"):  # the result shows what is not finite
        columns = np.array([gradients @ X for gradients in element.gradients])
        # The last column along the normal of the others
        determinant = np.sum(normals(columns[:-1]) * columns[-1], axis=-1)
        # The determinant is as large if the columns are orthogonal
        bound = np.prod(np.linalg.norm(columns, axis=-1), axis=0)
    size = np.abs(determinant).max(axis=1)
    fold = np.minimum(determinant.max(axis=1), -determinant.min(axis=1))
    faults = {
        "coordinates not finite": ~np.isfinite(size),
        "no volume": size <= MIN_RELATIVE_VOLUME * bound.max(axis=1),
        "a fold: their Jacobian changes sign": fold > MAX_FOLD * size,
    }
    _refuse(mesh, facets, {f"are on cells with {k}": bad for k, bad in faults.items()})


def check_zones(u: Any, zones: Sequence[ZoneFacets]) -> None:
    """Refuse slaves on several meshes, and tools of another dimension. Collective."""
    V = u.function_space
    gdim, names = V.mesh.geometry.dim, zones[0].names
    with together(V.mesh.comm):
        for zone in zones:
            for body in zone.bodies:
                if body.shape.gdim not in (None, gdim):
                    raise ContactError(
                        f"the rigid {type(body.shape).__name__} that {zone.spoken} "
                        f"meets is made for {body.shape.gdim}D, the mesh is in {gdim}D"
                    )
        if len({zone.slave_part for zone in zones}) > 1:
            raise ContactError(
                f"the slave {_spoken(names, *(z.slave_tag for z in zones))} are on "
                "different meshes: the multiplier has one, so swap slave and master of "
                "some pairs"
            )


def check_meshes(tagged: Tagged, tags: Sequence[int | str]) -> None:
    """Refuse tags of one side of a pair that are on several meshes. Collective."""
    with together(tagged.comm):
        if ALL in tags:
            raise ContactError(
                "pairs='all' is for bodies on one mesh, and the displacement is on "
                f"{len(tagged.meshes)}: name the pairs, or join the meshes"
            )
    have, names = tagged.having(tags), tagged.names
    with together(tagged.comm):
        for tag in tags:
            if sum(tag in some for some in have) > 1:
                raise ContactError(
                    f"facets with the {_spoken(names, tag)} are on several meshes: use "
                    "each tag number on one mesh only"
                )
        if sum(map(bool, have)) > 1:
            raise ContactError(
                f"facets with the {_spoken(names, *tags)} are on several meshes, and the "
                "masters of one slave have to be on one: make a Contact for each of "
                "these, and give NonlinearProblem the list of contacts"
            )


def _spoken(names: Mapping[int, str], *tags: Any) -> str:
    """Tags for messages, with their names."""
    if len(tags) > 1 and not any(tag in names for tag in tags):
        return f"tags {list(tags)}"
    return ", ".join(spoken_tag(tag, names.get(tag)) for tag in tags)
