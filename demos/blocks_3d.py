"""Two hyperelastic blocks (3D) whose meshes do not match, compressed by 20 %.

First equal blocks of tetrahedra: frictionless, they must shorten like a single one,
with uniform pressure to rounding (the patch test). Then a narrow block of hexahedra
sinks into a wide one: its force must pass through the contact undiminished.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import common
import numpy as np
import ufl
from dolfinx import fem
from scipy.optimize import brentq

import raymortar
from meshes.scenes import two_blocks
from raymortar import io, tools

E, NU, STRETCH = 10.0, 0.3, 0.8
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
# What keeps each block in its place: symmetry planes, the floor
FIXED = {"lower_left": 0, "upper_left": 0, "bottom": 2}
FIXED |= {"lower_front": 1, "upper_front": 1}


def uniform_state():
    """Stretch across the load for which sides are free, and the nominal pressure."""

    def side(alpha):
        return MU * (alpha**2 - 1.0) + LAMBDA * np.log(STRETCH * alpha**2)

    alpha = brentq(side, 1.0, 1.0 / STRETCH, xtol=1e-14)
    log_J = np.log(STRETCH * alpha**2)
    return alpha, MU * (1.0 / STRETCH - STRETCH) - LAMBDA * log_J / STRETCH


def solve(scene, degree=1, steps=4):
    """Push the top of two blocks of height 1 down by a fifth of 2."""
    mesh = scene.mesh
    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    F = ufl.Identity(3) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    energy = MU / 2 * (ufl.inner(F, F) - 3 - 2 * log_J) + LAMBDA / 2 * log_J**2
    residual = ufl.derivative(energy * ufl.dx(degree=2 * degree), u, v)

    top = fem.Constant(mesh, 0.0)
    bcs = [tools.prescribe(V, scene.find(s), component=i) for s, i in FIXED.items()]
    bcs.append(tools.prescribe(V, scene.find("top"), top, 2))

    pairs = [("slave", "master")]
    contact = raymortar.Contact(u, scene.facet_tags, pairs, names=scene.tags)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)

    def apply(factor):
        top.value = -factor * (1.0 - STRETCH) * 2.0

    path = raymortar.LoadSteps(problem.snes_solver, apply, steps).run()
    made = {"scene": scene, "u": u, "contact": contact}
    made["support"] = problem.reactions({"top": bcs[-1]})["top"]
    iterations, history = [step.iterations for step in path], list(problem.history)
    return SimpleNamespace(iterations=iterations, history=history, **made)


def patch(comm, n, degree):
    """Equal blocks of shaken tetrahedra: flat triangles need no regular mesh."""
    shaken = {"perturb": 0.25, "perturb_sides": 0.25, "seed": 1}
    scene = two_blocks(comm, 3, "tetrahedron", n + 1, n, **shaken)
    return solve(scene, degree)


def punch(comm, n, degree):
    """A narrower block on a wider one, hexahedra, both cut at symmetry planes."""
    narrow = {"upper_size": (0.5, 0.5, 1.0), "overhang": (-0.25, -0.25)}
    scene = two_blocks(comm, 3, "hexahedron", (2 * n, 2 * n, n), n + 1, **narrow)
    return solve(scene, degree)


def ends(function, scene):
    """Least and largest of the first component on the slave. Collective."""
    V = function.function_space
    dofs = fem.locate_dofs_topological(V, 2, scene.find("slave"))
    values = function.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs, 0]
    least, largest = values.min(initial=np.inf), values.max(initial=-np.inf)
    comm = scene.mesh.comm
    return comm.allreduce(least, op=MPI.MIN), comm.allreduce(largest, op=MPI.MAX)


def main(arguments=None):
    """Run the demo; 0 if the patch is uniform and the punch in equilibrium."""
    parser = common.options("blocks_3d", __doc__)
    parser.add_argument("--size", type=int, default=5, help="cells along an edge")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=1)
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    report, file = common.Report(comm), args.output / "blocks_3d.xdmf"
    args.output.mkdir(parents=True, exist_ok=True)

    found, (alpha, pressure) = patch(comm, size, args.degree), uniform_state()
    report.newton("equal blocks", found.iterations, found.history)
    low, high = ends(found.contact.pressure(), found.scene)
    report.add("lateral stretch", 1.0 + ends(found.u, found.scene)[1], alpha, 1e-9)
    report.add("largest pressure", high, pressure, 1e-8)
    report.add("smallest pressure", low, pressure, 1e-8)

    found = punch(comm, size, args.degree)
    report.newton("narrow block", found.iterations, found.history)
    force = found.contact.resultant().force[2]
    report.add("narrow block: force", force, -found.support[2], 1e-8)
    io.write_xdmf(file, found.scene.mesh, [found.u, found.contact.pressure()])
    raymortar.plot(found.contact, file.with_suffix(".png"), view=(-135.0, 20.0))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
