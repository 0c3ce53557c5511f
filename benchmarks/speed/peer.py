"""GetFEM's ray-traced contact on the same surfaces: CPU seconds of its assembly.

The brick of Poulios and Renard alone, without elasticity: Gauss points on whole slave
facets, as many as its users take.
"""

from __future__ import annotations

import numpy as np
import ufl  # noqa: F401  (before getfem, which brings a PETSc of its own on some systems)
from scene import CELLS, Blocks
from stages import clock

from raymortar.core import compat

try:
    import getfem as gf
except ImportError:
    gf = None

if gf is not None:
    gf.util_trace_level(1)

MISSING = "GetFEM is missing (python3-getfem): it is left out"
SLAVE, MASTER = 1, 2
_MAPS = {
    "quadrilateral": "GT_QK(2,1)",
    "tetrahedron": "GT_PK(3,1)",
    "hexahedron": "GT_QK(3,1)",
}
# Integration method and its points on a facet
RULES = {
    ("quadrilateral", 1): ("IM_GAUSS_PARALLELEPIPED(2,4)", 3),
    ("quadrilateral", 2): ("IM_GAUSS_PARALLELEPIPED(2,6)", 4),
    ("tetrahedron", 1): ("IM_TETRAHEDRON(5)", 7),
    ("tetrahedron", 2): ("IM_TETRAHEDRON(6)", 12),
    ("hexahedron", 1): ("IM_GAUSS_PARALLELEPIPED(3,4)", 9),
    ("hexahedron", 2): ("IM_GAUSS_PARALLELEPIPED(3,6)", 16),
}


def mesh_of(mesh, cells, cell):
    """Some cells of a DOLFINx mesh as a mesh in GetFEM."""
    table = compat.geometry_dofmap(mesh)[cells]
    corners = mesh.geometry.x[table][:, :, : CELLS[cell]]
    copy = gf.Mesh("empty", CELLS[cell])
    copy.add_convex(
        gf.GeoTrans(_MAPS[cell]), np.ascontiguousarray(corners.transpose(2, 1, 0))
    )
    return copy


def _body(scene, cell, name):
    """A body's mesh in GetFEM."""
    cells = scene.cell_tags.find(scene.bodies[name])
    return mesh_of(scene.mesh, cells, cell)


def _mark(mesh, region, downward):
    """Number the outer faces whose normal is steep and points down, or up."""
    normal = np.zeros(mesh.dim())
    normal[-1] = -1.0 if downward else 1.0
    faces = mesh.outer_faces_with_direction(normal, 0.5)
    mesh.set_region(region, faces)
    return faces.shape[1]


class Peer:
    """Contact terms of `Blocks` in GetFEM."""

    def __init__(self, blocks: Blocks, cell: str, degree: int):
        dim = CELLS[cell]
        upper, lower = (_body(blocks.scene, cell, name) for name in ("upper", "lower"))
        self.facets = _mark(upper, SLAVE, downward=True)
        _mark(lower, MASTER, downward=False)
        spaces = [gf.MeshFem(mesh, dim) for mesh in (upper, lower)]
        for space in spaces:
            space.set_classical_fem(degree)
        multipliers = gf.MeshFem(upper, dim)
        multipliers.set_classical_fem(degree if dim == 2 else 1)
        model = self.model = gf.Model("real")
        model.add_fem_variable("u", spaces[0])
        model.add_fem_variable("u_master", spaces[1])
        model.add_filtered_fem_variable("lam", multipliers, SLAVE)
        model.add_initialized_data("r", [1.0])
        brick = model.add_integral_large_sliding_contact_brick_raytracing("r", 1.0)
        method, self.points = RULES[cell, degree]
        rules = [gf.MeshIm(mesh, gf.Integ(method)) for mesh in (upper, lower)]
        model.add_slave_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[0], SLAVE, "u", "lam"
        )
        model.add_master_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[1], MASTER, "u_master"
        )
        lam = np.zeros((model.variable("lam").size // dim, dim))
        lam[:, -1] = 1.0
        model.set_variable("lam", lam.ravel())
        # GetFEM's model does not keep alive what it is made of
        self._kept = [upper, lower, multipliers, *spaces, *rules]

    def seconds(self, repeats):
        """Of residual and tangent; GetFEM pairs in each of them."""
        return {
            what: clock(lambda: self.model.assembly(f"build_{build}"), repeats)
            for what, build in (("residual", "rhs"), ("tangent", "matrix"))
        }


def compare(cell, degree, n, repeats=5):
    """Microseconds per slave facet and per point of both programs, and their ratios.

    GetFEM's tangent is that at fixed points, as is ours in the ratios.
    """
    _, through_segments, _ = _ours(Blocks(cell, degree, n, None, "vector"), repeats)
    blocks = Blocks(cell, degree, n, None, "vector", tangent="fixed")
    ours = dict(zip(("residual", "tangent", "pairing"), _ours(blocks, repeats)))
    counts = blocks.contact.statistics
    peer = Peer(blocks, cell, degree)
    if peer.facets != counts.slave_facets:
        raise ValueError(f"{peer.facets} facets, not {counts.slave_facets}")
    theirs = peer.seconds(repeats)
    facets, per_facet = counts.slave_facets, counts.points / counts.slave_facets
    row = {"cell": cell, "degree": degree, "facets": facets}
    row |= {"points": per_facet, "getfem_points": peer.points}
    for what in ("residual", "tangent"):
        us, other = 1e6 * ours[what] / facets, 1e6 * theirs[what] / facets
        row |= {f"us_{what}": us, f"getfem_us_{what}": other, f"x_{what}": other / us}
        row[f"x_{what}_point"] = (other / peer.points) / (us / per_facet)
    row["us_pairing"] = 1e6 * ours["pairing"] / facets
    row["us_full_tangent"] = 1e6 * through_segments / facets
    row["x_full_tangent"] = row["getfem_us_tangent"] / row["us_full_tangent"]
    return row


def _ours(blocks, repeats):
    """Seconds of residual and tangent, both with the pairing, and of that alone."""
    contact, problem = blocks.contact, blocks.problem
    A, b = problem.create_matrix(), problem.create_vector()

    def pair():
        blocks.move()
        contact.update()

    def tangent():
        pair()
        A.zeroEntries()
        contact.assemble_matrix(A)
        A.assemble()

    def residual():
        pair()
        b.set(0.0)
        contact.assemble_vector(b)
        b.assemble()

    tangent()
    return [clock(call, repeats) for call in (residual, tangent, pair)]
