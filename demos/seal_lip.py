"""Seal lip: a profile is found that presses evenly on a flat.

A flat lip of rubber (2D, neo-Hookean) presses hardest in its middle. L-BFGS-B finds a
profile, a polynomial, by exact gradients by the positions of the mesh's nodes.
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

HALF, HEIGHT, OVERLAP = 2.0, 2.0, 0.2  # mm
E, NU, WANTED = 5.0, 0.45, 1.0  # modulus and pressure in MPa
DEGREES = np.arange(0, 12, 2)  # of Chebyshev's polynomials
SCALE, MOST = 0.05, 30  # size of coefficients, mm; evaluations


class Lip:
    """The lip with any profile."""

    def __init__(self, comm, n):
        corners, cells = np.array([[-HALF, 0.0], [HALF, HEIGHT]]), [2 * n, n]
        mesh = create_rectangle(comm, corners, cells, CellType.quadrilateral)
        ends = [lambda x, y=y: np.isclose(x[1], y) for y in (0.0, HEIGHT)]
        bottom, top = (locate_entities_boundary(mesh, 1, one) for one in ends)
        self.facet_tags, self.tags = meshtags(mesh, 1, np.sort(top), 1), {"slave": 1}
        self.mesh, V = mesh, tools.vector_space(mesh, 1)
        self.u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
        mu, bulk = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
        F = ufl.Identity(2) + ufl.grad(self.u)
        J, inverse = ufl.det(F), ufl.inv(F).T
        P = mu * (F - inverse) + (bulk - 2 * mu / 3) * ufl.ln(J) * inverse
        self.form = ufl.inner(P, ufl.grad(v)) * ufl.dx(degree=4)
        self.bcs, self.flat = [tools.prescribe(V, bottom)], mesh.geometry.x.copy()
        self.ds = ufl.ds(1, domain=mesh, subdomain_data=self.facet_tags, degree=4)
        self.motions = [fem.Function(V) for _ in DEGREES]
        for one, degree in zip(self.motions, DEGREES):
            one.interpolate(lambda x: (0.0 * x[0], height(x, degree)))

    def press(self, profile):
        """Press the lip with a profile on the flat; return contact and problem."""
        x, self.u.x.array[:] = self.flat.T, 0.0
        self.mesh.geometry.x[:, 1] = x[1] + profile @ [height(x, k) for k in DEGREES]
        flat = rigid.Body(rigid.Line((0.0, 1.5 * HEIGHT), (0.0, -1.0)))
        law = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
        contact = raymortar.Contact(self.u, self.facet_tags, [(1, flat)], law)
        flat.move((0.0, -0.5 * HEIGHT - OVERLAP))
        problem = raymortar.NonlinearProblem(self.form, contact, self.bcs)
        problem.solve()
        return contact, problem

    def gradient(self, profile):
        """Deviation from the wanted pressure, and its gradient by the profile."""
        contact, problem = self.press(profile)
        deviation = (contact.multiplier[1] / WANTED + 1.0) ** 2 / 2 / HALF * self.ds
        slope = adjoint.gradient(deviation, problem, adjoint.coordinates(self.mesh))
        own = slope.function_space.dofmap.index_map.size_local * 2
        rows = [one.x.array[:own] for one in self.motions]
        value, comm = fem.assemble_scalar(fem.form(deviation)), self.mesh.comm
        return comm.allreduce(value), comm.allreduce(rows @ slope.x.array[:own])


def height(x, degree):
    """Motion of points by the coefficient of a polynomial."""
    return np.cos(degree * np.arccos(np.clip(x[0] / HALF, -1.0, 1.0))) * x[1] / HEIGHT


def draw(path, found):
    """Draw profiles and pressures of both lips."""
    figure, (left, right) = drawing.pyplot().subplots(1, 2, figsize=(10, 4))
    for name, (x, pressure, profile) in found.items():
        left.plot(x, profile @ [height((x, HEIGHT), k) for k in DEGREES], label=name)
        right.plot(x, pressure, ".-", label=name)
    left.set(xlabel="x (mm)", ylabel="profile (mm)")
    right.axhline(WANTED, color="grey", lw=0.8)
    right.set(xlabel="x (mm)", ylabel="contact pressure (MPa)", ylim=(0.0, None))
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if the pressure is even."""
    args = common.options("seal_lip", __doc__).parse_args(arguments)
    args.output.mkdir(parents=True, exist_ok=True)
    comm, tried, lips = MPI.COMM_WORLD, [], {}
    report, lip = common.Report(comm), Lip(comm, 32 if args.fine else 16)

    def deviation(scaled):
        value, slope = lip.gradient(SCALE * scaled)
        tried.append(value)
        report.say(f"{len(tried):2}: deviation {np.sqrt(value):.2e}")
        return value, SCALE * slope

    best = minimize(deviation, np.zeros(len(DEGREES)), jac=True, method="L-BFGS-B",
                    options={"maxfun": MOST, "ftol": 1e-7, "gtol": 1e-7})  # fmt: skip
    for name, profile in (("flat", 0.0 * best.x), ("found", SCALE * best.x)):
        pressure = lip.press(profile)[0].pressure()
        x, pressure = comm.bcast(common.gather_nodes(pressure, lip))
        order, allowed = np.argsort(x[:, 0]), 0.04 if name == "found" else None
        lips[name] = x[order, 0], pressure[order, -1], profile
        report.add(f"least pressure, {name}", pressure.min(), WANTED, allowed, "MPa")
        report.add(f"largest pressure, {name}", pressure.max(), WANTED, allowed, "MPa")
    io.write_xdmf(args.output / "seal_lip.xdmf", lip.mesh, [lip.u])
    if comm.rank == 0:
        draw(args.output / "seal_lip.png", lips)
    return max(report.finish("wanted"), int(len(tried) > MOST))


if __name__ == "__main__":
    sys.exit(main())
