"""A block pressed on another one, by a problem as DOLFINx's own of 0.10 and later."""

import ufl
from dolfinx import fem
from problems import COMM, fix, residual

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, NonlinearProblem
from raymortar.core import compat

GAMMA = 1000.0


class Pressed:
    """A block pressed on another one, by a problem with options of its own."""

    def __init__(self, method=None, **options):
        self.scene = two_blocks(COMM, 2, "quadrilateral", 3, 4)
        self.u = fem.Function(compat.vector_space(self.scene.mesh, 1))
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(3, 4)],
            AugmentedLagrangian(GAMMA) if method is None else method,
        )
        V, self.top = self.u.function_space, fem.Constant(self.scene.mesh, (0.0, 0.0))
        top = fix(V, self.scene, "top", None, self.top)
        self.bcs = [fix(V, self.scene, "bottom"), top]
        self.F = residual(self.scene, self.u, "neo-hookean")[0]
        self.problem = NonlinearProblem(self.F, self.contact, bcs=self.bcs, **options)
        self.press(0.1)

    def press(self, share):
        self.top.value[:] = (0.0, -share)


def beside_another_unknown():
    """The problem of a block pressed on another one, and of a scalar of its own."""
    pressed = Pressed()
    w = fem.Function(compat.scalar_space(pressed.scene.mesh, 1), name="w")
    q = ufl.TestFunction(w.function_space)
    F = [pressed.F, (w - pressed.u[1]) * q * ufl.dx]
    contact = raymortar.Contact(pressed.u, pressed.scene.facet_tags, [(3, 4)])
    return pressed, NonlinearProblem(F, contact, bcs=pressed.bcs, u=[pressed.u, w])
