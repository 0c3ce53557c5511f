"""Two concentric spherical shells squeezed between plates (3D, one eighth).

The shells touch each other all over, the outer one two smooth stiff plates. Closing
the gap between these flattens the poles. The scene is after Puso and Laursen (2004),
without friction. All of it is symmetric about the axis through the poles: the same
scene in the plane of a meridian is solved on a fine mesh, for comparison.
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
from scipy.interpolate import CubicSpline

import raymortar
from meshes.shells import OUTER, SHELLS, TAGS, meridian_of, scene_of
from raymortar import io, tools

NU, PLATE = 0.3, 1000.0  # PLATE: modulus of the plates; the shells' is 1
# From here on the shells buckle, as the meshes have it
SMOOTH = 5.0


def squeeze(scene, steps, closing, file=None):
    """Close the plates; force of the whole plate and stored energy. Collective."""
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v, d = fem.Function(V, name="u"), ufl.TestFunction(V), mesh.geometry.dim
    moduli = {"inner": 1.0, "outer": 1.0, "plate": PLATE}
    E = tools.by_body(mesh, scene.cell_tags, moduli, scene.bodies)
    law, H, weight = bodies.NeoHookean(E, NU), ufl.grad(u), 1
    if d == 2:
        # Without friction nothing but the volume has to know that the figure turns: the
        # multiplier is the pressure times the length 2 pi x of the circle it acts on
        x, plane = ufl.SpatialCoordinate(mesh)[0], [[*H[i, :], 0] for i in (0, 1)]
        H, weight = ufl.as_tensor([*plane, [0, 0, u[0] / x]]), 2 * ufl.pi * x
    energy = weight * law.density(ufl.Identity(3) + H) * ufl.dx(degree=4)

    down = fem.Constant(mesh, np.zeros(d))
    grip = tools.prescribe(V, scene.find("moved"), down)
    planes = enumerate("xyz" if d == 3 else "xz")
    bcs = [tools.prescribe(V, scene.find(name), component=i) for i, name in planes]
    pairs = [("inner", "outer"), ("roof", "plate")]
    search = raymortar.Search(reach=3.0, depth=2.0)
    contact = raymortar.Contact(u, scene.facet_tags, pairs, search=search, names=TAGS)
    residual = ufl.derivative(energy, u, v)
    problem = raymortar.NonlinearProblem(residual, contact, [grip, *bcs])
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})
    history = raymortar.History(problem, file, {"grip": grip}, energy=energy)

    def close(factor):
        down.value[-1] = -0.5 * closing * factor

    # Meshes that approximate the same sphere overlap a little
    history.record(0.0, solver.solve()[0])
    contact.advance()
    raymortar.LoadSteps(solver, close, steps, history=history).run()
    # A quarter of the plate is meshed, or all of it, of one half
    parts, up = (4.0, "z") if d == 3 else (1.0, "y")
    return SimpleNamespace(
        u=u, contact=contact, law=law, history=history,
        closing=closing * history["time"], force=-parts * history[f"force_roof_plate_{up}"],
        held=-parts * history[f"reaction_grip_{up}"], energy=2 * parts * history["energy"],
    )  # fmt: skip


def meridian(comm, steps=10, closing=SMOOTH, shells=SHELLS, plate=OUTER):
    """The same as bodies of revolution, 24 cells from pole to equator. Collective."""
    return squeeze(meridian_of(comm, 24, 2, shells, plate), steps, closing)


def main(arguments=None):
    """Run the demo; 0 if force and energy are right."""
    parser = common.options("shells", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells along an edge")
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--closing", type=float, default=SMOOTH, help="at most 5")
    args = parser.parse_args(arguments)
    comm, factor, closing = MPI.COMM_WORLD, 2 if args.fine else 1, args.closing
    size, steps = args.size * factor, args.steps * factor
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "shells.csv"
    space = squeeze(scene_of(comm, size, 1), steps, closing, file)
    plane = meridian(comm, steps, closing)

    report, u, mesh = common.Report(comm), space.u, space.u.function_space.mesh
    report.effort(space.contact, space.history["iterations"])
    report.add("force, reaction", space.force[-1], space.held[-1], 1e-6)
    # By a cubic through the steps, which are few
    work = float(CubicSpline(space.closing, space.force).integrate(0, closing))
    stored = space.energy[-1] - space.energy[0]
    report.add("work of the plates, energy", work, stored, 0.01)
    for at in np.unique([*np.arange(1.0, closing), closing]):
        ours, theirs = (np.interp(at, run.closing, run.force) for run in (space, plane))
        report.add(f"force, closed by {at:g}", ours, theirs, 0.15 / size)

    mises = space.law.mises(u, 1, 4)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, space.contact.multiplier, mises])
    x, moved, values = drawing.gather_boundary(mesh, u, mises)
    if comm.rank == 0:
        # The plane x = 0, mirrored
        cut = np.abs(x[..., 0]).max(axis=1) < 1e-9
        at, axes = (x + moved)[cut][..., 1:], {"xlabel": "closing", "ylabel": "force"}
        exact = plane.closing, plane.force, "bodies of revolution"
        found = space.closing, space.force, "one eighth, 3D"
        parts = at, values[cut], "von Mises stress / E", exact, found, axes
        box, path = (-17, 17, 0, 16), file.with_suffix(".png")
        drawing.polygons_and_curve(path, *parts, box, (-1, 1))
    return report.finish("reference")


if __name__ == "__main__":
    sys.exit(main())
