"""Return mapping: an elastoplastic block under rigid tools (2D, plane strain).

Von Mises plasticity with linear hardening and small strains [1]. NumPy finds stress and
consistent tangent at the quadrature points; both are coefficients of the form, which
``NonlinearProblem(update=...)`` sets for each iterate. `accept` and `go_back` keep the
plastic strain in step with the path. A flat tool on a block between walls has a closed
form. A circle with friction leaves a dent, in steps of which the largest ones are halved.

[1] J. C. Simo, T. J. R. Hughes, Computational Inelasticity, Springer 1998, section 3.3.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
E, NU, YIELD, HARDENING, FRICTION = 1000.0, 0.3, 4.0, 40.0, 0.2
MU, BULK = E / (2.0 * (1.0 + NU)), E / (3.0 * (1.0 - 2.0 * NU))
WIDTH, HEIGHT, RADIUS, DEPTH, PRESS = 2.0, 1.0, 0.5, 0.06, 0.02
RULE = 2  # degree of the rule
# Plastic strain of a step, above which the return mapping asks for a smaller one
MOST = 0.02
TAGS = {"bottom": 1, "slave": 2, "left": 3, "right": 4}
ROOT = np.sqrt(2.0)
# Strains and stresses as vectors (xx, yy, zz, sqrt(2) xy), whose products are those of
# tensors
ONE = np.array([1.0, 1.0, 1.0, 0.0])
DEVIATOR = np.eye(4) - np.outer(ONE, ONE) / 3.0


def strain_of(u):
    """Small strain as a vector."""
    e = ufl.sym(ufl.grad(u))
    return ufl.as_vector([e[0, 0], e[1, 1], 0.0, ROOT * e[0, 1]])


def return_mapping(strain, plastic, equivalent):
    """Stress, tangent, plastic strain and equivalent plastic strain, at all points."""
    trial = 2.0 * MU * (strain @ DEVIATOR - plastic)
    size = np.maximum(np.linalg.norm(trial, axis=-1), 1e-300)
    excess = size - np.sqrt(2.0 / 3.0) * (YIELD + HARDENING * equivalent)
    slope = 2.0 * MU + 2.0 / 3.0 * HARDENING
    flow = np.maximum(excess, 0.0) / slope
    n = trial / size[..., None]
    volume = BULK * strain[..., :3].sum(-1)[..., None] * ONE
    stress = volume + trial - 2.0 * MU * flow[..., None] * n
    shrinks = 1.0 - 2.0 * MU * flow / size
    turns = np.where(excess > 0.0, 2.0 * MU / slope, 0.0) - (1.0 - shrinks)
    tangent = BULK * np.outer(ONE, ONE) + 2.0 * MU * (
        shrinks[..., None, None] * DEVIATOR
        - turns[..., None, None] * n[..., :, None] * n[..., None, :]
    )
    plastic = plastic + flow[..., None] * n
    return stress, tangent, plastic, equivalent + np.sqrt(2.0 / 3.0) * flow


class Material:
    """Stress and tangent at the points, and what is plastic since the last step."""

    def __init__(self, u):
        mesh = u.function_space.mesh
        self.u, self.rejected = u, 0
        shapes = {"stress": (4,), "tangent": (4, 4), "plastic": (5,)}
        self.stress, self.tangent, self.plastic = (
            fem.Function(tools.quadrature_space(mesh, RULE, shape), name=name)
            for name, shape in shapes.items()
        )
        self._strain = tools.AtQuadraturePoints(strain_of(u), mesh, RULE)
        shape = self._strain().shape
        self._accepted = np.zeros(shape), np.zeros(shape[:2])
        self._now = self._accepted

    def update(self):
        """Set stress and tangent for the present displacement."""
        stress, tangent, *now = return_mapping(self._strain(), *self._accepted)
        if np.max(now[1] - self._accepted[1], initial=0.0) > MOST:
            raise raymortar.ConvergenceError("a step flows too far")
        self._now = tuple(now)
        tools.set_at_quadrature_points(self.stress, stress)
        tools.set_at_quadrature_points(self.tangent, tangent)

    def accept(self):
        """Take over the plastic strain of the step."""
        self._accepted = self._now
        plastic, equivalent = self._accepted
        values = np.concatenate([plastic, equivalent[..., None]], axis=-1)
        tools.set_at_quadrature_points(self.plastic, values)

    def go_back(self):
        """Drop the plastic strain of a step that has failed."""
        self._now = self._accepted
        self.rejected += 1

    def forms(self):
        """Virtual work of the stresses, and its derivative."""
        V = self.u.function_space
        v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
        rule = {"quadrature_degree": RULE, "quadrature_scheme": "default"}
        dx = ufl.dx(metadata=rule)
        F = ufl.inner(self.stress, strain_of(v)) * dx
        return F, ufl.inner(ufl.dot(self.tangent, strain_of(du)), strain_of(v)) * dx


class Press:
    """A block under a rigid tool, between walls or on its own."""

    def __init__(self, comm, size, shape, walls, friction=None):
        divisions = round(WIDTH / HEIGHT) * size, size
        sides = {"bottom": 1, "top": 2, "left": 3, "right": 4}
        block = Block(divisions, (0.0, -HEIGHT), (WIDTH, 0.0), tags=sides)
        self.scene = Scene(*assemble_blocks(comm, [block], "quadrilateral"), TAGS)
        V = tools.vector_space(self.scene.mesh, 1)
        self.u = fem.Function(V, name="displacement")
        self.material = Material(self.u)
        F, J = self.material.forms()
        find = self.scene.find
        bcs = [tools.prescribe(V, find("bottom"))]
        if walls:
            bcs = [tools.prescribe(V, find("bottom"), component=1)]
            bcs += [tools.prescribe(V, find(n), component=0) for n in ("left", "right")]
        self.tool = rigid.Body(shape, name="tool")
        pairs = [(TAGS["slave"], self.tool)]
        self.contact = raymortar.Contact(
            self.u, self.scene.facet_tags, pairs, friction=friction
        )
        self.problem = raymortar.NonlinearProblem(
            F, self.contact, bcs, J, update=self.material.update
        )
        self.history = raymortar.History(self.problem, reactions={"bottom": bcs[0]})
        self.iterations, self.halvings, self.residuals = [], 0, []

    def move(self, begin, end, steps):
        """Move the tool from one depth to another."""
        path = raymortar.LoadSteps(
            self.problem.snes_solver,
            lambda t: self.tool.move((0.0, -begin - t * (end - begin))),
            steps,
            history=self.history,
            on_accept=self.material.accept,
            on_reject=self.material.go_back,
        )
        for step in path:
            self.iterations.append(step.iterations)
            self.residuals.append(list(self.problem.history))
        self.halvings += path.halvings


def confined(strain):
    """Pressure of a block between walls, compressed by a strain for the first time."""
    plastic = max(2.0 * MU * strain - YIELD, 0.0) / (3.0 * MU + HARDENING)
    elastic = (BULK + 4.0 / 3.0 * MU) * strain
    return elastic - 2.0 * MU * plastic


def order(residuals):
    """Order of convergence of the last iterations above rounding errors."""
    r = np.log([r for r in residuals if r > 1e-11 * max(residuals)])
    return (r[-1] - r[-2]) / (r[-2] - r[-3])


def draw(down, cells, path):
    """Deformed block with its plastic strain, and the residuals of the steps."""
    figure, (left, right) = drawing.pyplot().subplots(
        1, 2, figsize=(10.0, 3.6), layout="constrained"
    )
    x, u, plastic = cells
    colours = drawing.draw_field(left, x[..., :2] + u, plastic)
    figure.colorbar(colours, ax=left, label="plastic strain", shrink=0.7)
    left.set(aspect="equal", xlabel="x", ylabel="y")
    for residuals in down:
        right.semilogy(residuals, "o-", ms=3.5, color=drawing.COMPUTED, alpha=0.4)
    right.set(xlabel="Newton iteration of a step", ylabel="residual")
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if it agrees with closed forms and converges quadratically."""
    parser = common.options("return_mapping", __doc__)
    parser.add_argument("--size", type=int, default=8, help="cells over the height")
    parser.add_argument("--steps", type=int, default=6, help="steps down")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (3 if args.fine else 1)
    report = common.Report(comm)
    args.output.mkdir(parents=True, exist_ok=True)

    flat = Press(comm, 2, rigid.Line((0.5 * WIDTH, 0.0), (0.0, -1.0)), True)
    flat.move(0.0, PRESS, 2)
    pressure = confined(PRESS / HEIGHT)
    force = flat.history["push_tool_y"]
    report.add("pressure between walls", force[-1] / WIDTH, pressure, 1e-8)
    flat.move(PRESS, 0.9 * PRESS, 1)
    back = pressure - 0.1 * PRESS / HEIGHT * (BULK + 4.0 / 3.0 * MU)
    report.add("the same, unloaded by a tenth", force_of(flat) / WIDTH, back, 1e-8)

    circle = rigid.Circle((0.5 * WIDTH, RADIUS), RADIUS)
    dent = Press(comm, size, circle, False, raymortar.Coulomb(FRICTION))
    dent.move(0.0, DEPTH, args.steps)
    report.effort(dent.contact, dent.iterations, dent.halvings)
    report.newton("down", dent.iterations, dent.residuals[-1])
    report.say(f"plastic strains taken back: {dent.material.rejected} times")
    found = np.median([order(residuals) for residuals in dent.residuals])
    report.add("order of convergence", found, 2.0, 0.15)
    held = dent.history["reaction_bottom_y"][-1]
    report.add("force of the circle", force_of(dent), held, 1e-8)
    down = list(dent.residuals)
    dent.move(DEPTH, -0.1 * DEPTH, args.steps)
    report.add("left of it, circle away", 1.0 + force_of(dent), 1.0, 1e-12)

    equivalent = tools.nodal_field(
        dent.material.plastic[4], dent.scene.mesh, "plastic_strain", 1, RULE
    )
    fields = [dent.u, dent.contact.traction("normal"), equivalent]
    io.write_xdmf(args.output / "return_mapping.xdmf", dent.scene.mesh, fields)
    cells = drawing.gather_cells(dent.scene.mesh, dent.u, equivalent)
    if comm.rank == 0:
        draw(down, cells, args.output / "return_mapping.png")
    return report.finish("expected")


def force_of(model):
    """Force on the tool at the last step, upward."""
    return model.history["push_tool_y"][-1]


if __name__ == "__main__":
    sys.exit(main())
