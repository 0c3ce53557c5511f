"""Shallow ironing: a stiff indenter is pressed into a soft block and dragged along.

Large sliding with Coulomb friction (2D, plane strain, finite strain), the problem of
Fischer & Wriggers (2006). The reactions on the indenter are drawn beside published
curves and, with ``--fine``, compared with those of the same method in code_aster
(its test SSNP153b) and in GetFEM. The path takes a while on the fine mesh:
``--checkpoint`` and ``--restart`` let it be interrupted.
"""

import math
import sys
import time
from collections import namedtuple

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.ironing import TAGS, scene_of
from raymortar import io, tools
from raymortar.core import compat

from . import ironing_references as references
from . import long_runs

# Lengths in mm, stresses in MPa, forces in N per mm of thickness
E_INDENTER, E_FOUNDATION, NU = 6896.0, 689.6, 0.32
FRICTION = references.FRICTION
PRESSED, SLID = 1.0, 10.0
# Augmentation [MPa/mm] with which code_aster's forces are met best; from 300 to 30000
# they change by less than 0.5 %. The automatic one is 8700 on the fine mesh
GAMMA = 1000.0

# An accepted step: time, reactions on the indenter, contact force on it (fx, fy),
# Newton iterations, halvings so far, integration points in contact, seconds of CPU
Row = namedtuple("Row", "t V H fx fy iterations halvings closed seconds")
HEADING = "        t  Newton  halvings          V          H  closed  CPU [s]"


# The problem


def simo_miehe(F, E):
    """First Piola-Kirchhoff stress of code_aster's law without yield, 3 x 3."""
    mu, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
    J, F_inv_T = ufl.det(F), ufl.inv(F).T
    deviator = F - ufl.inner(F, F) / 3 * F_inv_T
    return mu * J ** (-2 / 3) * deviator + K / 2 * (J**2 - 1) * F_inv_T


def neo_hookean(F, E):
    """Derivative of mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2, 3 x 3."""
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    F_inv_T = ufl.inv(F).T
    return mu * (F - F_inv_T) + lmbda * ufl.ln(ufl.det(F)) * F_inv_T


LAWS = {"simo-miehe": simo_miehe, "neo-hookean": neo_hookean}


def plane_strain(H):
    """Deformation gradient, 3 x 3, of a displacement gradient in the plane."""
    return ufl.Identity(3) + ufl.as_tensor(
        [[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]]
    )


class Ironing:
    """The mechanical problem, and where on its path it is."""

    def __init__(
        self,
        comm,
        size,
        law="simo-miehe",
        friction=FRICTION,
        gamma=GAMMA,
        extrapolate=True,
        options=None,
        file=None,
        # Many points on a segment: the edge of the contact, which cuts through some,
        # moves on smoothly. Half an iteration less, and smaller ripples
        quadrature_degree=9,
        across=None,
        method=None,
    ):
        self.extrapolate = extrapolate
        self.scene = scene_of(comm, size, across)
        mesh = self.scene.mesh
        V = tools.vector_space(mesh, 1)
        self.u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)

        E = fem.Function(compat.space(mesh, "DG", 0))
        E.x.array[:] = E_FOUNDATION
        E.x.array[self.scene.cell_tags.find(2)] = E_INDENTER
        F = plane_strain(ufl.grad(self.u))
        P = LAWS[law](F, E)
        self.cauchy = P * F.T / ufl.det(F)
        in_plane = ufl.as_tensor([[P[i, j] for j in range(2)] for i in range(2)])
        dx = ufl.dx(metadata={"quadrature_degree": 2})
        residual = ufl.inner(in_plane, ufl.grad(v)) * dx

        self.motion = fem.Constant(mesh, np.zeros(2))
        clamped = fem.Constant(mesh, np.zeros(2))
        bcs = [
            fem.dirichletbc(clamped, self._dofs(V, "bottom"), V),
            fem.dirichletbc(self.motion, self._dofs(V, "top"), V),
        ]
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(TAGS["slave"], TAGS["master"])],
            method or raymortar.AugmentedLagrangian(gamma),
            friction=raymortar.Coulomb(friction) if friction else None,
            quadrature_degree=quadrature_degree,
            # The first iterate of a large step may be as deep as the step is long
            search=raymortar.Search(reach=1.0, depth=1.0),
        )
        self.problem = raymortar.NonlinearProblem(residual, self.contact, bcs)
        # A force [N/mm]: extrapolated steps start from small residuals
        options = {"snes_atol": 1e-10 * E_FOUNDATION, **(options or {})}
        self.solver = raymortar.SNESSolver(self.problem, options)
        self.history = raymortar.History(self.problem, file, {"top": bcs[1]})

    def _dofs(self, V, name):
        facets = self.scene.facet_tags.find(TAGS[name])
        return fem.locate_dofs_topological(V, 1, facets)

    def apply(self, t):
        """Move the indenter's top: down until t = 1, then along."""
        self.motion.value[:] = (SLID * max(t - 1.0, 0.0), -PRESSED * min(t, 1.0))

    def row(self, step, seconds):
        """What is said of an accepted step."""
        last = self.history.rows[-1]
        return Row(
            last.time,
            -last.reaction_top_y,
            last.reaction_top_x,
            last.force_0_x,
            last.force_0_y,
            step.iterations,
            step.halvings,
            last.active,
            seconds,
        )

    def path(self, start, press, slide, until):
        """Rows of the accepted steps from time `start`: a generator. Collective.

        `press` steps until t = 1, then `slide` steps per unit of time.
        """
        for begin, end, rate in ((0.0, 1.0, press), (1.0, until, slide)):
            begin = max(begin, start)
            # A path that was cut between its steps goes on with shorter ones
            steps = math.ceil((end - begin) * rate - 1e-6)
            if steps < 1:
                continue
            load = raymortar.LoadSteps(
                self.solver,
                self.apply,
                steps,
                extrapolate=self.extrapolate,
                path=(begin, end),
                history=self.history,
            )
            clock = time.process_time()
            for step in load:
                now = time.process_time()
                yield self.row(step, now - clock)
                clock = time.process_time()


def line(row):
    """A row on screen, under `HEADING`."""
    return (
        f"{row.t:9.4f}{row.iterations:8.0f}{row.halvings:10.0f}{row.V:11.4f}"
        f"{row.H:11.4f}{row.closed:8.0f}{row.seconds:9.2f}"
    )


def draw(model, rows, path):
    """Reactions over time beside published ones, and the stress at the end."""
    mesh = model.scene.mesh
    stress = tools.von_mises(model.cauchy)
    mises = tools.nodal_field(stress, mesh, "von Mises stress", quadrature_degree=2)
    traction = model.contact.traction()
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [model.u, mises, traction])
    cells = drawing.gather_cells(mesh, model.u, mises)
    if mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig = plt.figure(figsize=(10, 8.5), layout="constrained")
    grid = fig.add_gridspec(2, 2, height_ratios=(1.15, 1))
    for k, (name, direction) in enumerate((("V", "vertical"), ("H", "horizontal"))):
        axes = fig.add_subplot(grid[0, k])
        references.draw(axes, rows, name, k)
        axes.set(xlabel="time", ylabel=f"{direction} reaction [N/mm]", ylim=(0, None))
        axes.set_xlim(0, 2)
    fig.axes[0].legend(loc="lower right", fontsize=8)
    axes, (x, u, values) = fig.add_subplot(grid[1, :]), cells
    at, top = x[..., :2] + u, np.quantile(values, 0.995)
    colours = drawing.draw_field(axes, at, values, top=top)
    axes.set(xlabel="x [mm]", title=f"time {rows[-1].t:.3g}")
    fig.colorbar(
        colours, ax=axes, label="von Mises stress [MPa]", shrink=0.8, extend="max"
    )
    fig.savefig(path)


def arguments_of(arguments):
    """Options; what is not given depends on --fine."""
    parser = common.options("shallow_ironing", __doc__)
    parser.add_argument(
        "--size", type=int, help="foundation's elements along (60, 120)"
    )
    parser.add_argument(
        "--steps",
        type=int,
        nargs=2,
        metavar=("PRESS", "SLIDE"),
        help="steps down, and per unit of time along (10 100; 2 120 with --fine)",
    )
    parser.add_argument("--until", type=float, help="last time (2)")
    parser.add_argument("--law", choices=LAWS, default="simo-miehe")
    parser.add_argument("--friction", type=float, default=FRICTION, help="0: none")
    parser.add_argument("--gamma", type=float, default=GAMMA, help="augmentation")
    parser.add_argument(
        "--no-extrapolation",
        action="store_true",
        help="start each step from the last accepted state",
    )
    long_runs.add_options(parser)
    args = parser.parse_args(arguments)
    size, steps, until = (120, (2, 120), 2.0) if args.fine else (60, (10, 100), 2.0)
    args.size = args.size or size
    args.steps = args.steps or steps
    args.until = args.until or until
    if args.size < 8 or min(args.steps) < 1 or not 1.0 <= args.until <= 2.0:
        parser.error("size >= 8, steps >= 1, 1 <= until <= 2")
    return args


def main(arguments=None):
    """Run the demo; 0 if it agrees with the references."""
    args = arguments_of(arguments)
    comm = MPI.COMM_WORLD
    args.output.mkdir(parents=True, exist_ok=True)
    model = Ironing(
        comm,
        args.size,
        args.law,
        args.friction,
        args.gamma,
        not args.no_extrapolation,
        file=args.output / "shallow_ironing.csv",
    )
    report = common.Report(comm)
    report.effort(model.contact)
    report.say(f"gamma {model.contact.gamma:.4g} MPa/mm")
    rows = long_runs.load(args.restart, model.contact, Row)[0] if args.restart else []
    long_runs.resume(model.history, rows)
    record = long_runs.Record(
        model.contact,
        args.checkpoint or args.restart,
        args.every,
        rows,
        HEADING,
        line,
    )
    start = rows[-1].t if rows else 0.0
    if not record.follow(model.path(start, *args.steps, args.until)):
        return 130

    for title, part in (
        ("down", [row for row in rows if row.t <= 1.0 + 1e-9]),
        ("along", [row for row in rows if row.t > 1.0 + 1e-9]),
    ):
        if part:
            iterations = np.array([row.iterations for row in part])
            report.say(
                f"{title}: {len(part)} steps, {iterations.mean():.2f} Newton iterations "
                f"each (at most {iterations.max():.0f}), {part[-1].halvings:.0f} "
                f"halvings, {sum(row.seconds for row in part):.1f} s of CPU"
            )
    fine, press = args.size >= 120, args.steps[0]
    references.check(report, rows, fine, args.law, args.friction, press)
    draw(model, rows, args.output / "shallow_ironing.png")
    return report.finish("reference")


if __name__ == "__main__":
    sys.exit(main())
