"""Hertz: an elastic cylinder pressed on an elastic block (2D, plane strain).

One half of the symmetric scene is meshed. The contact pressure and the half-width
are compared with Hertz's formulas for the force that was found. `NAFEMS` is the benchmark of NAFEMS
(Konter 2006), loaded by a force.
"""

from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import cylinder_on_block
from raymortar import tools
from raymortar.core import compat

# Steel on aluminium. Lengths in mm, stresses in MPa, forces in N per mm of length
E_CYLINDER, E_BLOCK, NU = 210e3, 70e3, 0.3
E_STAR = 1.0 / ((1.0 - NU**2) * (1.0 / E_CYLINDER + 1.0 / E_BLOCK))

SMALL = SimpleNamespace(radius=10.0, block=(60.0, 30.0), half_width=0.4, growth=1.2)
NAFEMS = SimpleNamespace(
    radius=50.0, block=(200.0, 200.0), half_width=6.21464, growth=1.1
)

# The slave has the larger facets: a finer one would feel the edges of the block's, and
# pressures at its nodes would zigzag by 7 % of the peak
MASTER_RATIO = 0.8


def force_of(half_width, radius):
    """Hertz: line load that makes a contact of this half-width."""
    return np.pi * E_STAR * half_width**2 / (4.0 * radius)


def approach(force, case):
    """Estimate of how far the cut of the cylinder moves (Johnson 1985, 5.6)."""
    a, depth = case.half_width, case.block[1]
    cylinder = (2.0 * np.log(4.0 * case.radius / a) - 1.0) / E_CYLINDER
    block = (2.0 * np.log(2.0 * depth / a) - NU / (1.0 - NU)) / E_BLOCK
    return force * (1.0 - NU**2) / np.pi * (cylinder + block)


def solve(
    comm,
    case,
    facets_across=20,
    degree=1,
    cell="quadrilateral",
    force=None,
    method=None,
    master_ratio=1.25,
    make_solver=raymortar.SNESSolver,
    smooth=False,
):
    """Press the cylinder on the block: by a displacement, then by a force if given."""
    scene = cylinder_on_block(
        comm,
        cell,
        geometry_degree=degree,
        radius=case.radius,
        block_size=case.block,
        contact_half_width=case.half_width,
        facets_across=facets_across,
        master_ratio=master_ratio,
        growth=case.growth,
    )
    mesh, tags = scene.mesh, scene.tags

    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)

    E = fem.Function(compat.space(mesh, "DG", 0))
    E.x.array[:] = E_CYLINDER
    E.x.array[scene.cell_tags.find(scene.bodies["lower"])] = E_BLOCK
    stress = bodies.hooke(u, E, NU)

    ds = ufl.Measure("ds", domain=mesh, subdomain_data=scene.facet_tags)
    load = fem.Constant(mesh, 0.0)
    F = ufl.inner(stress, bodies.small_strain(v)) * ufl.dx + load * v[1] * ds(
        tags["top"]
    )

    top = fem.Constant(mesh, 0.0)
    supports = [tools.prescribe(V, scene.find("symmetry_x"), component=0)]
    supports += [tools.prescribe(V, scene.find("bottom"), component=i) for i in (0, 1)]
    push = tools.prescribe(V, scene.find("top"), top, 1)

    pair = (tags["slave"], tags["master"])
    contact = raymortar.Contact(u, scene.facet_tags, [pair], method, smooth=smooth)
    problem = raymortar.NonlinearProblem(F, contact, supports + [push])
    solver = make_solver(problem)

    target = approach(force_of(case.half_width, case.radius), case)

    def apply(factor):
        # The square, so that the contact grows evenly from step to step
        top.value = -(factor**2) * target

    steps = raymortar.LoadSteps(solver, apply, steps=4).run()
    iterations = [step.iterations for step in steps]
    if force is not None:
        # A force cannot hold bodies that only just touch: it takes over here
        load.value = force / (2.0 * case.radius)
        problem = raymortar.NonlinearProblem(F, contact, supports)
        iterations.append(make_solver(problem).solve()[0])
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        stress=stress,
        iterations=iterations,
        history=list(problem.history),
    )


def measure(result, case):
    """Force, peak and half-width of the contact, ours and Hertz's. Collective."""
    scene, contact = result.scene, result.contact
    mesh = scene.mesh
    # Half of the scene is meshed
    force = 2.0 * contact.resultant(0).force[1]
    a = np.sqrt(4.0 * force * case.radius / (np.pi * E_STAR))
    p0 = 2.0 * force / (np.pi * a)

    rule = {"quadrature_degree": 8}
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags, metadata=rule)
    ds = ds(scene.tags["slave"])
    p, X = -contact.multiplier, ufl.SpatialCoordinate(mesh)
    # Constants: a number would be compiled into the form
    half_width, peak = fem.Constant(mesh, a), fem.Constant(mesh, p0)
    hertz = peak * ufl.sqrt(ufl.max_value(0, 1 - (X[0] / half_width) ** 2))
    error = tools.integral((p - hertz) ** 2 * ds, mesh)
    moment = tools.integral(p * X[0] ** 2 * ds, mesh)

    points = contact.points()
    closed = points["x"][points["status"] >= 2, 0]
    return SimpleNamespace(
        force=force,
        a=a,
        p0=p0,
        peak=mesh.comm.allreduce(
            -contact.multiplier.x.array.min(initial=0.0), op=MPI.MAX
        ),
        # The second moment of Hertz's pressure is force times a^2 / 4
        half_width=2.0 * np.sqrt(moment / tools.integral(p * ds, mesh)),
        edge=mesh.comm.allreduce(closed.max(initial=0.0), op=MPI.MAX),
        l2=np.sqrt(error / tools.integral(hertz**2 * ds, mesh)),
    )


def settling(result):
    """Vertical displacement of the block's surface at the centre. Collective."""
    return common.value_at_origin(result.u, result.scene, "master", component=1)
