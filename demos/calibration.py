"""Calibration: friction and modulus of an ironing test, found from its two reactions.

A rigid circle is pressed into a rubber block and dragged along it (2D, neo-Hookean). The
forces of a test with known parameters are given; L-BFGS-B finds the parameters from a
wrong start. Each evaluation is one path, and one sweep back through it.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, create_rectangle, locate_entities_boundary, meshtags
from scipy.optimize import minimize

import raymortar
from raymortar import adjoint, io, rigid, tools

# Modulus (MPa) and friction coefficient of the test, and those of the start
TRUE, START = np.array([4.0, 0.3]), np.array([6.5, 0.12])
RADIUS, PRESSED, SLID, NU = 0.5, 0.12, 0.8, 0.4  # lengths in mm
PRESS, SLIDE, MOST = 3, 8, 15  # steps, and evaluations


class Ironing:
    """The ironing test, for any modulus and friction coefficient."""

    def __init__(self, comm, n):
        corners, cells = [np.zeros(2), np.array([3.0, 1.0])], [3 * n, n]
        self.mesh = mesh = create_rectangle(comm, corners, cells, CellType.triangle)
        bottom = locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], 0.0))
        top = locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], 1.0))
        V = tools.vector_space(mesh, 1)
        self.u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
        self.E = fem.Constant(mesh, 1.0)
        mu, bulk = self.E / (2 * (1 + NU)), self.E / (3 * (1 - 2 * NU))
        F = ufl.Identity(2) + ufl.grad(self.u)
        J, inverse = ufl.det(F), ufl.inv(F).T
        P = mu * (F - inverse) + (bulk - 2 * mu / 3) * ufl.ln(J) * inverse
        self.form = ufl.inner(P, ufl.grad(v)) * ufl.dx(degree=2)
        self.bcs = [tools.prescribe(V, bottom)]
        self.tags = meshtags(mesh, 1, np.sort(top), 1)

    def run(self, E, mu):
        """Run the path; return its tape, the two forces, and the parameters."""
        self.u.x.array[:], self.E.value = 0.0, E
        tool = rigid.Body(rigid.Circle((1.0, 1.0 + RADIUS), RADIUS))
        nodes = raymortar.AugmentedLagrangian(condition="nodes")
        law = raymortar.Coulomb(mu)
        contact = raymortar.Contact(self.u, self.tags, [(1, tool)], nodes, law)
        problem = raymortar.NonlinearProblem(self.form, contact, self.bcs)

        def move(t):
            slid = SLID * max(t - PRESS, 0.0) / SLIDE
            tool.move((slid, -PRESSED * min(t / PRESS, 1.0)))

        steps, path = PRESS + SLIDE, (0.0, PRESS + SLIDE)
        solver = problem.snes_solver
        tape = adjoint.Tape(raymortar.LoadSteps(solver, move, steps, path=path))
        tape.run()
        forces = [adjoint.force(contact, axis) for axis in (0, 1)]
        return tape, forces, [self.E, adjoint.friction(contact)]


def draw(path, measured, curves, tried):
    """Draw the forces, and the way of the parameters."""
    plots = drawing.pyplot().subplots(1, 2, figsize=(10, 4), layout="constrained")
    figure, (left, right) = plots
    t = np.arange(1, measured.shape[1] + 1)
    for k, name in enumerate(("horizontal", "vertical")):
        left.plot(t, curves[0][k], ":", color=f"C{k}", label=f"{name}, start")
        left.plot(t, curves[-1][k], color=f"C{k}", label=f"{name}, found")
        left.plot(t, measured[k], "o", color=f"C{k}", label=f"{name}, test")
    left.set(xlabel="step", ylabel="force on the block (N/mm)")
    right.plot(tried / TRUE, "o-", label=["modulus", "friction coefficient"])
    right.axhline(1.0, color="grey", lw=0.8)
    right.set(xlabel="evaluation", ylabel="parameter over that of the test")
    left.legend()
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if the parameters are found."""
    args = common.options("calibration", __doc__).parse_args(arguments)
    args.output.mkdir(parents=True, exist_ok=True)
    report = common.Report(MPI.COMM_WORLD)
    test = Ironing(MPI.COMM_WORLD, 16 if args.fine else 8)
    tape, forces, _ = test.run(*TRUE)
    measured = tape.values(forces)
    size, tried, curves = np.abs(measured).max(axis=1, keepdims=True), [], []

    def misfit(logs):
        """Half the sum of squared relative errors, and its gradient by logarithms."""
        tried.append(START * np.exp(logs))
        tape, forces, parameters = test.run(*tried[-1])
        curves.append(tape.values(forces))
        error = (curves[-1] - measured) / size
        slope = tape.gradient(forces, parameters, weights=error / size)
        E, mu, J = *tried[-1], 0.5 * np.sum(error**2)
        report.say(f"{len(tried):2}: E = {E:.5f}, mu = {mu:.5f}, misfit {J:.2e}")
        return J, tried[-1] * np.array(slope)

    found = minimize(misfit, np.zeros(2), jac=True, method="L-BFGS-B",
                     options={"maxfun": MOST, "ftol": 1e-14, "gtol": 1e-5})  # fmt: skip
    best = START * np.exp(found.x)
    report.add("modulus", best[0], TRUE[0], 1e-3, "MPa")
    report.add("friction coefficient", best[1], TRUE[1], 1e-3)
    io.write_xdmf(args.output / "calibration.xdmf", test.mesh, [test.u])
    if MPI.COMM_WORLD.rank == 0:
        draw(args.output / "calibration.png", measured, curves, np.array(tried))
    return max(report.finish("test"), int(len(tried) > MOST))


if __name__ == "__main__":
    sys.exit(main())
