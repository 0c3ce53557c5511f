"""Snap-through: a punch presses a shallow arch through, by a force that falls (2D).

The arch is clamped, the punch free but for the plane of symmetry and for contact, from
a gap on. The force on it rises until the arch gives way, falls to a third while that
snaps, and rises again where it hangs. Steps of the force cannot follow that. Steps of
the punch's displacement do (`DisplacementControl`), with the force as an unknown, and
steps along the path (`ArcLength`); steps of the force under viscous forces jump over
what falls (`stabilize`).
"""

from types import SimpleNamespace

import bodies
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.arch import NODE, TAGS, scene_of
from raymortar import tools

# Lengths in mm, moduli in MPa, forces in N per mm of thickness; half of the arch
E_ARCH, E_PUNCH, NU = 1000.0, 1e5, 0.3
PUSH, FORCE = 2.0, 0.3


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
        self.node = NODE
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
