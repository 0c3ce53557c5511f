"""What the demos share: options, tables, gathering on rank 0, and a look for plots.

Nothing here is needed to solve a contact problem: the demos' own files show that.
"""

from __future__ import annotations

import argparse
import logging
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import ufl
from dolfinx import fem

from raymortar import compat

# The compiler of forms is chatty the first time
logging.getLogger().setLevel(logging.WARNING)

# Red for computed, dark for closed forms, one sequential map for stresses
COMPUTED, EXACT, STRESS_MAP = "#c0392b", "#2c3e50", "viridis"


def options(name: str, description: str) -> argparse.ArgumentParser:
    """Options that every demo has."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("results") / name,
        help="folder for the picture and the ParaView file",
    )
    parser.add_argument("--fine", action="store_true", help="a finer mesh")
    return parser


# Tables


@dataclass
class Report:
    """Table of our figures against closed forms, printed on rank 0.

    Rows with a tolerance decide whether the demo passes.
    """

    comm: object
    rows: list[tuple] = field(default_factory=list)

    def add(self, name, ours, exact, tolerance=None, unit=""):
        """A row; `tolerance` is relative to `exact`."""
        self.rows.append((name, float(ours), float(exact), tolerance, unit))

    def say(self, text=""):
        """Print on rank 0."""
        if self.comm.rank == 0:
            print(text, flush=True)

    def newton(self, title, iterations, history):
        """Iterations of the steps, and the residuals of the last one."""
        self.say(f"{title}: {', '.join(map(str, iterations))} Newton iterations")
        self.say("  residual " + " ".join(f"{r:.1e}" for r in history))

    def finish(self, against="closed form") -> int:
        """Print the table; 0 if all rows are within their tolerance, else 1."""
        self.say(f"\n{'':34}{'ours':>12}{against:>13}{'deviation':>11}  allowed")
        passed = True
        for name, ours, exact, tolerance, unit in self.rows:
            deviation = (ours - exact) / abs(exact)
            allowed = "" if tolerance is None else f"{_percent(tolerance)}"
            if tolerance is not None and not abs(deviation) <= tolerance:
                passed, allowed = False, allowed + "  FAILED"
            label = f"{name} [{unit}]" if unit else name
            self.say(
                f"{label:34}{ours:12.6g}{exact:13.6g}{_percent(deviation, '+'):>11}  "
                + allowed
            )
        self.say("passed" if passed else "FAILED")
        return 0 if passed else 1


def _percent(x: float, sign: str = "") -> str:
    """A ratio in percent, tiny ones by their power of ten."""
    return f"{x:{sign}.2%}" if abs(x) >= 5e-5 or x == 0.0 else f"{x:{sign}.0e}"


# Supports


def clamp(V, scene, name: str, component: int, value=0.0):
    """Prescribe one component of the displacement on a named part of the boundary.

    `value` is a number, or a `Constant` that changes from load step to load step.
    """
    mesh = scene.mesh
    dim = mesh.topology.dim
    compat.connectivity(mesh, dim - 1, dim)
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V.sub(component), dim - 1, facets)
    if not isinstance(value, fem.Constant):
        value = fem.Constant(mesh, value)
    return fem.dirichletbc(value, dofs, V.sub(component))


# Fields


def nodal_field(f, mesh, name: str, degree: int = 1, quadrature_degree=None):
    """Continuous version of a UFL scalar: averages weighted by the shape functions.

    Cheap (no system to solve), and never outside the range of f. Where UFL's guess
    of the degree of f is far too high, give a quadrature degree. Collective.
    """
    field_ = fem.Function(compat.scalar_space(mesh, degree), name=name)
    V = field_.function_space
    v = ufl.TestFunction(V)
    sums, weights = (
        compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        for _ in range(2)
    )
    rule = quadrature_degree or 2 * degree
    dx = ufl.dx(mesh, metadata={"quadrature_degree": rule})
    compat.assemble_residual(sums.array, compat.form(f * v * dx))
    compat.assemble_residual(weights.array, compat.form(v * dx))
    for vector in (sums, weights):
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
    field_.x.array[:] = sums.array / weights.array
    return field_


def von_mises(sigma):
    """Equivalent stress of a 3 x 3 tensor."""
    s = sigma - ufl.tr(sigma) / 3 * ufl.Identity(3)
    return ufl.sqrt(1.5 * ufl.inner(s, s))


def pressure_field(contact):
    """Contact pressure (positive in compression) for ParaView."""
    p = fem.Function(contact.multiplier.function_space, name="pressure")
    p.x.array[:] = -contact.multiplier.x.array
    return p


def integral(form, mesh) -> float:
    """Value of a UFL functional. Collective."""
    return mesh.comm.allreduce(fem.assemble_scalar(compat.form(form)))


def value_at_origin(function, scene, name: str, component: int = 0) -> float:
    """Value at the node of a named surface that is at the origin. Collective."""
    V = function.function_space
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim - 1, facets)
    distance = np.linalg.norm(V.tabulate_dof_coordinates()[dofs], axis=1)
    values = function.x.array.reshape(-1, V.dofmap.index_map_bs)[:, component]
    nearest = distance.argmin() if len(dofs) else None
    here = (
        (np.inf, 0.0) if nearest is None else (distance[nearest], values[dofs][nearest])
    )
    return min(scene.mesh.comm.allgather(here))[1]


# Gathering on rank 0


def gather(comm, array: np.ndarray):
    """Rows of all ranks, one after the other; None elsewhere than on rank 0."""
    parts = comm.gather(array, root=0)
    return None if parts is None else np.concatenate(parts)


def gather_nodes(function, scene, name: str = "slave"):
    """Nodes of a named surface, (n, 3), and values there, (n, components)."""
    V = function.function_space
    comm, dim = scene.mesh.comm, scene.mesh.topology.dim
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    dofs = dofs[dofs < V.dofmap.index_map.size_local]
    values = function.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs]
    return gather(comm, V.tabulate_dof_coordinates()[dofs]), gather(comm, values)


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


# Plots


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
