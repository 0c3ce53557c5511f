"""Forming: a sheet is bent into a die by a punch, and springs back (2D, plane strain).

Die and punch are rigid: the die lines with fillets, the punch a circle. Both sides of
the sheet are slaves; its own weight and contact alone hold it up and down. The sheet is
elastoplastic: it springs back by the curvature that unloads an elastic beam.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import plasticity
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools
from raymortar.plotting.tools import curves

# Any consistent units; forces per thickness. Half of the sheet and of the tools
E, NU, FRICTION, WEIGHT, LENGTH, THICKNESS = 1000.0, 0.3, 0.05, 1e-4, 2.4, 0.1
OPENING, ROUND, DEEP, NOSE, DEPTH, SMALL, ABOVE = 1.0, 0.3, 1.4, 0.6, 0.25, 0.02, 0.3
YIELD, HARDENING, TAGS = 5.0, 50.0, {"left": 1, "top": 2, "bottom": 3}
BOX = np.array([[-2.6, -0.7], [2.6, 1.05]])  # of the picture


def beam_force(depth):
    """Half of the force of an elastic beam on two round shoulders, with shear."""
    span = 2.0 * (OPENING + ROUND)
    span = span - 2.0 * ROUND * 3.0 * depth / span  # its slope moves them in
    bending = 4.0 * E / (1.0 - NU**2) * THICKNESS**3 / span**3
    shear = 4.0 * 5.0 / 6.0 * E / (2.0 * (1.0 + NU)) * THICKNESS / span
    return 0.5 * depth / (1.0 / bending + 1.0 / shear)


def main(arguments=None):
    """Run the demo; 0 if forces balance, and the sheet bends and springs back."""
    parser = common.options("forming", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells through the sheet")
    parser.add_argument("--steps", type=int, default=16, help="down, and up again")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    block = Block((24 * size, size), (0.0, 0.0), (LENGTH, THICKNESS), tags=TAGS)
    scene = Scene(*assemble_blocks(comm, [block], "quadrilateral"), TAGS)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    law = plasticity.ElastoPlastic(u, E, NU, YIELD, HARDENING)
    axis = tools.prescribe(V, scene.find("left"), component=0)
    weight = WEIGHT / (LENGTH * THICKNESS) * v[1] * ufl.dx

    # The solid is on the left of who walks along the points
    corners = [(1.2 * LENGTH, 0.0), (OPENING, 0.0), (OPENING, -DEEP), (-0.7, -DEEP)]
    die = rigid.Body(rigid.Polyline(corners, radius=ROUND), name="die")
    punch = rigid.Body(rigid.Circle((0.0, THICKNESS + NOSE), NOSE), name="punch")
    contact = raymortar.Contact(
        u, scene.facet_tags, [(TAGS["top"], punch), (TAGS["bottom"], die)],
        # The automatic coefficient goes by the solid's stiffness: a sheet is far softer
        raymortar.AugmentedLagrangian(0.5 * E, degree=1), raymortar.Coulomb(FRICTION),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(law.residual(4) + weight, contact, [axis])
    history = raymortar.History(problem, args.output / "forming.csv")

    def move(begin, end, steps, **options):
        """The punch's tip goes from one height above the sheet to another."""
        raymortar.LoadSteps(
            problem.snes_solver, lambda t: punch.move((0.0, begin + t * (end - begin))),
            steps, history=history, on_accept=law.accept, **options,
        ).run()  # fmt: skip

    def curvature():
        """Turn of a section near the middle over its distance to it."""
        low, high = (common.place_of(u, scene, f, THICKNESS) for f in ("bottom", "top"))
        return np.arctan2(low[0] - high[0], high[1] - low[1]) / THICKNESS

    def state(title):
        outlines = [c for body in (punch, die) for c in curves(body, *BOX)]
        lines = [(side * x, y) for x, y in (c.T for c in outlines) for side in (1, -1)]
        return title, drawing.gather_cells(mesh, u, law.mises()), *lines

    # The sheet lies down by its weight, is bent, and springs back
    move(ABOVE, ABOVE, 1, stabilize=True)
    sag = -common.value_at_origin(u, scene, "bottom", 1)
    move(0.0, -SMALL, 1)
    small = SMALL - sag, contact.results.resultant_on(punch).force[1]
    move(-SMALL, -DEPTH, args.steps // 2, extrapolate=True)
    bent, states = curvature(), [state("bent")]
    above, below = (
        contact.results.resultant_on(body).force[1] for body in (punch, die)
    )
    move(-DEPTH, 0.0, args.steps // 2, extrapolate=True)
    move(0.0, ABOVE, 1)
    sprung = bent - curvature()
    states.append(state("sprung back"))

    report = common.Report(comm)
    report.effort(contact, history["iterations"], int(history["halvings"][-1]))
    report.add("force at a small depth", small[1], beam_force(small[0]), 0.02)
    report.add("punch and weight, die", above + WEIGHT, -below, 1e-8)
    moment = plasticity.moment(bent, THICKNESS, E, NU, YIELD, HARDENING)
    expected = moment / (E / (1.0 - NU**2) * THICKNESS**3 / 12.0)
    report.add("curvature that springs back", sprung, expected, 0.06)

    file = args.output / "forming.png"
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, law.mises()])
    if comm.rank == 0:
        depth, force = -history["translation_punch_y"], history["push_punch_y"]
        beam = np.sort(depth[depth > 0.0])
        beam, found = (beam, beam_force(beam), "elastic beam"), (depth, force, "sheet")
        axes = {"xlabel": "depth", "ylabel": "half of the force", "xlim": (0.0, None)}
        parts = [(1, 1), (-1, 1)], beam, found, axes, BOX.T.ravel()
        drawing.states_and_curve(file, states, "von Mises stress", None, *parts)
    return report.finish("expected")


if __name__ == "__main__":
    sys.exit(main())
