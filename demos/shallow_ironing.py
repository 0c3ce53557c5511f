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

import common
import long_runs
import numpy as np
import ufl
from dolfinx import fem

from mpi4py import MPI

import raymortar
from raymortar import compat
from raymortar.meshing import Block, Scene, assemble_blocks

# Lengths in mm, stresses in MPa, forces in N per mm of thickness
E_INDENTER, E_FOUNDATION, NU, FRICTION = 6896.0, 689.6, 0.32, 0.3
PRESSED, SLID = 1.0, 10.0
# Augmentation [MPa/mm] with which code_aster's forces are met best; from 300 to 30000
# they change by less than 0.5 %. The automatic one is 8700 on the fine mesh
GAMMA = 1000.0
# Peak to peak over the mean for t in [1.3, 1.7], a quartic in time taken out. It has
# the period of the elements, and is there without friction too (docs/troubleshooting):
# 0.13 and 0.8 % on the fine mesh (0.54 % with 500 steps), 0.04 and 0.4 % with elements
# half as large
RIPPLE_OF_V, RIPPLE_OF_H = 0.002, 0.01
TAGS = {"bottom": 1, "top": 2, "slave": 3, "master": 4}

# Reactions (V, H) by time. code_aster: SSNP153b, 2 steps down and 120 along
CODE_ASTER = {
    0.5: (93.863, None),
    1.0: (330.670, 63.646),
    1.1: (402.763, 126.993),
    1.2: (416.287, 127.587),
}
# GetFEM with our material laws, 10 steps down and 500 along
GETFEM = {
    "simo-miehe": {1.0: (330.49, 69.00), 1.5: (421.71, 129.93)},
    "neo-hookean": {1.0: (315.66, 66.60), 1.5: (402.19, 129.16)},
}
# The same without friction, 10 steps down and 100 along
GETFEM_FRICTIONLESS = {1.0: (324.85, 34.66), 1.5: (418.41, None)}
# Digitised in the solid-benchmarks collection of solids4foam
PUBLISHED_TIMES = (0.5, 0.8, 1.0, 1.1, 1.2, 1.3, 1.5, 1.7, 1.9)
PUBLISHED = {
    "code_aster, older method": (
        (96.2, 225.8, 332.0, 405.0, 416.4, 420.2, 421.0, 417.8, 393.9),
        (18.7, 46.5, 71.0, 138.8, 140.7, 141.8, 143.3, 141.3, 120.6),
    ),
    "Fischer & Wriggers 2006": (
        (86.1, 204.7, 297.9, 363.2, 368.8, 367.1, 365.1, 360.7, 342.4),
        (15.9, 39.9, 62.1, 172.6, 182.3, 189.7, 188.8, 191.0, 135.6),
    ),
    "Hartmann et al. 2009": (
        (95.1, 221.3, 319.5, 395.5, 406.5, 408.6, 408.4, 404.3, 379.3),
        (17.6, 44.0, 67.2, 149.6, 150.2, 162.4, 160.2, 156.9, 132.2),
    ),
    "Poulios & Renard 2015": (
        (81.5, 187.0, 267.9, 324.3, 334.0, 335.6, 337.4, 336.4, 321.9),
        (15.5, 37.4, 55.3, 99.4, 99.1, 100.9, 102.1, 101.4, 89.8),
    ),
    "Yastrebov 2011": (
        (92.3, 206.3, 289.7, 352.1, 366.1, 365.2, 359.5, 354.6, 334.7),
        (17.2, 41.0, 58.5, 167.4, 171.2, 173.2, 170.8, 165.3, 136.6),
    ),
}

# An accepted step: time, reactions on the indenter, contact force on it (fx, fy),
# Newton iterations, halvings so far, integration points in contact, seconds of CPU
Row = namedtuple("Row", "t V H fx fy iterations halvings closed seconds")
HEADING = "        t  Newton  halvings          V          H  closed  CPU [s]"


# The problem


def on_arc(x):
    """Bend the bottom of the box [0.2, 1.4] x [0.5, 1.4] to an arc of radius 0.75."""
    angle = np.arcsin(0.6 / 0.75) * (x[:, 0] - 0.8) / 0.6
    arc = np.column_stack([0.8 + 0.75 * np.sin(angle), 0.95 - 0.75 * np.cos(angle)])
    share = ((x[:, 1] - 0.5) / 0.9)[:, None]
    top = np.column_stack([x[:, 0], np.full(len(x), 1.4)])
    return (1.0 - share) * arc + share * top


def ironing_scene(comm, size):
    """Foundation of size x size/4 quadrilaterals, indenter 0.2 mm above it."""
    across = max(12, size // 10)
    foundation = Block(
        (size, size // 4),
        (0.0, -4.0),
        (12.0, 0.0),
        tags={"bottom": TAGS["bottom"], "top": TAGS["master"]},
    )
    indenter = Block(
        (across, across // 2),
        (0.2, 0.5),
        (1.4, 1.4),
        mapping=on_arc,
        tags={"bottom": TAGS["slave"], "top": TAGS["top"]},
    )
    parts = assemble_blocks(comm, [foundation, indenter], "quadrilateral")
    return Scene(*parts, TAGS)


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
    ):
        self.extrapolate = extrapolate
        self.scene = ironing_scene(comm, size)
        mesh = self.scene.mesh
        V = compat.vector_space(mesh, 1)
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
        self.top = self._dofs(V, "top")
        bcs = [
            fem.dirichletbc(clamped, self._dofs(V, "bottom"), V),
            fem.dirichletbc(self.motion, self.top, V),
        ]
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(TAGS["slave"], TAGS["master"])],
            raymortar.AugmentedLagrangian(gamma),
            friction=raymortar.Coulomb(friction) if friction else None,
            # Many points on a segment: the edge of the contact, which cuts through
            # some, moves on smoothly. Half an iteration less, and smaller ripples
            quadrature_degree=9,
            # The first iterate of a large step may be as deep as the step is long
            search=raymortar.Search(reach=1.0, depth=1.0),
        )
        self.problem = raymortar.NonlinearProblem(residual, self.contact, bcs)
        # A force [N/mm]: extrapolated steps start from small residuals
        options = {"snes_atol": 1e-10 * E_FOUNDATION, **(options or {})}
        self.solver = raymortar.SNESSolver(self.problem, options)

    def _dofs(self, V, name):
        facets = self.scene.facet_tags.find(TAGS[name])
        return fem.locate_dofs_topological(V, 1, facets)

    def apply(self, t):
        """Move the indenter's top: down until t = 1, then along."""
        self.motion.value[:] = (SLID * max(t - 1.0, 0.0), -PRESSED * min(t, 1.0))

    def reaction(self):
        """Force on the indenter's top, from the stress in the indenter. Collective."""
        V = self.u.function_space
        r = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        compat.assemble_residual(r.array, self.problem.L)
        compat.scatter_reverse_add(r)
        owned = self.top[self.top < V.dofmap.index_map.size_local]
        force = r.array.reshape(-1, 2)[owned].sum(axis=0)
        return self.scene.mesh.comm.allreduce(force)

    def row(self, t, step, seconds):
        """What is recorded of an accepted step. Collective."""
        H, V = self.reaction()
        fx, fy = self.contact.resultant().force
        closed = self.contact.statistics.active_points
        return Row(t, -V, H, fx, fy, step.iterations, step.halvings, closed, seconds)

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
            times = lambda factor: begin + factor * (end - begin)  # noqa: E731
            load = raymortar.LoadSteps(
                self.solver,
                lambda factor: self.apply(times(factor)),
                steps,
                extrapolate=self.extrapolate,
            )
            clock = time.process_time()
            for step in load:
                now = time.process_time()
                yield self.row(times(step.factor), step, now - clock)
                clock = time.process_time()


def line(row):
    """A row on screen, under `HEADING`."""
    return (
        f"{row.t:9.4f}{row.iterations:8.0f}{row.halvings:10.0f}{row.V:11.4f}"
        f"{row.H:11.4f}{row.closed:8.0f}{row.seconds:9.2f}"
    )


# Figures


def at(rows, t):
    """The row at time t, or None."""
    found = [row for row in rows if abs(row.t - t) < 1e-6]
    return found[0] if found else None


def ripple(rows, name, begin=1.3, end=1.7):
    """Peak to peak of V or H over the mean, after removing a quartic in time.

    None if the path does not get as far as `end`.
    """
    window = [row for row in rows if begin - 1e-6 <= row.t <= end + 1e-6]
    if rows[-1].t < end - 1e-6 or len(window) < 10:
        return None
    t = np.array([row.t for row in window]) - (begin + end) / 2
    y = np.array([getattr(row, name) for row in window])
    rest = y - np.polynomial.Polynomial.fit(t, y, 4)(t)
    return np.ptp(rest) / abs(y.mean())


def imbalance(rows):
    """Largest difference between contact force and reaction, over the largest force."""
    force = np.array([(row.H, row.V) for row in rows])
    contact = np.array([(-row.fx, row.fy) for row in rows])
    return np.abs(force - contact).max() / np.abs(force).max()


def compare(report, rows, reference, tolerances):
    """Rows of the report for a table of (V, H) by time."""
    for t, values in reference.items():
        row = at(rows, t)
        for name, value, tolerance in zip("VH", values, tolerances):
            if row is not None and value is not None:
                report.add(f"{name}({t})", getattr(row, name), value, tolerance, "N/mm")


def draw(model, rows, path):
    """Reactions over time beside published ones, and the stress at the end."""
    mesh = model.scene.mesh
    mises = common.nodal_field(
        common.von_mises(model.cauchy), mesh, "von Mises stress", quadrature_degree=2
    )
    traction = model.contact.traction()
    compat.write_xdmf(path.with_suffix(".xdmf"), mesh, [model.u, mises, traction])
    cells = common.gather_cells(mesh, model.u, mises)
    if mesh.comm.rank > 0:
        return
    plt = common.pyplot()
    fig = plt.figure(figsize=(10, 8.5), layout="constrained")
    grid = fig.add_gridspec(2, 2, height_ratios=(1.15, 1))
    for k, (name, direction) in enumerate((("V", "vertical"), ("H", "horizontal"))):
        axes = fig.add_subplot(grid[0, k])
        draw_reactions(axes, rows, name, k)
        axes.set(xlabel="time", ylabel=f"{direction} reaction [N/mm]", ylim=(0, None))
        axes.set_xlim(0, 2)
    fig.axes[0].legend(loc="lower right", fontsize=8)
    draw_bodies(fig, fig.add_subplot(grid[1, :]), *cells, rows[-1].t)
    fig.savefig(path)


def draw_reactions(axes, rows, name, k):
    """One reaction over time: ours, code_aster's, and the curves of the literature."""
    markers = "sv^Do"
    for marker, (source, curves) in zip(markers, PUBLISHED.items()):
        axes.plot(
            PUBLISHED_TIMES, curves[k], marker + ":", color="0.6", ms=3.5, label=source
        )
    points = [(t, values[k]) for t, values in CODE_ASTER.items() if values[k]]
    axes.plot(
        *zip(*points), "x", color=common.EXACT, ms=7, label="code_aster, same method"
    )
    axes.plot(
        [0.0] + [row.t for row in rows],
        [0.0] + [getattr(row, name) for row in rows],
        color=common.COMPUTED,
        lw=1.8,
        label="raymortar",
    )


def draw_bodies(fig, axes, x, u, mises, t):
    """Stress in the deformed mesh."""
    deformed = x[..., :2] + u
    points = deformed.reshape(-1, 2)
    colours = axes.tripcolor(
        points[:, 0],
        points[:, 1],
        common.triangles(x),
        mises.ravel(),
        shading="gouraud",
        cmap=common.STRESS_MAP,
        vmin=0,
        vmax=np.quantile(mises, 0.995),
    )
    common.draw_edges(axes, deformed)
    axes.set(aspect="equal", xlabel="x [mm]", title=f"time {t:.3g}")
    fig.colorbar(
        colours, ax=axes, label="von Mises stress [MPa]", shrink=0.8, extend="max"
    )


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
    parser.add_argument("--until", type=float, help="last time (1.3; 2 with --fine)")
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
    size, steps, until = (120, (2, 120), 2.0) if args.fine else (60, (10, 100), 1.3)
    args.size = args.size or size
    args.steps = args.steps or steps
    args.until = args.until or until
    if args.size < 8 or min(args.steps) < 1 or not 1.0 <= args.until <= 2.0:
        parser.error("size >= 8, steps >= 1, 1 <= until <= 2")
    return args


def check(report, rows, args):
    """What the run must fulfil, by how much of it was run."""
    report.add("contact force / reaction", 1.0 + imbalance(rows), 1.0, 1e-7)
    fine = args.size >= 120
    # Away from the free ends: the foundation gives way there
    inner = [row for row in rows if 1.05 < row.t < 1.7 + 1e-6]
    if inner:
        last = inner[-1]
        # Friction acts on a curved surface that ploughs: H / V is close to mu
        allowed = 0.1 * FRICTION if args.friction else 0.005
        difference = last.H / last.V - args.friction
        report.add(f"1 + H / V - mu at {last.t:.4g}", 1.0 + difference, 1.0, allowed)
    if fine and args.law == "simo-miehe" and not args.friction:
        compare(report, rows, GETFEM_FRICTIONLESS, (0.005, 0.015))
    elif fine and args.friction == FRICTION and args.steps[0] > 2:
        compare(report, rows, GETFEM[args.law], (0.005, 0.015))
    elif fine and args.friction == FRICTION and args.law == "simo-miehe":
        compare(report, rows, CODE_ASTER, (0.005, 0.005))
    for name, allowed in (("V", RIPPLE_OF_V), ("H", RIPPLE_OF_H)):
        value = ripple(rows, name)
        if value is not None and (args.friction or name == "V"):
            bound = allowed if fine else None
            report.add(f"1 + ripple of {name}", 1.0 + value, 1.0, bound)


def main(arguments=None):
    """Run the demo; 0 if it agrees with the references."""
    args = arguments_of(arguments)
    comm = MPI.COMM_WORLD
    model = Ironing(
        comm, args.size, args.law, args.friction, args.gamma, not args.no_extrapolation
    )
    report = common.Report(comm)
    report.say(
        f"{model.contact.layout.size_global} unknowns, gamma {model.contact.gamma:.4g}"
    )
    args.output.mkdir(parents=True, exist_ok=True)
    rows = long_runs.load(args.restart, model.contact, Row)[0] if args.restart else []
    record = long_runs.Record(
        model.contact,
        args.output / "shallow_ironing.csv",
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
    check(report, rows, args)
    draw(model, rows, args.output / "shallow_ironing.png")
    return report.finish("reference")


if __name__ == "__main__":
    sys.exit(main())
