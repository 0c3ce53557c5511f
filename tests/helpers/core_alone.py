"""Two blocks in contact, by the core of raymortar alone or by the whole package.

core_alone.py PACKAGE-FOLDER whole|alone none|friction

Prints as JSON the iterations of four steps, the force on the grip, and the modules that
were loaded. Alone, the package has its core and the compiled part, and no floor.
"""

import json
import sys
import tempfile
from pathlib import Path


def leave_core(package, folder):
    """A package without floors, in a folder."""
    alone = Path(folder) / "raymortar"
    alone.mkdir()
    (alone / "__init__.py").touch()
    for part in (package / "core", *package.glob("_cpp*.so")):
        (alone / part.name).symlink_to(part)
    return alone


def solve(friction):
    """Press one block of hexahedra onto another, on meshes of their own, and drag it."""
    from mpi4py import MPI

    import numpy as np
    import ufl
    from dolfinx import fem, mesh

    from raymortar.core import compat
    from raymortar.core.contact import Contact
    from raymortar.core.options.friction import Coulomb
    from raymortar.core.problem import CoupledProblem
    from raymortar.core.solvers.newton import NewtonSolver

    boxes = [
        ([[0, 0, 0], [1, 1, 0.5]], [4, 4, 2]),
        ([[0.1, 0.15, 0.5], [0.8, 0.85, 1.0]], [3, 3, 2]),
    ]
    functions, tags, forms, ends, bcs = [], [], [], [], []
    for k, (corners, cells) in enumerate(boxes):
        body = mesh.create_box(MPI.COMM_SELF, corners, cells, mesh.CellType.hexahedron)
        u = fem.Function(compat.vector_space(body, 1), name=f"u{k}")
        V, v = u.function_space, ufl.TestFunction(u.function_space)
        F = ufl.Identity(3) + ufl.grad(u)
        log_J = ufl.ln(ufl.det(F))
        energy = 0.5 * (ufl.inner(F, F) - 3) - log_J + log_J**2
        forms.append(ufl.derivative(energy * ufl.dx(degree=3), u, v))
        faces = [
            mesh.locate_entities_boundary(body, 2, lambda x, z=z: np.isclose(x[2], z))
            for z in (0.5, 1.0 * k)
        ]
        met, held = np.sort(faces[0]), faces[1]
        marks = np.full(len(met), k + 1, np.int32)
        tags.append(compat.meshtags(body, 2, met, marks))
        ends.append(fem.Function(V))
        dofs = fem.locate_dofs_topological(V, 2, held)
        bcs.append(fem.dirichletbc(ends[-1], dofs))
        functions.append(u)
    law = {"friction": Coulomb(0.3)} if friction else {}
    contact = Contact(functions, tags, [(2, 1)], **law)
    problem = CoupledProblem(forms, contact, bcs, u=functions)
    direct = {
        "ksp_type": "preonly",
        "pc_type": "lu",
        "pc_factor_mat_solver_type": "mumps",
    }
    solver, iterations = NewtonSolver(problem, direct), []
    for t in (0.25, 0.5, 0.75, 1.0):
        ends[1].x.array.reshape(-1, 3)[:] = (0.05 * t, 0.0, -0.05 * t)
        iterations.append(solver.solve()[0])
        contact.advance()
    X = functions[1].function_space.tabulate_dof_coordinates()
    forces = problem.forces().reshape(-1, 3)[-len(X) :]
    return iterations, forces[np.isclose(X[:, 2], 1.0)].sum(axis=0).tolist()


def main(package, parts, law):
    with tempfile.TemporaryDirectory() as folder:
        package = Path(package)
        if parts == "alone":
            package = leave_core(package, folder)
        sys.path.insert(0, str(package.parent))
        __import__("raymortar")
        iterations, force = solve(law == "friction")
    modules = sorted(
        name
        for name, module in sys.modules.items()
        if name.startswith("raymortar.") and getattr(module, "__file__", None)
    )
    print(json.dumps({"iterations": iterations, "force": force, "modules": modules}))


if __name__ == "__main__":
    main(*sys.argv[1:])
