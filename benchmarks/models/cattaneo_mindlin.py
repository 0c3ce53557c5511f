"""Cattaneo and Mindlin: partial slip between two equal elastic cylinders (2D).

Two half cylinders are pressed together by a force and then sheared by a smaller one
than friction could carry. The contact keeps sticking in its middle and slips at its
edges. Normal and tangential traction have closed forms (Johnson 1985, 7.2); the data
are those of Gitterle (2012).

Both cuts carry the loads, so that the scene is symmetric and friction does nothing
before the shear. Dead pressures cannot hold bodies that only just touch, nor keep one
cylinder upright on the other, so that

1. the upper cut is first moved down by about what the force will need;
2. the pressure takes over, from this first guess and within the same step: the
   history knows nothing of the guess. Pins carry no force, as all is in balance;
3. the cuts are held where the pressure has put them, so that they cannot tilt under
   the shear, which is then applied in several steps.
"""

from types import SimpleNamespace

import bodies
import common
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import two_cylinders
from raymortar import tools
from raymortar.core import compat

# Lengths in mm, stresses in MPa, forces in N per mm of length
RADIUS, E, NU, FRICTION = 8.0, 200.0, 0.3, 0.2
PRESSURE, SHEAR = 0.625, 0.05851  # on the cuts
FORCE, SHEAR_FORCE = 2.0 * RADIUS * PRESSURE, 2.0 * RADIUS * SHEAR
# Half-widths of contact and of stick, peak pressure
B = 2.0 * np.sqrt(2.0 * RADIUS**2 * PRESSURE * (1.0 - NU**2) / (np.pi * E))
C = B * np.sqrt(1.0 - SHEAR_FORCE / (FRICTION * FORCE))
P0 = 4.0 * RADIUS * PRESSURE / (np.pi * B)
# A full step of Newton's method cycles where points hop between stick and slip
LINE_SEARCH = {"snes_linesearch_type": "l2"}


def pin(V, point, component):
    """Prescribe no displacement of one node."""
    W, _ = V.sub(component).collapse()
    near = fem.locate_dofs_geometrical(
        (V.sub(component), W),
        lambda x: np.hypot(x[0] - point[0], x[1] - point[1]) < 1e-9 * RADIUS,
    )
    return fem.dirichletbc(fem.Function(W), near, V.sub(component))


def hold(u, scene, name, component):
    """Keep one component of the present displacement on a part of the boundary."""
    V = u.function_space
    W, to_u = V.sub(component).collapse()
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological((V.sub(component), W), 1, facets)
    present = fem.Function(W)
    present.x.array[:] = u.x.array[to_u]
    return fem.dirichletbc(present, dofs, V.sub(component))


def solve(
    comm,
    facets_across=20,
    degree=2,
    shear=SHEAR,
    steps=4,
    cell="quadrilateral",
    method=None,
    master_ratio=0.8,
    **options,
):
    """Press the cylinders together by a force, then shear them by another one.

    `options` are those of `raymortar.Contact`.
    """
    scene = two_cylinders(
        comm,
        cell,
        geometry_degree=degree,
        radius=RADIUS,
        contact_half_width=B,
        facets_across=facets_across,
        master_ratio=master_ratio,
    )
    mesh, tags = scene.mesh, scene.tags
    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    stress = bodies.hooke(u, E, NU)
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=scene.facet_tags)
    load = fem.Constant(mesh, (0.0, 0.0))
    F = ufl.inner(stress, bodies.small_strain(v)) * ufl.dx
    F += ufl.inner(load, v) * ds(tags["bottom"]) - ufl.inner(load, v) * ds(tags["top"])

    pair = (tags["slave"], tags["master"])
    contact = raymortar.Contact(
        u, scene.facet_tags, [pair], method, raymortar.Coulomb(FRICTION), **options
    )
    upright = [pin(V, (0.0, y), 0) for y in (-RADIUS, RADIUS)]
    iterations = []

    def solver(*conditions):
        problem = raymortar.NonlinearProblem(F, contact, conditions)
        return raymortar.SNESSolver(problem, LINE_SEARCH)

    # Each half cylinder gives way by about this much (Johnson 1985, 5.6)
    depth = (
        FORCE * (1.0 - NU**2) / (np.pi * E) * (2.0 * np.log(4.0 * RADIUS / B) - 1.0)
    )
    push = [
        tools.prescribe(V, scene.find("bottom"), component=1),
        tools.prescribe(V, scene.find("top"), -2.0 * depth, 1),
    ]
    iterations.append(solver(*upright, *push).solve()[0])

    load.value[1] = -PRESSURE
    iterations.append(solver(*upright, pin(V, (0.0, -RADIUS), 1)).solve()[0])
    contact.advance()
    pressed = contact.resultant(0).force

    def apply(factor):
        load.value[0] = factor * shear

    level = [hold(u, scene, name, 1) for name in ("bottom", "top")]
    last = solver(*level, upright[0])
    iterations += [s.iterations for s in raymortar.LoadSteps(last, apply, steps=steps)]
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        stress=stress,
        pressed=pressed,
        iterations=iterations,
        history=list(last.problem.history),
    )


def deformed_normal(u):
    """Normal of the deformed surface in UFL, not of unit length."""
    F = ufl.Identity(2) + ufl.grad(u)
    return ufl.inv(F).T * ufl.FacetNormal(u.function_space.mesh)


def surface_tractions(u, contact):
    """Normal and tangential traction in UFL; the latter on the lower body."""
    n = deformed_normal(u)
    n = n / ufl.sqrt(ufl.inner(n, n))
    t = contact.multiplier
    return -ufl.inner(t, n), t[0] * n[1] - t[1] * n[0]


def measure(result, shear=SHEAR):
    """Tractions against their closed forms, and forces. Collective."""
    scene, contact = result.scene, result.contact
    mesh = scene.mesh
    ds = ufl.Measure(
        "ds",
        domain=mesh,
        subdomain_data=scene.facet_tags,
        metadata={"quadrature_degree": 8},
    )(scene.tags["slave"])

    def integral(f):
        return mesh.comm.allreduce(fem.assemble_scalar(compat.form(f * ds)))

    def half(x, a):
        return ufl.sqrt(ufl.max_value(1.0 - (x / a) ** 2, 0.0))

    x = ufl.SpatialCoordinate(mesh)[0]
    normal, along = surface_tractions(result.u, contact)
    exact = P0 * half(x, B)
    exact_along = np.sign(shear) * FRICTION * (exact - P0 * C / B * half(x, C))
    off = [
        np.sqrt(integral((f - g) ** 2) / integral(g**2))
        for f, g in ((normal, exact), (along, exact_along))
    ]
    force = contact.resultant(0).force
    return SimpleNamespace(
        normal_off=off[0],
        tangential_off=off[1],
        force=result.pressed[1],
        final_force=force[1],
        shear_force=-force[0],
        # The second moment of Hertz's pressure is force times b^2 / 4
        half_width=2.0 * np.sqrt(integral(normal * x**2) / integral(normal)),
    )


def at_nodes(result):
    """On rank 0: nodes along the slave, normal and tangential traction, status."""
    scene, contact = result.scene, result.contact
    mesh = scene.mesh
    W = contact.multiplier.function_space
    # Normals are of facets: their averages around the nodes
    n = deformed_normal(result.u)
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=scene.facet_tags)
    normals = fem.Function(W)
    sums = compat.create_la_vector(W.dofmap.index_map, W.dofmap.index_map_bs)
    slave = ds(scene.tags["slave"])
    form = compat.form(ufl.inner(n, ufl.TestFunction(W)) * slave)
    compat.assemble_residual(sums.array, form)
    compat.scatter_reverse_add(sums)
    compat.scatter_forward(sums)
    normals.x.array[:] = sums.array
    x, t = common.gather_nodes(contact.multiplier, scene)
    _, n = common.gather_nodes(normals, scene)
    _, status = common.gather_nodes(contact.status(), scene)
    if x is None:
        return None
    order = np.argsort(x[:, 0])
    x, t, n, status = x[order, 0], t[order], n[order], status[order, 0]
    n /= np.linalg.norm(n, axis=1)[:, None]
    normal = -np.sum(t * n, axis=1)
    return x, normal, t[:, 0] * n[:, 1] - t[:, 1] * n[:, 0], status
