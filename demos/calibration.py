"""Calibration: friction and modulus of an ironing test, found from its two reactions.

A rigid circle is pressed into a rubber block and dragged along it (2D, neo-Hookean). The
forces of a test with known parameters are given; L-BFGS-B finds the parameters from a
wrong start. Each evaluation is one path and one adjoint sweep, whatever the number of
parameters.
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
from raymortar import adjoint, rigid, tools

# Modulus (MPa) and friction coefficient of the test, and those of the start
TRUE, START = np.array([4.0, 0.3]), np.array([6.5, 0.12])
RADIUS, PRESSED, SLID, NU = 0.5, 0.12, 0.8, 0.4  # lengths in mm
PRESS, SLIDE, MOST = 3, 8, 15  # steps, and evaluations


class Test:
    """The ironing test: its forces, and their derivatives."""

    def __init__(self, comm, n):
        corners, cells = [np.zeros(2), np.array([3.0, 1.0])], [3 * n, n]
        mesh = create_rectangle(comm, corners, cells, CellType.quadrilateral)
        bottom, top = (
            locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], y))
            for y in (0.0, 1.0)
        )
        V = tools.vector_space(mesh, 1)
        u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
        self.E = fem.Constant(mesh, 1.0)
        mu, bulk = self.E / (2 * (1 + NU)), self.E / (3 * (1 - 2 * NU))
        F = ufl.Identity(2) + ufl.grad(u)
        J = ufl.det(F)
        P = mu * (F - ufl.inv(F).T) + (bulk - 2 * mu / 3) * ufl.ln(J) * ufl.inv(F).T
        self.form = ufl.inner(P, ufl.grad(v)) * ufl.dx(degree=2)
        self.bcs, self.u = [tools.prescribe(V, bottom)], u
        self.tags = meshtags(mesh, 1, np.sort(top), 1)

    def run(self, E, mu):
        """Run the path with some parameters; return its tape and functionals."""
        self.u.x.array[:] = 0.0
        self.E.value = E
        tool = rigid.Body(rigid.Circle((1.0, 1.0 + RADIUS), RADIUS))
        method = raymortar.AugmentedLagrangian(condition="nodes")
        law = raymortar.Coulomb(mu)
        contact = raymortar.Contact(self.u, self.tags, [(1, tool)], method, law)
        problem = raymortar.NonlinearProblem(self.form, contact, self.bcs)

        def move(t):
            tool.move(
                (SLID * max(t - PRESS, 0.0) / SLIDE, -PRESSED * min(t / PRESS, 1))
            )

        steps, whole = PRESS + SLIDE, (0.0, PRESS + SLIDE)
        path = raymortar.LoadSteps(problem.snes_solver, move, steps, path=whole)
        tape = adjoint.Tape(path)
        tape.run()
        return tape, [adjoint.force(contact, axis) for axis in (0, 1)], contact


def main(arguments=None):
    """Run the demo; 0 if the parameters are found."""
    parser = common.options("calibration", __doc__)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    args.output.mkdir(parents=True, exist_ok=True)
    test, report = Test(comm, 16 if args.fine else 8), common.Report(comm)
    tape, forces, _ = test.run(*TRUE)
    measured = tape.values(forces)
    size, tried, curves = np.abs(measured).max(), [], []

    def misfit(logs):
        """Half the sum of squared errors over the largest force, and its derivative."""
        values = START * np.exp(logs)
        tape, forces, contact = test.run(*values)
        found = tape.values(forces)
        error = (found - measured) / size
        controls = [test.E, adjoint.friction(contact)]
        gradient = tape.gradient(forces, controls, weights=error / size)
        tried.append(values)
        curves.append(found)
        report.say(f"{len(tried):2d}: E = {values[0]:.5f}, mu = {values[1]:.5f}, "
                   f"misfit {0.5 * np.sum(error**2):.2e}")  # fmt: skip
        return 0.5 * np.sum(error**2), values * np.array(gradient, dtype=float)

    options = {"maxfun": MOST, "ftol": 1e-14, "gtol": 1e-9}
    bounds = [(-1.5, 1.5)] * 2
    minimize(
        misfit, np.zeros(2), jac=True, method="L-BFGS-B", bounds=bounds, options=options
    )
    best = tried[int(np.argmin([np.sum((c - measured) ** 2) for c in curves]))]
    report.add("modulus", best[0], TRUE[0], 1e-3, "MPa")
    report.add("friction coefficient", best[1], TRUE[1], 1e-3)
    report.add("evaluations over 15", len(tried) / MOST, 1.0)
    if comm.rank == 0:
        figure, (left, right) = drawing.pyplot().subplots(
            1, 2, figsize=(10, 4), layout="constrained"
        )
        t = np.arange(1, measured.shape[1] + 1)
        for k, name in enumerate(("horizontal", "vertical")):
            left.plot(t, curves[0][k], ":", color=f"C{k}", label=f"{name}, start")
            left.plot(t, curves[-1][k], color=f"C{k}", label=f"{name}, found")
            left.plot(t, measured[k], "o", color=f"C{k}", label=f"{name}, test")
        left.set(xlabel="step", ylabel="force on the block (N/mm)")
        left.legend()
        for k, name in enumerate(("modulus", "friction coefficient")):
            right.plot(np.array(tried)[:, k] / TRUE[k], "o-", label=name)
        right.axhline(1.0, color="grey", lw=0.8)
        right.set(xlabel="evaluation", ylabel="parameter over that of the test")
        right.legend()
        figure.savefig(args.output / "calibration.png")
    return report.finish("test")


if __name__ == "__main__":
    sys.exit(main())
