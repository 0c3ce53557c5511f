"""Hertz: two equal elastic spheres pressed together (3D, one quarter).

The equators move towards each other by 2 mm each (code_aster's SSNV104). The contact
is as large as a fifth of the radius. Hertz's pressure still fits the force to 1 %,
but his approach, of half-spaces, does not: Tatara's, of whole spheres, does.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import two_spheres
from raymortar import io, tools

# Lengths in mm, stresses in MPa
RADIUS, E, NU, PUSH = 50.0, 20e3, 0.3, 2.0
E_STAR = E / (2.0 * (1.0 - NU**2))
# Hertz for an approach of 4 mm: what the benchmark asks for
HERTZ_PEAK, HERTZ_FORCE, HERTZ_RADIUS = 2798.3287, 586080.6, 10.0


def contact_radius(force):
    """Hertz: radius of the contact of the two spheres."""
    return np.cbrt(0.75 * force * 0.5 * RADIUS / E_STAR)


def tatara_force(push):
    """Force that moves each equator by `push` (Tatara 1991, linear elastic).

    Hertz's displacement of one sphere, less what the opposite pole's load does.
    """

    def displacement(force):
        a = contact_radius(force)
        far = np.hypot(a, 2.0 * RADIUS)
        opposite = 2.0 * (1.0 + NU) * RADIUS**2 / far**3 + (1.0 - NU**2) / far
        return 0.75 * (1.0 - NU**2) * force / (E * a) - force * opposite / (np.pi * E)

    low, high = 0.0, 4.0 * HERTZ_FORCE
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if displacement(middle) < push else (low, middle)
    return low


def solve(comm, facets_across=12, degree=1, cell="hexahedron", steps=3, **options):
    """Push the equators of the two spheres towards each other.

    `options` are those of `raymortar.Contact`.
    """
    scene = two_spheres(
        comm,
        cell,
        geometry_degree=degree,
        radius=RADIUS,
        contact_half_width=HERTZ_RADIUS,
        facets_across=facets_across,
    )
    mesh, tags = scene.mesh, scene.tags

    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    stress = bodies.hooke(u, E, NU)
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    F = ufl.inner(stress, bodies.small_strain(v)) * dx

    top, bottom = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)
    bcs = [
        tools.prescribe(V, scene.find("symmetry_x"), component=0),
        tools.prescribe(V, scene.find("symmetry_y"), component=1),
    ]
    bcs += [
        tools.prescribe(V, scene.find("top"), top, 2),
        tools.prescribe(V, scene.find("bottom"), bottom, 2),
    ]

    pair = (tags["slave"], tags["master"])
    contact = raymortar.Contact(u, scene.facet_tags, [pair], **options)
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    solver = raymortar.SNESSolver(problem)

    def apply(factor):
        # The square, so that the contact grows evenly from step to step
        top.value, bottom.value = -(factor**2) * PUSH, factor**2 * PUSH

    path = raymortar.LoadSteps(solver, apply, steps).run()
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        stress=stress,
        iterations=[step.iterations for step in path],
        history=list(problem.history),
    )


def measure(result):
    """Force, pressure on the axis and radius of the contact. Collective."""
    scene, contact = result.scene, result.contact
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    ds = ds(scene.tags["slave"])
    p, X = -contact.multiplier, ufl.SpatialCoordinate(scene.mesh)
    force = 4.0 * contact.resultant(0).force[2]
    moment = tools.integral(p * (X[0] ** 2 + X[1] ** 2) * ds, scene.mesh)
    return SimpleNamespace(
        force=force,
        a=contact_radius(force),
        p0=1.5 * force / (np.pi * contact_radius(force) ** 2),
        axis=-common.value_at_origin(contact.multiplier, scene, "slave"),
        # The second moment of Hertz's pressure is force times 2 a^2 / 5
        radius=np.sqrt(2.5 * moment / tools.integral(p * ds, scene.mesh)),
    )


def draw(result, found, path):
    """Pressure over the radius, the cut through the contact, and both bodies."""
    scene = result.scene
    mises = tools.von_mises(result.stress)
    mises = tools.nodal_field(mises, scene.mesh, "von Mises stress")
    pressure = common.pressure_field(result.contact)
    io.write_xdmf(path.with_suffix(".xdmf"), scene.mesh, [result.u, pressure, mises])
    nodes = common.gather_nodes(pressure, scene)
    faces = drawing.gather_boundary(scene.mesh, result.u, mises)
    rings = ring_means(result, found.a / 8.0, 11)
    if scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig = plt.figure(figsize=(12.5, 4.2))
    left, middle = (
        fig.add_axes(box) for box in ((0, 0.12, 0.27, 0.8), (0.33, 0.12, 0.29, 0.8))
    )
    draw_pressure(left, *nodes, rings, found)
    colours = draw_cut(middle, *faces, found)
    right = fig.add_axes((0.66, 0.0, 0.32, 1.0), projection="3d")
    draw_bodies(right, *faces)
    bar = fig.add_axes((0.985, 0.17, 0.01, 0.65))
    fig.colorbar(colours, cax=bar, label="von Mises stress [MPa]")
    fig.savefig(path)


def ring_means(result, width, count):
    """Mean pressure on rings around the axis, which evens out how single facets lie:
    mean distances from the axis, and pressures. Collective."""
    scene, p = result.scene, -result.contact.multiplier
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    ds = ds(scene.tags["slave"], metadata={"quadrature_degree": 20})
    X, inner = ufl.SpatialCoordinate(scene.mesh), fem.Constant(scene.mesh, 0.0)
    r = ufl.sqrt(X[0] ** 2 + X[1] ** 2)
    is_in = ufl.conditional(ufl.And(r >= inner, r < inner + width), 1.0, 0.0)
    found = []
    for k in range(count):
        inner.value = k * width
        found.append([tools.integral(f * is_in * ds, scene.mesh) for f in (1.0, r, p)])
    area, moment, force = np.array(found).T
    return moment / area, force / area


def draw_pressure(axes, x, p, rings, found):
    """Hertz's pressure over the distance from the axis, ours at the nodes and on rings."""
    s = np.sin(np.linspace(0.0, 0.5, 300) * np.pi)
    exact = found.p0 * np.sqrt(1.0 - s**2)
    axes.plot(found.a * s, exact, color=drawing.EXACT, lw=1.5, label="Hertz")
    r = np.hypot(x[:, 0], x[:, 1])
    near, style = r < 1.4 * found.a, dict(color=drawing.COMPUTED, mfc="none", ms=4)
    axes.plot(r[near], p[near, 0], "o", ms=2, color="0.65", label="at single nodes")
    axes.plot(*rings, "o", label="mean of a ring", **style)
    axes.set(
        xlabel="distance from the axis [mm]",
        ylabel="contact pressure [MPa]",
        ylim=(0, None),
        xlim=(0, None),
    )
    axes.legend(loc="lower left")


def draw_cut(axes, x, u, mises, found):
    """Stress in the plane y = 0 around the contact, deformed and mirrored."""
    cut = np.all(x[..., 1] < 1e-9 * RADIUS, axis=1)
    at, images = (x + u)[cut][..., [0, 2]], [(-1, 1), (1, 1)]
    colours = drawing.draw_field(axes, at, mises[cut], images)
    half = 2.2 * found.a
    axes.set(xlim=(-half, half), ylim=(-half, half))
    axes.set(xlabel="x [mm]", ylabel="z [mm]")
    return colours


def draw_bodies(axes, x, u, mises):
    """The deformed quarter, seen from the axis."""
    drawing.draw_surface(axes, x + u, mises.mean(axis=(1, 2)), azimuth=-135)


def main(arguments=None):
    """Run the demo; 0 if it agrees with Hertz and Tatara."""
    parser = common.options("hertz_sphere", __doc__)
    parser.add_argument("--size", type=int, default=12, help="facets across")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=1)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    result = solve(comm, args.size + (8 if args.fine else 0), args.degree)
    found = measure(result)

    report = common.Report(comm)
    report.effort(result.contact)
    report.newton("load steps", result.iterations, result.history)
    report.add("peak pressure", found.axis, found.p0, 0.01, "MPa")
    report.add("contact radius", found.radius, found.a, 0.03, "mm")
    report.add("force, against Tatara", found.force, tatara_force(PUSH), 0.01, "N")
    report.add("  against Hertz's approach", found.force, HERTZ_FORCE, None, "N")
    report.add("  peak, from Hertz's approach", found.axis, HERTZ_PEAK, None, "MPa")
    args.output.mkdir(parents=True, exist_ok=True)
    draw(result, found, args.output / "hertz_sphere.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
