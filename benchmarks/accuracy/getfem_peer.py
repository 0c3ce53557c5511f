"""The manufactured problems in GetFEM: the same mesh, loads, start and tolerance.

GetFEM's large sliding contact by ray tracing (Poulios & Renard) is the method that
raymortar builds on, with Gauss points on whole slave facets and no segments. Cells,
load vector, Dirichlet values and the first guess are taken from the DOLFINx problem,
and what GetFEM finds is put back into it: errors are measured by the same code.
"""

from __future__ import annotations

import time

import numpy as np
import ufl  # noqa: F401  (before getfem, which brings a PETSc of its own on some systems)
from manufactured import Manufactured
from mesh_measures import cell_nodes

from raymortar.core import compat

try:
    import getfem as gf
except ImportError:
    gf = None
else:
    gf.util_trace_level(0)

MISSING = "GetFEM is missing (python3-getfem): its runs are left out"
MAX_ITERATIONS = 25
_MAPS = {
    "triangle": "GT_PK(2,1)",
    "quadrilateral": "GT_QK(2,1)",
    "tetrahedron": "GT_PK(3,1)",
    "hexahedron": "GT_QK(3,1)",
}
SLAVE, TOP, MASTER, ALL = 1, 2, 3, 4


def _order(points):
    """Permutation that sorts points (n, d) by coordinates, whatever their rounding."""
    return np.lexsort(np.round(points, 8).T)


def _match(points, targets):
    """For each of the points (n, d) the index of the target that is there."""
    a, b = _order(points), _order(targets)
    if len(a) != len(b) or not np.allclose(points[a], targets[b], atol=1e-7):
        raise ValueError("the nodes of both programs differ")
    index = np.empty(len(a), dtype=np.int64)
    index[a] = b
    return index


class Body:
    """A body's mesh and displacement space in GetFEM, and its dofs in DOLFINx."""

    def __init__(self, problem: Manufactured, name: str, degree: int):
        V, scene, dim = problem.u.function_space, problem.scene, problem.dim
        cells = scene.cell_tags.indices[scene.cell_tags.values == scene.bodies[name]]
        corners = cell_nodes(scene.mesh)[cells]
        self.mesh = gf.Mesh("empty", dim)
        kind = gf.GeoTrans(_MAPS[compat.cell_name(scene.mesh)])
        self.mesh.add_convex(kind, np.ascontiguousarray(corners.transpose(2, 1, 0)))
        self.space = gf.MeshFem(self.mesh, dim)
        self.space.set_classical_fem(degree)
        dofs = np.unique(compat.dofmap_array(V)[cells])
        X = V.tabulate_dof_coordinates()[:, :dim]
        nodes = self.space.basic_dof_nodes()[:, ::dim].T
        # DOLFINx's block dof of each of GetFEM's nodes
        self.dofs = dofs[_match(nodes, X[dofs])]

    def region(self, number: int, height: float):
        """Number the boundary faces at a height."""
        nodes = self.mesh.pts()
        ids = self.mesh.pid()[np.abs(nodes[-1] - height) < 1e-9]
        outer = self.mesh.outer_faces()
        faces = self.mesh.faces_from_pid(ids)
        both = set(map(tuple, outer.T)) & set(map(tuple, faces.T))
        self.mesh.set_region(number, np.array(sorted(both)).T)

    def values(self, array):
        """Of a DOLFINx array of u, in GetFEM's order."""
        return array.reshape(-1, self.mesh.dim())[self.dofs].ravel()


class Peer:
    """GetFEM's model of a manufactured problem on a rigid master.

    Parameters
    ----------
    problem
        Made with `curved=False` (GetFEM bends the master by its displacement too), a
        vector multiplier and at its start.
    degree
        Of the displacement.
    quadrature
        Degree of the Gauss rule on slave facets.
    """

    def __init__(self, problem: Manufactured, degree: int, quadrature: int):
        self.problem, dim = problem, problem.dim
        upper, lower = Body(problem, "upper", degree), Body(problem, "lower", degree)
        self.upper = upper
        # GetFEM's model does not keep alive what it is made of
        self._kept = [lower]
        upper.region(SLAVE, 0.0)
        upper.region(TOP, 1.0)
        lower.region(MASTER, 0.0)
        model = self.model = gf.Model("real")
        model.add_fem_variable("u", upper.space)
        multipliers = gf.MeshFem(upper.mesh, dim)
        multipliers.set_classical_fem(degree if dim == 2 else 1)
        self._kept.append(multipliers)
        model.add_filtered_fem_variable("lam", multipliers, SLAVE)
        self._elasticity(degree)
        load = np.zeros(len(problem.u.x.array))
        compat.assemble_residual(load, compat.form(problem.load))
        model.add_explicit_rhs("u", upper.values(load))
        start = problem.u.x.array
        model.add_initialized_fem_data("u_top", upper.space, upper.values(start))
        model.add_Dirichlet_condition_with_simplification("u", TOP, "u_top")
        model.set_variable("u", upper.values(start))
        # A master must be unknown: all its dofs are prescribed, as in DOLFINx
        cells = lower.mesh.cvid()
        lower.mesh.set_region(ALL, np.vstack([cells, np.full(len(cells), -1)]))
        model.add_fem_variable("u_master", lower.space)
        model.set_variable("u_master", lower.values(start))
        model.add_initialized_fem_data("u_rigid", lower.space, lower.values(start))
        model.add_Dirichlet_condition_with_simplification("u_master", ALL, "u_rigid")
        self._contact(quadrature, lower)
        self._guess()

    def _elasticity(self, degree):
        mu, lmbda = self.problem.fields.upper.moduli
        self.model.add_initialized_data("mu", [mu])
        self.model.add_initialized_data("la", [lmbda])
        volume = gf.MeshIm(self.upper.mesh, 2 * degree + 2)
        self._kept.append(volume)
        I = f"Id({self.problem.dim})"
        F, E = f"({I}+Grad_u)", "(0.5*(Grad_u+Grad_u'+Grad_u'*Grad_u))"
        stress = f"{F}*(la*Trace{E}*{I}+2*mu*{E})"
        self.model.add_nonlinear_term(volume, f"({stress}):Grad_Test_u")

    def _contact(self, quadrature, lower):
        model, contact = self.model, self.problem.contact
        model.add_initialized_data("r", [contact.gamma])
        # Surfaces touch throughout; less than the thickness of the rigid body
        release = 0.3
        brick = model.add_integral_large_sliding_contact_brick_raytracing("r", release)
        slave = gf.MeshIm(self.upper.mesh, quadrature)
        master = gf.MeshIm(lower.mesh, quadrature)
        self._kept += [slave, master]
        model.add_slave_contact_boundary_to_large_sliding_contact_brick(
            brick, slave, SLAVE, "u", "lam"
        )
        model.add_master_contact_boundary_to_large_sliding_contact_brick(
            brick, master, MASTER, "u_master"
        )

    def _multiplier_nodes(self):
        """Block dofs in DOLFINx of the multiplier's nodes in GetFEM's order."""
        lam, dim = self.problem.contact.multiplier, self.problem.dim
        dofs = self.problem.contact.zones[0].multiplier_nodes
        X = lam.function_space.tabulate_dof_coordinates()[dofs, :dim]
        space = self.model.mesh_fem_of_variable("lam")
        kept = np.unique(space.basic_dof_on_region(SLAVE) // dim)
        nodes = space.basic_dof_nodes()[:, ::dim].T[kept]
        return dofs[_match(nodes, X)]

    def _guess(self):
        """Start from the multiplier that the DOLFINx problem starts from."""
        values = self.problem.contact.multiplier.x.array.reshape(-1, self.problem.dim)
        self.model.set_variable("lam", values[self._multiplier_nodes()].ravel())

    def solve(self):
        """Newton's method with full steps to raymortar's tolerances.

        Returns
        -------
        iterations, {"seconds", "volume" (all of the assembly), "solve"}
        """
        model, parts = self.model, {"volume": 0.0, "solve": 0.0}
        floor, first = self.problem.problem.residual_floor(), None
        start = time.process_time()
        for iteration in range(MAX_ITERATIONS + 1):
            begin = time.process_time()
            model.assembly("build_all")
            rhs = model.rhs()
            parts["volume"] += time.process_time() - begin
            norm = np.linalg.norm(rhs)
            first = norm if first is None else first
            if norm <= max(floor, 1e-10 * first):
                parts["seconds"] = time.process_time() - start
                return iteration, parts
            begin = time.process_time()
            step = gf.linsolve_mumps(model.tangent_matrix(), rhs)
            model.to_variables(model.from_variables() + np.ravel(step))
            parts["solve"] += time.process_time() - begin
        raise RuntimeError(
            f"GetFEM did not converge: residual {norm:.2e} of {first:.2e}"
        )

    def set_volume(self):
        """Put GetFEM's solution into the DOLFINx problem."""
        problem, dim = self.problem, self.problem.dim
        u = problem.u.x.array.reshape(-1, dim)
        u[self.upper.dofs] = np.reshape(self.model.variable("u"), (-1, dim))
        lam = problem.contact.multiplier.x.array.reshape(-1, dim)
        found = np.reshape(self.model.variable("lam"), (-1, dim))
        lam[self._multiplier_nodes()] = found
