"""Return mapping: an elastoplastic block under rigid tools (2D, plane strain).

NumPy finds stress and consistent tangent at the quadrature points, `hardening.py`. Both
are coefficients of the form, which ``NonlinearProblem(update=...)`` sets for each
iterate. `accept` and `go_back` keep the plastic strain in step with the path. A flat
tool on a block between walls has a closed form. A circle with friction leaves a dent, in
steps of which the largest ones are halved.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
from dolfinx import fem
from hardening import BULK, MU, RULE, Material, confined

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
FRICTION, WIDTH, HEIGHT, RADIUS, DEPTH, PRESS = 0.2, 2.0, 1.0, 0.5, 0.06, 0.02
SIDES = {"bottom": 1, "top": 2, "left": 3, "right": 4}


class Press:
    """A block under a rigid tool, between walls or on its own."""

    def __init__(self, comm, size, shape, walls, friction=None):
        block = Block((2 * size, size), (0.0, -HEIGHT), (WIDTH, 0.0), tags=SIDES)
        scene = Scene(*assemble_blocks(comm, [block], "quadrilateral"), SIDES)
        V = tools.vector_space(scene.mesh, 1)
        self.u = fem.Function(V, name="displacement")
        self.material = material = Material(self.u)
        F, J = material.forms()
        bcs = [tools.prescribe(V, scene.find("bottom"), component=1 if walls else None)]
        sides = ("left", "right") if walls else ()
        bcs += [tools.prescribe(V, scene.find(name), component=0) for name in sides]
        self.tool = rigid.Body(shape, name="tool")
        given = self.u, scene.facet_tags, [(SIDES["top"], self.tool)]
        self.contact = raymortar.Contact(*given, friction=friction)
        self.problem = raymortar.NonlinearProblem(
            F, self.contact, bcs, J, update=material.update
        )
        self.history = raymortar.History(self.problem, reactions={"bottom": bcs[0]})
        self.halvings, self.residuals = 0, []

    def move(self, begin, end, steps):
        """Move the tool from one depth to another; its force, upward."""
        path = raymortar.LoadSteps(
            self.problem.snes_solver,
            lambda t: self.tool.move((0.0, -begin - t * (end - begin))), steps,
            history=self.history, strategy="halve",  # all iterations are Newton's
            on_accept=self.material.accept, on_reject=self.material.go_back,
        )  # fmt: skip
        for _ in path:
            self.residuals.append(list(self.problem.history))
        self.halvings += path.halvings
        return self.history["push_tool_y"][-1]


def order(residuals):
    """Order of convergence of the last iterations above rounding errors."""
    r = np.log([r for r in residuals if r > 1e-11 * max(residuals)])
    return (r[-1] - r[-2]) / (r[-2] - r[-3])


def main(arguments=None):
    """Run the demo; 0 if it agrees with closed forms and converges quadratically."""
    parser = common.options("return_mapping", __doc__)
    parser.add_argument("--size", type=int, default=8, help="cells over the height")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (3 if args.fine else 1)
    report = common.Report(comm)
    args.output.mkdir(parents=True, exist_ok=True)

    flat = Press(comm, 2, rigid.Line((0.5 * WIDTH, 0.0), (0.0, -1.0)), True)
    pressure, elastic = confined(PRESS / HEIGHT), BULK + 4.0 / 3.0 * MU
    force = flat.move(0.0, PRESS, 8)
    report.add("pressure between walls", force / WIDTH, pressure, 1e-8)
    force = flat.move(PRESS, 0.9 * PRESS, 1)
    pressure -= 0.1 * PRESS / HEIGHT * elastic
    report.add("the same, unloaded by a tenth", force / WIDTH, pressure, 1e-8)

    circle = rigid.Circle((0.5 * WIDTH, RADIUS), RADIUS)
    dent = Press(comm, size, circle, False, raymortar.Coulomb(FRICTION))
    force = dent.move(0.0, DEPTH, 6)
    down = list(dent.residuals)
    report.effort(dent.contact, dent.history["iterations"], dent.halvings)
    report.say(f"plastic strains taken back: {dent.material.rejected} times")
    found = np.median([order(residuals) for residuals in down])
    report.add("order of convergence", found, 2.0, 0.15)
    held = dent.history["reaction_bottom_y"][-1]
    report.add("force of the circle", force, held, 1e-8)
    left = dent.move(DEPTH, -0.1 * DEPTH, 6)
    report.add("left of it, circle away", 1.0 + left, 1.0, 1e-12)

    file, mesh = args.output / "return_mapping.png", dent.u.function_space.mesh
    plastic = tools.nodal_field(dent.material.plastic[4], mesh, "plastic", 1, RULE)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [dent.u, plastic])
    # Between walls, on the way down
    strain = -flat.history["translation_tool_y"][:8] / HEIGHT
    pressure = flat.history["push_tool_y"][:8] / WIDTH
    curves = (strain, [*map(confined, strain)], "closed form"), (
        strain,
        pressure,
        "ours",
    )
    axes = {"xlabel": "compression between walls", "ylabel": "pressure"}
    drawing.field_and_curve(file, dent.u, plastic, "plastic strain", *curves, axes)
    return report.finish("expected")


if __name__ == "__main__":
    sys.exit(main())
