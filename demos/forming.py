"""Forming: a sheet is bent into a die by a punch, and springs back (2D, plane strain).

Die and punch are rigid: the die a `rigid.Surface` of curved facets, the punch a circle
that is moved down and away again. Both sides of the sheet are slaves. Nothing but its
own weight and contact holds it up and down. A neo-Hookean sheet has to come back to where
it lay, but for what friction keeps. An elastoplastic one keeps the bend, but for a
curvature that the elastoplastic beam predicts.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
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
E, NU, FRICTION, WEIGHT = 1000.0, 0.3, 0.05, 1e-4
LENGTH, THICKNESS = 2.4, 0.1
OPENING, ROUND, DEEP = 1.0, 0.3, 1.4
NOSE, DEPTH, SMALL, ABOVE = 0.6, 0.8, 0.02, 0.3
# Of contact: the automatic one goes by the solid's stiffness, and a sheet that bends is
# far softer, so that Newton's method needs three times as many iterations with it
GAMMA = 0.5 * E
# Of the elastoplastic sheet
YIELD, HARDENING, PLASTIC_DEPTH = 5.0, 50.0, 0.25
TAGS = {"axis": 1, "top": 2, "bottom": 3}


def arc(centre, radius, begin, end, parts):
    """Points along an arc, (parts + 1, 2). Angles in degrees."""
    angle = np.radians(np.linspace(begin, end, parts + 1))
    return np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def die():
    """A trough with rounded shoulders, whose solid is on the left of its facets."""
    outer, inner = OPENING + ROUND, OPENING - ROUND
    points = np.vstack(
        [
            [(1.2 * LENGTH, 0.0), (0.5 * (1.2 * LENGTH + outer), 0.0)],
            arc((outer, -ROUND), ROUND, 90.0, 180.0, 16),
            [(OPENING, -0.5 * DEEP)],
            arc((inner, ROUND - DEEP), ROUND, 0.0, -90.0, 16),
            [(0.0, -DEEP), (-inner, -DEEP)],
        ]
    )
    ends = np.arange(0, len(points) - 2, 2)
    facets = np.column_stack([ends, ends + 2, ends + 1])
    return rigid.Surface(points, facets, closed=False)


class Forming:
    """The sheet with its tools.

    Parameters
    ----------
    size
        Cells through the thickness.
    free
        Whether forces say where the punch is.
    plastic
        Whether the sheet is elastoplastic.
    """

    def __init__(self, comm, size=2, friction=FRICTION, free=False, plastic=False):
        self.size = size
        divisions = round(LENGTH / THICKNESS) * size, size
        box = (0.0, 0.0), (LENGTH, THICKNESS)
        sides = {"left": TAGS["axis"], "top": TAGS["top"], "bottom": TAGS["bottom"]}
        made = assemble_blocks(
            comm, [Block(divisions, *box, tags=sides)], "quadrilateral"
        )
        self.scene = Scene(*made, TAGS)
        V = tools.vector_space(self.scene.mesh, 2)
        self.u = fem.Function(V, name="displacement")
        self.plastic, self.hooks = None, {}
        if plastic:
            self.plastic = plasticity.ElastoPlastic(self.u, E, NU, YIELD, HARDENING)
            self.hooks["on_accept"] = self.plastic.accept
            form = self.plastic.residual(4)
        else:
            form = bodies.NeoHookean(E, NU).residual(self.u, 4)
        weight = fem.Constant(self.scene.mesh, (0.0, -WEIGHT / (LENGTH * THICKNESS)))
        load = ufl.inner(weight, ufl.TestFunction(V)) * ufl.dx
        bcs = [tools.prescribe(V, self.scene.find("axis"), component=0)]
        self.die = rigid.Body(die(), name="die")
        self.punch = rigid.Body(
            rigid.Circle((0.0, THICKNESS + NOSE), NOSE),
            name="punch",
            free=("y",) if free else (),
        )
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(TAGS["top"], self.punch), (TAGS["bottom"], self.die)],
            raymortar.AugmentedLagrangian(GAMMA, degree=1),
            friction=raymortar.Coulomb(friction) if friction else None,
        )
        self.problem = raymortar.NonlinearProblem(form - load, self.contact, bcs)
        self.solver = raymortar.SNESSolver(self.problem)
        self.history = raymortar.History(self.problem)
        self.iterations, self.halvings = [], 0

    def follow(self, apply, steps, **options):
        """Take load steps."""
        path = raymortar.LoadSteps(
            self.solver, apply, steps, history=self.history, **self.hooks, **options
        )
        self.iterations += [step.iterations for step in path]
        self.halvings += path.halvings

    def mises(self):
        """Von Mises stress at the nodes. Collective."""
        if self.plastic is not None:
            return self.plastic.mises()
        return bodies.NeoHookean(E, NU).mises(self.u)

    def curvature(self):
        """Curvature in the middle of the sheet: the turn of its section that far from it,
        over the distance, which is the thickness. One over length. Collective."""
        ends = []
        for name in ("bottom", "top"):
            x, u = common.gather_nodes(self.u, self.scene, name)
            here = self.scene.mesh.comm.bcast((x, u))
            nearest = np.abs(here[0][:, 0] - THICKNESS).argmin()
            ends.append(here[0][nearest, :2] + here[1][nearest])
        across = ends[1] - ends[0]
        return np.arctan2(-across[0], across[1]) / THICKNESS

    def lay(self):
        """The sheet lies down on the die, by its weight alone."""
        if not self.punch.is_free:
            self.punch.move((0.0, ABOVE))
        self.follow(lambda t: None, 1, stabilize=True)

    def move(self, begin, end, steps):
        """The punch's tip goes from one height above the sheet to another."""
        self.follow(
            lambda t: self.punch.move((0.0, begin + t * (end - begin))),
            steps,
            extrapolate=True,
        )

    def push(self, force, steps):
        """The punch is pressed down by a force."""

        def apply(t):
            self.punch.force = (0.0, -t * force)

        self.follow(apply, steps)

    def forces(self):
        """On punch and die, (2,) each, counted as positive upward. Collective."""
        return [self.contact.resultant_on(b).force for b in (self.punch, self.die)]


def beam_force(depth):
    """Half of the force of a beam on two supports that is bent in the middle: bending in
    plane strain, and shear (Timoshenko). Supports move in along the round shoulders
    with the slope there, 3 depth / span."""
    span = 2.0 * (OPENING + ROUND)
    span = span - 2.0 * ROUND * 3.0 * depth / span
    bending = 48.0 * E / (1.0 - NU**2) * THICKNESS**3 / 12.0 / span**3
    shear = 4.0 * 5.0 / 6.0 * E / (2.0 * (1.0 + NU)) * THICKNESS / span
    return 0.5 * depth / (1.0 / bending + 1.0 / shear)


def form(comm, size, steps, friction=FRICTION):
    """Lay the sheet down, bend it and let it spring back."""
    model = Forming(comm, size, friction)
    u, states = model.u, []
    model.lay()
    lies = u.x.array.copy()
    states.append((ABOVE, lies))
    sag = -common.value_at_origin(u, model.scene, "bottom", 1)
    model.move(0.0, -SMALL, 1)
    small = SMALL - sag, model.forces()[0][1]
    model.move(-SMALL, -0.5 * DEPTH, steps // 2)
    half = model.forces()[0][1]
    model.move(-0.5 * DEPTH, -DEPTH, steps // 2)
    states.append((-DEPTH, u.x.array.copy()))
    bent = model.forces()
    model.move(-DEPTH, ABOVE, steps)
    states.append((ABOVE, u.x.array.copy()))
    moved = np.abs(u.x.array - lies).max(initial=0.0)
    return SimpleNamespace(
        model=model,
        states=states,
        small=small,
        half=half,
        bent=bent,
        left=comm.allreduce(moved, op=MPI.MAX),
    )


def form_plastic(comm, size, steps):
    """Bend an elastoplastic sheet and let it spring back: curvatures of its middle."""
    model = Forming(comm, size, plastic=True)
    model.lay()
    model.move(0.0, -SMALL, 1)
    model.move(-SMALL, -PLASTIC_DEPTH, steps // 2)
    bent = model.curvature()
    model.move(-PLASTIC_DEPTH, 0.0, steps // 2)
    model.move(0.0, ABOVE, 1)
    return SimpleNamespace(model=model, bent=bent, kept=model.curvature())


def kept_by_beam(bent):
    """Curvature that an elastoplastic beam keeps: unloading is elastic."""
    resists = E / (1.0 - NU**2) * THICKNESS**3 / 12.0
    return bent - plasticity.moment(bent, THICKNESS, E, NU, YIELD, HARDENING) / resists


def draw_force(axes, history, colour, name):
    """Force of the punch over its depth, down and up."""
    depth, force = -history["translation_punch_y"], history["push_punch_y"]
    deepest = np.argmax(depth)
    touches = depth > -0.02
    for label, mark, part in (
        ("down", "o-", slice(0, deepest + 1)),
        ("up", "s--", slice(deepest, None)),
    ):
        here = touches[part]
        axes.plot(
            depth[part][here],
            force[part][here],
            mark,
            ms=3.5,
            mfc="none",
            color=colour,
            label=f"{name}, {label}",
        )


def draw(result, plastic, parts, path):
    """The sheet between its tools, and the force over the depth."""
    model = result.model
    plt = drawing.pyplot()
    figure, panels = plt.subplot_mosaic(
        [["0", "force"], ["1", "force"], ["2", "force"]],
        figsize=(10.0, 6.0),
        width_ratios=(1.2, 1.0),
        layout="constrained",
    )
    titles = "elastic: bent", "elastic: sprung back", "elastoplastic: sprung back"
    top = np.array([values.max() for _, (_, _, values) in parts]).max()
    lower, upper = np.array([-2.6, -0.95]), np.array([2.6, 1.05])
    for name, title, (height, (x, moved, mises)) in zip("012", titles, parts):
        axes, at = panels[name], x[..., :2] + moved
        colours = drawing.draw_field(axes, at, mises, [(1, 1), (-1, 1)], top)
        model.punch.move((0.0, height))
        sheet_tools = model.punch, model.die
        for image in (1.0, -1.0):
            for curve in (c for b in sheet_tools for c in curves(b, lower, upper)):
                axes.plot(image * curve[:, 0], curve[:, 1], color=drawing.EXACT, lw=1.0)
        axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
        axes.axis("off")
        axes.set_title(title, loc="left")
    figure.colorbar(
        colours,
        ax=[panels[name] for name in "012"],
        label="von Mises stress",
        shrink=0.6,
    )
    axes = panels["force"]
    draw_force(axes, model.history, drawing.COMPUTED, "elastic")
    draw_force(axes, plastic.model.history, "#2980b9", "elastoplastic")
    small = np.linspace(0.0, 0.5 * DEPTH)
    axes.plot(small, beam_force(small), color=drawing.EXACT, label="beam")
    axes.set(xlabel="depth of the punch", ylabel="half of the punch's force")
    axes.set(ylim=(0.0, 1.25 * model.history["push_punch_y"].max()))
    axes.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if forces balance, and the sheet bends and springs back."""
    parser = common.options("forming", __doc__)
    parser.add_argument("--size", type=int, default=2, help="cells through the sheet")
    parser.add_argument("--steps", type=int, default=16, help="down, and up again")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    args.output.mkdir(parents=True, exist_ok=True)
    result = form(comm, args.size * (2 if args.fine else 1), args.steps)
    model = result.model
    report.effort(model.contact, model.iterations, model.halvings)
    report.say(f"left after the spring-back: {result.left / DEPTH:.1e} of the depth")
    depth, force = result.small
    report.add("force at a small depth", force, beam_force(depth), 0.02)
    punch, die = result.bent
    report.add("punch and weight, die", punch[1] + WEIGHT, -die[1], 1e-8)
    report.add("1 + left / depth", 1.0 + result.left / DEPTH, 1.0, 1e-4)

    pushed = Forming(comm, model.size, free=True)
    pushed.lay()
    pushed.push(result.half, args.steps // 2)
    depth = -pushed.punch.translation[1]
    report.add("depth under half of the way's force", depth, 0.5 * DEPTH, 0.01)

    plastic = form_plastic(comm, 2 * model.size, args.steps)
    report.effort(
        plastic.model.contact, plastic.model.iterations, plastic.model.halvings
    )
    report.say(f"curvature of the elastoplastic sheet, bent: {plastic.bent:.3g}")
    sprung = plastic.bent - plastic.kept
    expected = plastic.bent - kept_by_beam(plastic.bent)
    report.add("curvature that springs back", sprung, expected, 0.06)

    parts = drawing.gather_states(model.u, result.states[1:], model.mises)
    u, contact, mises = plastic.model.u, plastic.model.contact, plastic.model.mises
    parts += drawing.gather_states(u, [(ABOVE, u.x.array.copy())], mises)
    fields = [u, contact.traction("normal"), mises()]
    io.write_xdmf(args.output / "forming.xdmf", plastic.model.scene.mesh, fields)
    if comm.rank == 0:
        draw(result, plastic, parts, args.output / "forming.png")
    return report.finish("expected")


if __name__ == "__main__":
    sys.exit(main())
