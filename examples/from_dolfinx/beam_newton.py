"""The hyperelastic beam of the DOLFINx tutorial, for DOLFINx 0.5 to 0.9.

Shortened, on a coarser mesh, from
https://jsdokken.com/dolfinx-tutorial/chapter2/hyperelasticity.html
(J. S. Dokken, CC BY 4.0). Its free half is pressed down by a load on its top;
docs/from_dolfinx.md adds contact.
"""

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NonlinearProblem
from dolfinx.nls.petsc import NewtonSolver

L = 20.0
domain = mesh.create_box(
    MPI.COMM_WORLD, [[0, 0, 0], [L, 1, 1]], [20, 2, 2], mesh.CellType.hexahedron
)
if hasattr(fem, "functionspace"):
    V = fem.functionspace(domain, ("Lagrange", 1, (3,)))
else:  # before 0.7
    V = fem.VectorFunctionSpace(domain, ("Lagrange", 1))
v, u = ufl.TestFunction(V), fem.Function(V)

sides = {
    1: lambda x: np.isclose(x[0], 0.0),
    2: lambda x: np.isclose(x[2], 1.0) & (x[0] > 9.9),
}
found = [mesh.locate_entities_boundary(domain, 2, side) for side in sides.values()]
facets, first = np.unique(np.hstack(found), return_index=True)
values = np.repeat(list(sides), [len(part) for part in found])[first]
facet_tag = mesh.meshtags(domain, 2, facets, values.astype(np.int32))

left_dofs = fem.locate_dofs_topological(V, 2, facet_tag.find(1))
bcs = [fem.dirichletbc(np.zeros(3), left_dofs, V)]
B = fem.Constant(domain, (0.0, 0.0, 0.0))
T = fem.Constant(domain, (0.0, 0.0, 0.0))

F = ufl.variable(ufl.Identity(3) + ufl.grad(u))
J = ufl.det(F)
E, nu = 1.0e4, 0.3
mu, lmbda = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
psi = mu / 2 * (ufl.tr(F.T * F) - 3) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2
P = ufl.diff(psi, F)

metadata = {"quadrature_degree": 4}
ds = ufl.Measure("ds", domain=domain, subdomain_data=facet_tag, metadata=metadata)
dx = ufl.Measure("dx", domain=domain, metadata=metadata)
residual = (
    ufl.inner(ufl.grad(v), P) * dx - ufl.inner(v, B) * dx - ufl.inner(v, T) * ds(2)
)

problem = NonlinearProblem(residual, u, bcs)
solver = NewtonSolver(domain.comm, problem)
solver.atol = 1e-8
solver.rtol = 1e-8
solver.convergence_criterion = "incremental"

for n in range(1, 10):
    T.value[2] = -0.15 * n
    num_its, converged = solver.solve(u)
    assert converged
    print(f"Load step {n}, number of iterations {num_its}, load {T.value[2]:.2f}")
