"""Pictures: meshes gathered on rank 0, fields in the plane, surfaces in space."""

from __future__ import annotations

import numpy as np
from common import gather

from raymortar import compat

# Red for computed, dark for closed forms, one sequential map for stresses
COMPUTED, EXACT, STRESS_MAP = "#c0392b", "#2c3e50", "viridis"


# Gathering on rank 0


def _corner_values(function, cells, corners) -> np.ndarray:
    """Values at some vertices of cells: (n, corners, components)."""
    V = function.function_space
    dofs = compat.dofmap_array(V)[cells[:, None], corners]
    return function.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs]


def _gather_corners(mesh, cells, corners, functions):
    """Vertices (n, k, 3) of pieces of cells, and functions there, on rank 0."""
    nodes = compat.geometry_dofmap(mesh)[cells[:, None], corners]
    arrays = [mesh.geometry.x[nodes]]
    arrays += [_corner_values(f, cells, corners) for f in functions]
    return [gather(mesh.comm, array) for array in arrays]


def gather_cells(mesh, *functions):
    """Cells of a 2D mesh as polygons, with functions at their vertices.

    Returns, on rank 0, vertices (n, k, 3) in order around the cell, and an array
    (n, k, components) for each Lagrange function. Collective.
    """
    cells = np.arange(mesh.topology.index_map(2).size_local)
    quadrilateral = compat.cell_name(mesh) == "quadrilateral"
    order = [0, 1, 3, 2] if quadrilateral else [0, 1, 2]
    corners = np.tile(order, (len(cells), 1))
    return _gather_corners(mesh, cells, corners, functions)


def gather_states(u, states, field):
    """Cells with u and a field at several states. Collective.

    `states` are (load factor, array of u); `field` makes a function of the present u.
    """
    final, parts = u.x.array.copy(), []
    for factor, state in states:
        u.x.array[:] = state
        parts.append((factor, gather_cells(u.function_space.mesh, u, field())))
    u.x.array[:] = final
    return parts


def gather_boundary(mesh, *functions, facets=None):
    """Exterior (or given) facets of a 3D mesh as polygons, as `gather_cells`.

    Collective.
    """
    owned = mesh.topology.index_map(3).size_local
    facets = compat.exterior_facets(mesh) if facets is None else facets
    f_to_c = compat.connectivity(mesh, 2, 3)
    cells = np.array([f_to_c.links(f)[0] for f in facets], dtype=np.int64)
    # Each facet from the rank that owns its cell, not from its neighbours too
    facets, cells = facets[cells < owned], cells[cells < owned]
    c_to_f = compat.connectivity_table(mesh, 3, 2)
    local = np.argmax(c_to_f[cells] == facets[:, None], axis=1)
    table = compat.basix_element(compat.cell_name(mesh), 1).facet_vertices
    order = [0, 1, 3, 2] if len(table[0]) == 4 else [0, 1, 2]
    corners = np.array(table)[:, order][local].reshape(-1, len(order))
    return _gather_corners(mesh, cells, corners, functions)


# Drawing


def pyplot():
    """matplotlib.pyplot without a screen, with our look."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "figure.dpi": 160,
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.titlesize": 10,
            "legend.frameon": False,
            "savefig.bbox": "tight",
        }
    )
    return plt


def triangles(polygons: np.ndarray) -> np.ndarray:
    """Vertex numbers of the triangles of n polygons (n, k, ...), row by row."""
    n, k = polygons.shape[:2]
    fans = [[0, i, i + 1] for i in range(1, k - 1)]
    return (k * np.arange(n)[:, None, None] + np.array(fans)).reshape(-1, 3)


def draw_edges(axes, polygons: np.ndarray, colour="k", width=0.15, alpha=0.5):
    """Outlines of polygons (n, k, 2)."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(
        PolyCollection(
            polygons, facecolor="none", edgecolor=colour, lw=width, alpha=alpha
        )
    )


def draw_field(
    axes, at, values, images=((1, 1),), top=None, norm=None, cmap=STRESS_MAP
):
    """A field on polygons in the plane, with their edges.

    Parameters
    ----------
    at, values
        Vertices (n, k, 2), deformed, and the field there (n, k, 1).
    images
        Factors on x and y of the images drawn: mirror images complete what symmetry
        has left out.
    top, norm
        Upper end of the colours that begin at 0, or another scale.
    """
    scale = {"vmin": 0.0, "vmax": top} if norm is None else {"norm": norm}
    for signs in images:
        polygons = at * np.array(signs)
        colours = axes.tripcolor(
            *polygons.reshape(-1, 2).T,
            triangles(at),
            values.ravel(),
            shading="gouraud",
            cmap=cmap,
            **scale,
        )
        draw_edges(axes, polygons)
    axes.set(aspect="equal")
    return colours


def draw_surface(axes, polygons, values, azimuth, elevation=20):
    """Facets (n, k, 3) in 3D, coloured by a value each and shaded by the light."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    pyplot()
    import matplotlib as mpl

    scale = mpl.colors.Normalize(min(0.0, values.min()), values.max())
    colours = mpl.colormaps[STRESS_MAP](scale(values))
    normals = np.cross(
        polygons[:, 1] - polygons[:, 0], polygons[:, -1] - polygons[:, 0]
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Either side may be outward: light what the eye sees
    light = np.abs(normals @ _direction(azimuth + 25, elevation + 25))
    colours[:, :3] *= (0.65 + 0.35 * light)[:, None]
    axes.add_collection3d(
        Poly3DCollection(polygons, facecolors=colours, edgecolors="k", lw=0.12)
    )
    lower, upper = polygons.min(axis=(0, 1)), polygons.max(axis=(0, 1))
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
    axes.set_zlim(lower[2], upper[2])
    axes.set_box_aspect(upper - lower)
    axes.view_init(elevation, azimuth)
    axes.set_proj_type("persp", focal_length=0.4)
    axes.set_axis_off()
    return mpl.cm.ScalarMappable(scale, STRESS_MAP)


def _direction(azimuth: float, elevation: float) -> np.ndarray:
    """Unit vector towards the eye. Degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def space_and_curve(path, bodies, label, curve):
    """Picture of bodies in space on the left and of a curve on the right.

    `bodies` and `curve` draw on the axes they are given; the former returns the
    colours, which `label` names.
    """
    plt = pyplot()
    fig = plt.figure(figsize=(11, 4.5))
    colours = bodies(fig.add_axes((-0.07, -0.18, 0.66, 1.38), projection="3d"))
    bar = fig.add_axes((0.55, 0.22, 0.012, 0.56))
    fig.colorbar(colours, cax=bar, label=label)
    curve(fig.add_axes((0.68, 0.14, 0.295, 0.78)))
    # The room that axes in space take reaches out of the figure
    with plt.rc_context({"savefig.bbox": None}):
        fig.savefig(path)
