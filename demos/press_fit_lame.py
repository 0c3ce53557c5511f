"""Press fit of a shaft in a hub by an offset: plane stress, plane strain, axisymmetric.

Both are meshed to touch; the interference is `offset`. Lame's solution of thick rings
has the pressure between them and the stresses in both. In the plane a quarter is
meshed, 32 facets around the whole; with `axisymmetric=True` a section in (r, z), with
ends that are free, as in plane stress, or held along the axis, as in plane strain.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.shaft import HUB, SHAFT, quarters, sections
from raymortar import io, tools

# Lengths in mm, stresses in MPa
E, NU, INTERFERENCE = 2.1e5, 0.3, 0.05
# Whether it is a section in (r, z), and whether nothing moves along the axis
CASES = {
    "plane stress": (False, False),
    "plane strain": (False, True),
    "axisymmetric, free ends": (True, False),
    "axisymmetric, held ends": (True, True),
}


def lame(held):
    """Pressure between shaft and hub in plane strain, where held, or plane stress."""
    e, nu = (E / (1.0 - NU**2), NU / (1.0 - NU)) if held else (E, NU)
    hub = (HUB**2 + SHAFT**2) / (HUB**2 - SHAFT**2) + nu
    return INTERFERENCE * e / SHAFT / (1.0 - nu + hub)


def draw(u, stress, path):
    """The quarter in plane strain, and radial and hoop stress with Lame's. Collective."""
    mesh, p = u.function_space.mesh, lame(True)
    x = ufl.SpatialCoordinate(mesh)
    out = ufl.as_vector([x[0], x[1], 0]) / ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    around = ufl.as_vector([-out[1], out[0], 0])
    parts = [ufl.inner(n, stress * n) for n in (out, around)]
    mises, *fields = [
        tools.nodal_field(f, mesh, "f") for f in (tools.von_mises(stress), *parts)
    ]
    cells = [drawing.gather_cells(mesh, u, f, parts=1) for f in fields]
    ratio, found, exact, r = SHAFT**2 / (HUB**2 - SHAFT**2), None, [], None
    if mesh.comm.rank == 0:
        r = np.linalg.norm(cells[0][0], axis=-1).ravel()
        found = [np.tile(r, 2), np.ravel([f for _, _, f in cells]), "raymortar, nodes"]
    hub, shaft = np.linspace(SHAFT, HUB, 100), np.array([0.0, SHAFT, np.nan])
    for sign in (-1.0, 1.0):
        rings = p * ratio * (1.0 + sign * (HUB / hub) ** 2)
        exact.append([[*shaft, *hub, np.nan], [-p, -p, np.nan, *rings, np.nan]])
    exact = (*np.concatenate(exact, axis=1), "Lamé")
    axes = {"xlabel": "radius (mm)", "ylabel": "radial and hoop stress (MPa)"}
    label, axes = "von Mises stress (MPa)", axes | {"ylim": (None, None), "size": 3}
    drawing.field_and_curve(path, u, mises, label, exact, found, axes)


def main(arguments=None):
    """Run the demo; 0 if it agrees with Lame's solution."""
    parser = common.options("press_fit_lame", __doc__)
    parser.add_argument("--size", type=int, default=8, help="facets on a quarter's arc")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    report, file = common.Report(comm), args.output / "press_fit_lame.png"
    for name, (turns, held) in CASES.items():
        plane = quarters, (comm, size, size + size // 4)
        make, sizes = (sections, (comm, size // 2)) if turns else plane
        scene = make(*sizes)
        mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
        u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
        x = ufl.SpatialCoordinate(mesh)
        e, nu = E, NU
        if not (turns or held):  # moduli that make plane strain of plane stress
            e, nu = E * (1.0 + 2.0 * NU) / (1.0 + NU) ** 2, NU / (1.0 + NU)
        mu, lmbda = e / (2 * (1 + nu)), e * nu / ((1 + nu) * (1 - 2 * nu))

        def strain(w):
            g, hoop = ufl.sym(ufl.grad(w)), w[0] / x[0] if turns else 0
            return ufl.as_tensor(
                [[g[0, 0], g[0, 1], 0], [g[1, 0], g[1, 1], 0], [0, 0, hoop]]
            )

        stress = 2 * mu * strain(u) + lmbda * ufl.tr(strain(u)) * ufl.Identity(3)
        weight = 2 * ufl.pi * x[0] if turns else 1
        residual = weight * ufl.inner(stress, strain(v)) * ufl.dx(degree=6)
        bcs = [tools.prescribe(V, scene.find("left"), component=0)]
        bcs.append(tools.prescribe(V, scene.find("bottom"), component=1))
        if turns and held:
            bcs.append(tools.prescribe(V, scene.find("top"), component=1))

        pair = scene.tags["slave"], scene.tags["master"]
        options = {"offset": -INTERFERENCE, "axisymmetric": turns}
        contact = raymortar.Contact(u, scene.facet_tags, [pair], **options)
        problem = raymortar.NonlinearProblem(residual, contact, bcs)
        problem.solve()

        points = contact.points()
        p = -np.einsum("qi,qi->q", points["traction"], points["normal"])
        sums = np.array([points["weight"] @ p, points["weight"].sum()])
        force, area = comm.allreduce(sums)
        report.effort(contact)
        report.newton(name, [len(problem.history) - 1], problem.history)
        report.add(name, force / area, lame(held), 2e-3, "MPa")
        if name == "plane strain":
            draw(u, stress, file)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, common.pressure_field(contact)])
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
