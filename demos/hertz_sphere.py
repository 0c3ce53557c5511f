"""Hertz: two equal elastic spheres pressed together (3D, one quarter).

The equators move towards each other by 2 mm each (code_aster's SSNV104). The contact
is as large as a fifth of the radius. Hertz's pressure still fits the force to 1 %,
but his approach, of half-spaces, does not: Tatara's, of whole spheres, does.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem
from scipy.optimize import brentq

import raymortar
from meshes.scenes import two_spheres
from raymortar import io, tools

# Lengths in mm, stresses in MPa
RADIUS, E, NU, PUSH = 50.0, 20e3, 0.3, 2.0
E_STAR = E / (2.0 * (1.0 - NU**2))
# Hertz for an approach of 4 mm: what the benchmark asks for
HERTZ_PEAK, HERTZ_FORCE, HERTZ_RADIUS = 2798.3287, 586080.6, 10.0


def contact_radius(force):
    """Hertz: radius of the contact."""
    return np.cbrt(0.75 * force * 0.5 * RADIUS / E_STAR)


def tatara(force):
    """Displacement of each equator (Tatara 1991): Hertz's of one sphere, less what the
    load on the opposite pole does."""
    a = contact_radius(force)
    far = np.hypot(a, 2.0 * RADIUS)
    opposite = 2.0 * (1.0 + NU) * RADIUS**2 / far**3 + (1.0 - NU**2) / far
    return 0.75 * (1.0 - NU**2) * force / (E * a) - force * opposite / (np.pi * E)


def main(arguments=None):
    """Run the demo; 0 if it agrees with Hertz and Tatara."""
    parser = common.options("hertz_sphere", __doc__)
    parser.add_argument("--size", type=int, default=12, help="facets across")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=1)
    args = parser.parse_args(arguments)
    comm, degree, size = MPI.COMM_WORLD, args.degree, args.size + 8 * args.fine
    args.output.mkdir(parents=True, exist_ok=True)
    across = {"contact_half_width": HERTZ_RADIUS, "facets_across": size}
    scene = two_spheres(comm, geometry_degree=degree, radius=RADIUS, **across)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    stress = 2 * mu * ufl.sym(ufl.grad(u)) + lmbda * ufl.div(u) * ufl.Identity(3)
    residual = ufl.inner(stress, ufl.grad(v)) * ufl.dx(degree=2 * degree)

    up, down = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)
    held = ("symmetry_x", 0.0, 0), ("symmetry_y", 0.0, 1)
    held += ("top", down, 2), ("bottom", up, 2)
    bcs = [tools.prescribe(V, scene.find(name), w, axis) for name, w, axis in held]
    pair = scene.tags["slave"], scene.tags["master"]
    law = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
    contact = raymortar.Contact(u, scene.facet_tags, [pair], law)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)

    def press(factor):
        # The square, so that the contact grows evenly from step to step
        down.value, up.value = -(factor**2) * PUSH, factor**2 * PUSH

    solver = raymortar.SNESSolver(problem)
    iterations = [s.iterations for s in raymortar.LoadSteps(solver, press, steps=3)]
    # Hertz for four times the force: a quarter is meshed
    force = 4.0 * contact.resultant(0).force[2]
    a = contact_radius(force)
    p0 = 1.5 * force / (np.pi * a**2)
    pressure = contact.pressure()
    on_axis = common.value_at_origin(pressure, scene, "slave")
    # The second moment of Hertz's pressure is force times 2 a^2 / 5
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags)(pair[0])
    X = ufl.SpatialCoordinate(mesh)
    moment = tools.integral(pressure * (X[0] ** 2 + X[1] ** 2) * ds, mesh)
    radius = np.sqrt(2.5 * moment / tools.integral(pressure * ds, mesh))

    report = common.Report(comm)
    report.effort(contact)
    report.newton("load steps", iterations, list(problem.history))
    report.add("peak pressure", on_axis, p0, 0.01, "MPa")
    report.add("contact radius", radius, a, 0.03, "mm")
    expected = brentq(lambda f: tatara(f) - PUSH, 1.0, 4.0 * HERTZ_FORCE)
    report.add("force, against Tatara", force, expected, 0.01, "N")
    report.add("  against Hertz's approach", force, HERTZ_FORCE, None, "N")
    report.add("  peak, from Hertz's approach", on_axis, HERTZ_PEAK, None, "MPa")

    mises = tools.nodal_field(tools.von_mises(stress), mesh, "von Mises stress")
    file = args.output / "hertz_sphere.png"
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, pressure, mises])
    x, p = common.gather_nodes(pressure, scene)
    faces, moved, values = drawing.gather_boundary(mesh, u, mises)
    if comm.rank == 0:
        # The plane y = 0, mirrored, and the pressure over the distance from the axis
        cut = np.all(faces[..., 1] < 1e-9 * RADIUS, axis=1)
        at = (faces + moved)[cut][..., [0, 2]]
        s, r = np.linspace(0.0, a, 300), np.hypot(x[:, 0], x[:, 1])
        hertz = s, p0 * np.sqrt(1.0 - (s / a) ** 2), "Hertz"
        axes = {"xlabel": "distance from the axis (mm)", "xlim": (0.0, 1.4 * a)}
        axes |= {"ylabel": "contact pressure (MPa)", "size": 3}
        drawing.polygons_and_curve(
            file, at, values[cut], "von Mises stress (MPa)", hertz,
            (r, p, "raymortar, at the nodes"), axes, np.array([-2, 2, -2, 2]) * a, (-1, 1),
        )  # fmt: skip
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
