"""A sheet between a punch and a die, as the demo has it, but elastic."""

import bodies
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import rigid, tools

# Any consistent units; forces per thickness. Half of the sheet and of the tools
E, NU, FRICTION, WEIGHT, LENGTH, THICKNESS = 1000.0, 0.3, 0.05, 1e-4, 2.4, 0.1
OPENING, ROUND, DEEP, NOSE = 1.0, 0.3, 1.4, 0.6
ABOVE, TAGS = 0.3, {"axis": 1, "top": 2, "bottom": 3}
# Of contact: the automatic one goes by the solid's stiffness, and a sheet that bends is
# far softer, so that Newton's method needs three times as many iterations with it
GAMMA = 0.5 * E


class Forming:
    """The sheet of so many cells through its thickness, with its tools."""

    def __init__(self, comm, size=2):
        divisions, ends = (round(LENGTH / THICKNESS) * size, size), (LENGTH, THICKNESS)
        sides = {"left": TAGS["axis"], "top": TAGS["top"], "bottom": TAGS["bottom"]}
        block = Block(divisions, (0.0, 0.0), ends, tags=sides)
        self.scene = Scene(*assemble_blocks(comm, [block], "quadrilateral"), TAGS)
        V = tools.vector_space(self.scene.mesh, 2)
        self.u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
        form = bodies.NeoHookean(E, NU).residual(self.u, 4)
        form += WEIGHT / (LENGTH * THICKNESS) * v[1] * ufl.dx
        # The solid is on the left of who walks along the points
        corners = [(1.2 * LENGTH, 0.0), (OPENING, 0.0), (OPENING, -DEEP)]
        die = rigid.Polyline([*corners, (ROUND - OPENING, -DEEP)], radius=ROUND)
        self.die = rigid.Body(die, name="die")
        circle = rigid.Circle((0.0, THICKNESS + NOSE), NOSE)
        self.punch, law = rigid.Body(circle, name="punch"), raymortar.Coulomb(FRICTION)
        pairs = [(TAGS["top"], self.punch), (TAGS["bottom"], self.die)]
        method = raymortar.AugmentedLagrangian(GAMMA, degree=1)
        self.contact = raymortar.Contact(
            self.u, self.scene.facet_tags, pairs, method, friction=law
        )
        bcs = [tools.prescribe(V, self.scene.find("axis"), component=0)]
        self.problem = raymortar.NonlinearProblem(form, self.contact, bcs)
        self.iterations, self.halvings = [], 0

    def follow(self, apply, steps):
        """Take load steps."""
        path = raymortar.LoadSteps(self.problem.snes_solver, apply, steps)
        self.iterations += [step.iterations for step in path.run()]
        self.halvings += path.halvings

    def forces(self):
        """On punch and die, (2,) each, counted as positive upward. Collective."""
        return [
            self.contact.results.resultant_on(b).force for b in (self.punch, self.die)
        ]


def beam_force(depth):
    """Half of the force of a beam on two supports that is bent in the middle: bending in
    plane strain, and shear (Timoshenko). Supports move in along the round shoulders
    with the slope there, 3 depth / span."""
    span = 2.0 * (OPENING + ROUND)
    span = span - 2.0 * ROUND * 3.0 * depth / span
    bending = 48.0 * E / (1.0 - NU**2) * THICKNESS**3 / 12.0 / span**3
    shear = 4.0 * 5.0 / 6.0 * E / (2.0 * (1.0 + NU)) * THICKNESS / span
    return 0.5 * depth / (1.0 / bending + 1.0 / shear)
