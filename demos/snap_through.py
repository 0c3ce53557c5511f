"""Snap-through: a punch presses a shallow arch through, by a force that falls (2D).

The arch is clamped, the punch free but for the plane of symmetry and for contact, from
a gap on. The force on it rises until the arch gives way, falls to a third while that
snaps, and rises again where it hangs. Steps of the force cannot follow that. Steps of
the punch's displacement do (`DisplacementControl`), with the force as an unknown, and
steps along the path (`ArcLength`); steps of the force under viscous forces jump over
what falls (`stabilize`).
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

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, tools

# Lengths in mm, moduli in MPa, forces in N per mm of thickness; half of the arch
SPAN, RISE, THICKNESS = 10.0, 0.75, 0.4
WIDTH, HEIGHT, RADIUS, GAP = 1.2, 1.0, 4.0, 0.1
E_ARCH, E_PUNCH, NU = 1000.0, 1e5, 0.3
PUSH, FORCE = 2.0, 0.3
TAGS = {"clamped": 1, "master": 2, "slave": 3, "axis": 4, "top": 5}


def scene_of(comm, size):
    """Arch of `size` cells along its half, and the punch above it. Collective."""

    def arch(x):
        share, s = x[:, 0] / SPAN, np.pi * x[:, 0] / SPAN
        y = 0.5 * RISE * (1.0 + np.cos(s)) + x[:, 1]
        return np.column_stack([SPAN * share, y])

    def punch(x):
        low = RISE + THICKNESS + GAP + x[:, 0] ** 2 / (2.0 * RADIUS)
        share = x[:, 1]
        y = (1.0 - share) * low + share * (RISE + THICKNESS + GAP + HEIGHT)
        return np.column_stack([x[:, 0], y])

    below = {"left": TAGS["axis"], "right": TAGS["clamped"], "top": TAGS["slave"]}
    above = {"left": TAGS["axis"], "bottom": TAGS["master"], "top": TAGS["top"]}
    blocks = [
        Block((size, 2), (0.0, 0.0), (SPAN, THICKNESS), mapping=arch, tags=below),
        Block((4, 4), (0.0, 0.0), (WIDTH, 1.0), mapping=punch, tags=above),
    ]
    mesh, cells, facets = assemble_blocks(comm, blocks, "triangle", 2)
    return Scene(mesh, cells, facets, TAGS, {"arch": 1, "punch": 2})


def force_at(node, u):
    """UFL form of a unit force along the last axis at a node, and that force.

    Node: (d,). Quadrature at the vertices makes the load of a field that is not zero at
    one vertex only a force there.
    """
    V = tools.scalar_space(u.function_space.mesh, 1)
    field, scale = fem.Function(V), fem.Constant(V.mesh, 0.0)
    x = V.tabulate_dof_coordinates()[:, : len(u)]
    field.x.array[:] = np.linalg.norm(x - node, axis=1) < 1e-9
    vertices = ufl.dx(
        metadata={"quadrature_rule": "vertex", "quadrature_degree": 1}, domain=V.mesh
    )
    area = tools.integral(field * vertices, V.mesh)
    v = ufl.TestFunction(u.function_space)
    return scale / area * field * v[len(u) - 1] * vertices, scale


class Arch:
    """The mechanical problem; `apply` sets the force of the load factor t.

    Parameters
    ----------
    size
        Cells along half of the arch.
    prescribed
        The displacement of the loaded node is prescribed in place of the force there:
        t times `PUSH`.
    """

    def __init__(
        self,
        comm,
        size=20,
        prescribed=False,
        method=None,
        friction=None,
        solver=raymortar.SNESSolver,
    ):
        scene = self.scene = scene_of(comm, size)
        V = tools.vector_space(scene.mesh, 2)
        self.u = u = fem.Function(V, name="displacement")
        E = tools.by_body(
            scene.mesh,
            scene.cell_tags,
            {"arch": E_ARCH, "punch": E_PUNCH},
            scene.bodies,
        )
        self.material = bodies.NeoHookean(E, NU)
        self.node = np.array([0.0, RISE + THICKNESS + GAP + HEIGHT])
        # Before the other form: it compiles one, after which UFL of DOLFINx 0.5 takes
        # test functions of the same space for others
        load, self.force = force_at(self.node, u)
        form = self.material.residual(u, 4) + load
        bcs = [
            tools.prescribe(V, scene.find("clamped")),
            tools.prescribe(V, scene.find("axis"), component=0),
        ]
        self.down, self.prescribed = fem.Constant(scene.mesh, 0.0), prescribed
        if prescribed:
            W, _ = V.sub(1).collapse()
            at = fem.locate_dofs_geometrical((V.sub(1), W), self._is_node)
            bcs.append(fem.dirichletbc(self.down, at[0], V.sub(1)))
        self.contact = raymortar.Contact(
            u,
            scene.facet_tags,
            [(TAGS["slave"], TAGS["master"])],
            method,
            friction=friction,
        )
        self.problem = raymortar.NonlinearProblem(form, self.contact, bcs)
        self.support = bcs[-1] if prescribed else None
        self.solver = solver(self.problem)

    def _is_node(self, x):
        """Whether points (3, n) are the loaded node."""
        return np.linalg.norm(x[:2].T - self.node, axis=1) < 1e-9

    def apply(self, t):
        """The load factor: force, or displacement where that is prescribed."""
        if self.prescribed:
            self.down.value = -PUSH * t
        else:
            self.force.value = FORCE * t

    def sinks(self):
        """Displacement of the loaded node, down. Collective."""
        V = self.u.function_space
        x = V.tabulate_dof_coordinates()[: V.dofmap.index_map.size_local]
        down = -self.u.x.array.reshape(-1, 2)[: len(x), 1]
        return V.mesh.comm.allreduce(down[self._is_node(x.T)].sum())

    def path(self, steps, file=None, keep=(), **options):
        """Displacement of the node and force on it along a path, from the start on."""
        reactions = {"node": self.support} if self.prescribed else None
        more = {"sinks": self.sinks}
        history = raymortar.History(self.problem, file, reactions, more=more)
        load = raymortar.LoadSteps(
            self.solver, self.apply, steps, history=history, **options
        )
        kept = []
        for step in load:
            if len(history) in keep:
                kept.append((history.rows[-1].sinks, self.u.x.array.copy()))
        if self.prescribed:
            force = -history["reaction_node_y"]
        else:
            led = "load_factor" in history.columns
            force = FORCE * history["load_factor" if led else "time"]
        return SimpleNamespace(
            sinks=np.append(0.0, history["sinks"]),
            force=np.append(0.0, force),
            iterations=history["iterations"],
            halvings=load.halvings,
            kept=kept,
        )


def compare(comm, size, steps, report, file=None):
    """The path led by displacement, by its length, by the force, and prescribed."""
    held = Arch(comm, size, prescribed=True).path(steps)
    model = Arch(comm, size)
    control = raymortar.DisplacementControl(model.node, direction=1, by=-PUSH)
    keep = [round(share * steps) for share in (0.25, 0.55, 1.0)]
    led = model.path(steps, file, keep, control=control)
    viscous = Arch(comm, size).path(steps // 2, stabilize=True)
    along, first = Arch(comm, size), 2.0 * GAP
    # Over the gap by displacement: where nothing is in contact nothing holds the punch
    control = raymortar.DisplacementControl(along.node, direction=1, by=-first)
    begin = along.path(2, control=control)
    arcs = along.path(
        steps,
        path=(begin.force[-1] / FORCE, 1.0),
        control=raymortar.ArcLength(radius=0.04),
        largest=4,
    )
    for name, found in (
        ("displacement prescribed", held),
        ("led by the displacement", led),
        ("led by the arc length", arcs),
        ("force, viscous", viscous),
    ):
        report.say(
            f"{name:24}{len(found.iterations):4} steps, {found.halvings} halvings, "
            f"{int(found.iterations.sum()):4} iterations"
        )
    return model, held, led, arcs, viscous


def draw(model, led, arcs, viscous, path):
    """The arch on its way, and the force over the displacement."""
    scene, u = model.scene, model.u
    pictures = drawing.gather_states(u, led.kept, lambda: model.material.mises(u))
    fields = [u, model.contact.multiplier, model.material.mises(u)]
    io.write_xdmf(path.with_suffix(".xdmf"), scene.mesh, fields)
    if scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, panels = plt.subplot_mosaic(
        [["0", "force"], ["1", "force"], ["2", "force"]],
        figsize=(11, 4.8),
        layout="constrained",
    )
    for name, (sinks, (x, moved, mises)) in zip("012", pictures):
        at = x[..., :2] + moved
        colours = drawing.draw_field(
            panels[name], at, mises, [(1, 1), (-1, 1)], top=25.0
        )
        panels[name].set(xlim=(-10.2, 10.2), ylim=(-1.1, 2.4))
        panels[name].axis("off")
        panels[name].set_title(f"punch at {sinks:.2f} mm", loc="left")
    fig.colorbar(
        colours,
        ax=[panels[name] for name in "012"],
        label="von Mises stress [MPa]",
        shrink=0.7,
    )
    axes = panels["force"]
    axes.plot(led.sinks, led.force, "o-", ms=3, color=drawing.COMPUTED)
    axes.plot(arcs.sinks[1:], arcs.force[1:], "s", ms=6, mfc="none", color="0.4")
    axes.plot(viscous.sinks, viscous.force, "^--", ms=5, color=drawing.EXACT, lw=0.8)
    axes.set(xlabel="punch's displacement [mm]", ylabel="half of the force [N/mm]")
    axes.set(xlim=(0.0, 1.1 * PUSH), ylim=(0.0, FORCE))
    axes.legend(
        ["led by the displacement", "led by the arc length", "force, viscous"],
        loc="upper left",
    )
    fig.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if the forces are those of the prescribed displacements."""
    parser = common.options("snap_through", __doc__)
    parser.add_argument("--size", type=int, default=20, help="cells along a half")
    parser.add_argument("--steps", type=int, default=40)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    size = args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "snap_through.csv"
    model, held, led, arcs, viscous = compare(comm, size, args.steps, report, file)
    report.effort(model.contact)
    error = np.abs(led.force - held.force).max() / held.force.max()
    report.add("1 + difference of forces", 1.0 + error, 1.0, 1e-8)
    top = np.argmax(held.force[: args.steps // 2])
    low = top + np.argmin(held.force[top:])
    for name, k in (("first limit of the force", top), ("second limit", low)):
        report.add(name, led.force[k], held.force[k], 1e-8, "N/mm")
    # Both end under the whole force
    ends = arcs.sinks[-1], viscous.sinks[-1]
    report.add("arc's end, viscous path's end", *ends, 1e-6, "mm")
    draw(model, led, arcs, viscous, args.output / "snap_through.png")
    return report.finish("prescribed")


if __name__ == "__main__":
    sys.exit(main())
