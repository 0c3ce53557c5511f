"""Half ring on a block: large sliding with friction, and lift-off (2D).

The ends of an elastic half ring, stiff inside and soft outside, are pushed towards
an elastic block. The ring flattens, slides along the block by a multiple of its
facets, and buckles: its middle comes off the block again. Data of code_aster's
SSNP165, after Yastrebov, and Poulios and Renard (2015), but for the law, which is
neo-Hookean here. ``--checkpoint`` and ``--restart`` let the path be interrupted.
"""

import math
import sys
import time
from collections import namedtuple
from functools import partial
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
from dolfinx import fem

import raymortar
from meshes.half_ring import GAP, MIDDLE, OUTER, TAGS, scene_of
from raymortar import io, tools
from raymortar.core import compat

from . import long_runs

# Lengths in mm, moduli in MPa
E_INNER, E_OUTER, E_BLOCK, NU = 1e5, 1e3, 300.0, 0.3
PUSH, FRICTION = 90.0, 0.5
# Vertical displacement in the middle of the block by code_aster, without and with
# friction, for logarithmic elasticity
TIMES = (0.4, 0.6, 0.8, 0.9, 1.0)
CODE_ASTER = {
    0.0: (-2.0578, -0.2533, 0.1146, 0.0708, 0.0915),
    0.5: (-2.2315, -0.6803, 0.6690, 1.0114, 1.3408),
}
# An accepted step: load factor, Newton iterations, halvings so far, displacements of
# block and ring in the middle, pressure there, force on the ring, seconds of CPU
MIDDLE_OF = ("below_x", "below_y", "above_x", "above_y", "pressure")
Row = namedtuple(
    "Row", ("t", "iterations", "halvings", *MIDDLE_OF, "fx", "fy", "seconds")
)
HEADING = "        t  Newton  halvings      force   pressure  CPU [s]"
# Residuals of Newton's method go up and down where points hop between states
LINE_SEARCH = {"snes_linesearch_type": "l2"}


def moduli(scene):
    """Young's modulus of each cell."""

    def of_place(x):
        r = np.hypot(x[0], x[1] - OUTER - GAP)
        return np.where(x[1] < 0.0, E_BLOCK, np.where(r < MIDDLE, E_INNER, E_OUTER))

    E = fem.Function(compat.space(scene.mesh, "DG", 0))
    E.interpolate(of_place)
    return E


def centre_of(V, scene, name):
    """Dof of the node of a surface at x = 0, where this rank owns it."""
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, 1, facets)
    dofs = dofs[dofs < V.dofmap.index_map.size_local]
    return dofs[np.abs(V.tabulate_dof_coordinates()[dofs, 0]) < 1e-6 * OUTER]


class HalfRing:
    """The mechanical problem, and where on its path it is.

    Parameters
    ----------
    options
        PETSc options of SNES; None: with line search.
    keep
        Load factors at which the displacement is kept, for the picture.
    file
        CSV file of the path.

    Attributes
    ----------
    kept
        (load factor, this rank's displacement) at those factors that are past.
    """

    def __init__(
        self,
        comm,
        size=32,
        friction=FRICTION,
        options=None,
        gamma=None,
        keep=(0.3, 0.7, 1.0),
        file=None,
    ):
        self.friction, self.keep, self.kept = friction, keep, []
        scene = self.scene = scene_of(comm, size)
        V = tools.vector_space(scene.mesh, 2)
        self.u = fem.Function(V, name="displacement")
        self.material = bodies.NeoHookean(moduli(scene), NU)
        L = self.material.residual(self.u, 4)
        self.down = fem.Constant(scene.mesh, 0.0)
        bcs = [
            tools.prescribe(V, scene.find(name), component=0)
            for name in ("bottom", "ends")
        ]
        bcs += [
            tools.prescribe(V, scene.find("bottom"), component=1),
            tools.prescribe(V, scene.find("ends"), self.down, 1),
        ]
        self.contact = raymortar.Contact(
            self.u,
            scene.facet_tags,
            [(TAGS["slave"], TAGS["master"])],
            raymortar.AugmentedLagrangian(gamma),
            raymortar.Coulomb(friction) if friction else None,
        )
        self.problem = raymortar.NonlinearProblem(L, self.contact, bcs)
        options = LINE_SEARCH if options is None else options
        self.solver = raymortar.SNESSolver(self.problem, options)
        self._places = [centre_of(V, scene, name) for name in ("master", "slave")]
        W = self.contact.multiplier.function_space
        self._node = centre_of(W, scene, "slave")
        middle = {name: partial(self.centre, k) for k, name in enumerate(MIDDLE_OF)}
        self.history = raymortar.History(self.problem, file, more=middle)

    def apply(self, t):
        """Push the ring's ends down."""
        self.down.value = -PUSH * t

    def centre(self, k):
        """Displacement of a surface or pressure in the middle. Collective."""
        values = self.u.x.array.reshape(-1, 2)
        mine = [x for place in self._places for x in values[place].sum(axis=0)]
        # Traction on the slave: a vector, or without friction along its normal
        lam = self.contact.multiplier.x.array
        last = lam.reshape(-1, self.contact.layout.components)[self._node, -1].sum()
        mine.append(last if self.friction else -last)
        return self.scene.mesh.comm.allreduce(mine[k])

    def path(self, steps, rows=(), strategy="auto"):
        """Rows of the accepted steps after those given: a generator. Collective."""
        begin, halvings = (rows[-1].t, rows[-1].halvings) if rows else (0.0, 0)
        # A path that was cut between its steps goes on with shorter ones
        left = math.ceil((1.0 - begin) * steps - 1e-6)
        if left < 1:
            return
        load = raymortar.LoadSteps(
            self.solver,
            self.apply,
            left,
            path=(begin, 1.0),
            history=self.history,
            strategy=strategy,
        )
        clock = time.process_time()
        for step in load:
            t, last = step.factor, self.history.rows[-1]
            if (
                len(self.kept) < len(self.keep)
                and t >= self.keep[len(self.kept)] - 1e-9
            ):
                self.kept.append((t, self.u.x.array.copy()))
            now = time.process_time()
            yield Row(
                t,
                step.iterations,
                halvings + step.halvings,
                *(getattr(last, name) for name in MIDDLE_OF),
                last.force_0_x,
                last.force_0_y,
                now - clock,
            )
            clock = now

    def pictures(self):
        """The displacements kept, as arrays for a checkpoint."""
        return {f"kept_{t!r}": u for t, u in self.kept}

    def load(self, path):
        """Go back to a checkpoint; its rows."""
        rows, arrays = long_runs.load(path, self.contact, Row)
        long_runs.resume(self.history, rows)
        self.kept = [(float(name[5:]), u) for name, u in arrays.items()]
        return rows


def line(row):
    """A row on screen, under `HEADING`."""
    return (
        f"{row.t:9.4f}{row.iterations:8.0f}{row.halvings:10.0f}{row.fy:11.3f}"
        f"{row.pressure:11.3f}{row.seconds:9.2f}"
    )


def summary(model, rows):
    """The path as arrays, one entry for each accepted step."""
    column = {name: np.array([getattr(r, name) for r in rows]) for name in Row._fields}
    below, above, force = (
        np.column_stack([column[name] for name in names])
        for names in (("below_x", "below_y"), ("above_x", "above_y"), ("fx", "fy"))
    )
    return SimpleNamespace(
        scene=model.scene,
        u=model.u,
        contact=model.contact,
        material=model.material,
        factor=column["t"],
        iterations=column["iterations"].astype(int),
        below=below,
        above=above,
        gap=GAP + above[:, 1] - below[:, 1],
        pressure=column["pressure"],
        force=force,
        halvings=int(rows[-1].halvings),
        kept=model.kept,
    )


def solve(
    comm,
    size=32,
    steps=50,
    friction=FRICTION,
    options=None,
    gamma=None,
    strategy="auto",
):
    """Push the ring in `steps`; what happened at each accepted step."""
    model = HalfRing(comm, size, friction, options, gamma)
    return summary(model, list(model.path(steps, strategy=strategy)))


def lift_off(result):
    """First load factor at which the pressure in the middle is gone again."""
    touched = np.argmax(result.pressure > 0.0)
    after = touched + np.argmax(
        result.pressure[touched:] < 0.02 * result.pressure.max()
    )
    return result.factor[after] if after > touched else np.nan


def draw(result, friction, path):
    """The ring at some load factors, and the middle of the block over all of them."""
    scene, u = result.scene, result.u
    mesh = scene.mesh
    pictures = drawing.gather_states(u, result.kept, lambda: result.material.mises(u))
    lam, mises = result.contact.multiplier, result.material.mises(u)
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, lam, mises])
    if mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, axes = plt.subplots(2, 2, figsize=(10, 6.4), layout="constrained")
    for panel, (factor, cells) in zip(axes.flat, pictures):
        colours = draw_bodies(panel, *cells)
        panel.set_title(f"t = {factor:.2f}")
    fig.colorbar(colours, ax=axes[:, 0], label="von Mises stress [MPa]", shrink=0.7)
    draw_middle(axes[1, 1], result, friction)
    fig.savefig(path)


def draw_bodies(axes, x, u, mises):
    """Stress in the deformed mesh; it spans decades between the layers."""
    from matplotlib.colors import LogNorm

    at, mises = x[..., :2] + u, np.maximum(mises, 1.0)
    colours = drawing.draw_field(axes, at, mises, norm=LogNorm(1.0, 1e4))
    axes.set(xlim=(-135, 135), ylim=(-55, 125))
    axes.axis("off")
    return colours


def draw_middle(axes, result, friction):
    """Displacement of the block's middle, and the pressure there, over the load."""
    axes.plot(result.factor, result.below[:, 1], color=drawing.COMPUTED)
    axes.set(xlabel="load factor t", ylabel="middle of the block, u_y [mm]")
    if friction in CODE_ASTER:
        axes.plot(TIMES, CODE_ASTER[friction], "o", color=drawing.EXACT, mfc="none")
        axes.legend(["raymortar", "code_aster"], loc="lower right", borderaxespad=3)
    pressure = axes.twinx()
    pressure.spines["right"].set_visible(True)
    pressure.plot(result.factor, result.pressure, "--", color=drawing.COMPUTED, lw=1)
    pressure.set(ylabel="pressure in the middle (dashed) [MPa]", ylim=(0, None))


def main(arguments=None):
    """Run the demo; 0 if it agrees with code_aster."""
    parser = common.options("half_ring", __doc__)
    parser.add_argument("--size", type=int, default=32, help="cells along the ring")
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--friction", type=float, default=FRICTION)
    parser.add_argument(
        "--no-line-search", action="store_true", help="full steps of Newton's method"
    )
    long_runs.add_options(parser)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    args.output.mkdir(parents=True, exist_ok=True)
    model = HalfRing(
        comm,
        args.size * (2 if args.fine else 1),
        args.friction,
        {} if args.no_line_search else None,
        file=args.output / "half_ring.csv",
    )
    rows = model.load(args.restart) if args.restart else []
    record = long_runs.Record(
        model.contact,
        args.checkpoint or args.restart,
        args.every,
        rows,
        HEADING,
        line,
        model.pictures,
    )
    if not record.follow(model.path(args.steps, list(rows))):
        return 130
    result = summary(model, rows)
    report.effort(result.contact, result.iterations, result.halvings)
    report.say(
        f"{len(result.factor)} steps, the middle comes off at t = "
        f"{lift_off(result):.3f}\nAgainst code_aster, another law and mesh:"
    )
    aside = max(np.abs(result.below[:, 0]).max(), np.abs(result.above[:, 0]).max())
    report.say(f"displacement of the middle to the side: {aside:.1e} mm")
    found = np.interp(TIMES, result.factor, result.below[:, 1])
    for t, ours, theirs in zip(TIMES, found, CODE_ASTER.get(args.friction, ())):
        # Small differences of large motions without friction
        allowed = 0.08 if args.friction else None
        report.add(f"middle of the block at t = {t}", ours, theirs, allowed, "mm")
    draw(result, args.friction, args.output / "half_ring.png")
    failed = report.finish("code_aster")
    return int(failed or aside > 1e-8 * OUTER)


if __name__ == "__main__":
    sys.exit(main())
