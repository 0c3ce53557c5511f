"""Cattaneo and Mindlin: partial slip between two equal elastic cylinders (2D).

Two half cylinders are pressed together and then sheared by less than friction could
carry. The contact keeps sticking in its middle and slips at its edges. Normal and
tangential traction have closed forms for the forces that are found (Johnson 1985, 7.2).
The data are those of Gitterle (2012), but the cuts are moved, not loaded.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import two_cylinders
from raymortar import io, tools
from raymortar.plotting.gathering import gather

# Lengths in mm, stresses in MPa, forces in N per mm of length
RADIUS, E, NU, FRICTION, WIDTH = 8.0, 200.0, 0.3, 0.2, 0.68
PRESS, SLIDE = 0.092, 0.0098  # of each cut


def strain(w):
    """Plane strain, 3 x 3."""
    e = ufl.sym(ufl.grad(w))
    return ufl.as_tensor([[e[0, 0], e[0, 1], 0], [e[1, 0], e[1, 1], 0], [0, 0, 0]])


def main(arguments=None):
    """Run the demo; 0 if it agrees with the closed forms."""
    parser = common.options("cattaneo_mindlin", __doc__)
    parser.add_argument("--size", type=int, default=20, help="facets across")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    across = {"contact_half_width": WIDTH, "facets_across": size, "master_ratio": 0.8}
    scene = two_cylinders(comm, geometry_degree=2, radius=RADIUS, **across)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    stress = 2 * mu * strain(u) + lmbda * ufl.div(u) * ufl.Identity(3)
    residual = ufl.inner(stress, strain(v)) * ufl.dx
    cuts = {name: fem.Constant(mesh, (0.0, 0.0)) for name in ("top", "bottom")}
    bcs = [tools.prescribe(V, scene.find(name), cuts[name]) for name in cuts]
    pair, law = (scene.tags["slave"], scene.tags["master"]), raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=law)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    # Full steps would cycle where points hop between stick and slip
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})

    def move(slide, press):
        cuts["top"].value[:] = slide, -press
        cuts["bottom"].value[:] = -slide, press

    # Solves that are not accepted, while it is pressed, leave no history of friction
    iterations = []
    for share in (0.25, 0.5, 0.75, 1.0):
        move(0.0, PRESS * share**2)
        iterations.append(solver.solve()[0])
    contact.advance()
    path = raymortar.LoadSteps(solver, lambda t: move(SLIDE * t, PRESS), steps=4)
    iterations += [step.iterations for step in path]

    # Half-widths of contact and of stick, and peak pressure, of the forces found
    shear, force = np.abs(contact.resultant().force)
    b = 2.0 * np.sqrt(force * RADIUS * (1.0 - NU**2) / (np.pi * E))
    c = b * np.sqrt(1.0 - shear / (FRICTION * force))
    p0 = 2.0 * force / (np.pi * b)

    # Tractions along the deformed normal and across, and their closed forms
    t, x = contact.multiplier, ufl.SpatialCoordinate(mesh)[0]
    n = ufl.inv(ufl.Identity(2) + ufl.grad(u)).T * ufl.FacetNormal(mesh)
    n = n / ufl.sqrt(ufl.inner(n, n))
    found = -ufl.inner(t, n), t[0] * n[1] - t[1] * n[0]
    B, C, P0 = (fem.Constant(mesh, one) for one in (b, c, p0))
    outer, inner = (ufl.sqrt(ufl.max_value(0, 1 - (x / w) ** 2)) for w in (B, C))
    exact = P0 * outer, FRICTION * P0 * (outer - C / B * inner)
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags)
    ds = ds(pair[0], metadata={"quadrature_degree": 8})

    report = common.Report(comm)
    report.effort(contact)
    report.newton("press and shear", iterations, list(problem.history))
    # The second moment of Hertz's pressure is force times b^2 / 4
    moment, total = (tools.integral(found[0] * x**k * ds, mesh) for k in (2, 0))
    width = 2.0 * np.sqrt(moment / total)
    report.add("half-width (second moment)", width, b, 0.01, "mm")
    for name, f, g, most in zip(("normal", "tangential"), found, exact, (0.03, 0.06)):
        off = tools.integral((f - g) ** 2 * ds, mesh)
        off /= tools.integral(g**2 * ds, mesh)
        report.add(f"{name} traction, 1 + error", 1.0 + np.sqrt(off), 1.0, most)

    mises = tools.nodal_field(tools.von_mises(stress), mesh, "mises")
    file = args.output / "cattaneo_mindlin.png"
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, t, mises])
    points = contact.points()
    hit = points["status"] > 0
    at, T, N = (gather(comm, points[k][hit]) for k in ("x", "traction", "normal"))
    if comm.rank == 0:
        p, q = -np.einsum("qi,qi->q", T, N), T[:, 0] * N[:, 1] - T[:, 1] * N[:, 0]
        at = np.tile(at[:, 0], 2), np.append(p, q / FRICTION), "raymortar, at points"
    s = b * np.sin(np.linspace(-0.5, 0.5, 801) * np.pi)
    outer, inner = (np.sqrt(np.maximum(0.0, 1.0 - (s / w) ** 2)) for w in (b, c))
    hertz = p0 * outer, [np.nan], p0 * (outer - c / b * inner)
    curve = np.concatenate([s, [np.nan], s]), np.concatenate(hertz), "Hertz, Mindlin"
    look = {"xlabel": "x (mm)", "ylabel": "pressure; friction / coefficient (MPa)"}
    look |= {"xlim": (-1.2 * b, 1.2 * b), "size": 3}
    label, box = "von Mises stress (MPa)", (-3 * b, 3 * b, -3 * b, 3 * b)
    drawing.field_and_curve(file, u, mises, label, curve, at, look, box)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
