"""Blocks pressed and sheared against each other, shared by the tests of friction.

Most of them are homogeneous: F = I + (a - 1) e_z (x) e_z + k e (x) e_z in the blocks,
with a lateral direction e. Of the neo-Hookean law the traction on horizontal planes
is then mu k along e, and depends on a alone along e_z. The tractions of the lateral
faces are given, so that the states are exact on any mesh. What lies between the
blocks, a coat or the overlap of a penalty, is sheared as they are: tractions act over
its height on both sides, and its own lateral faces are loaded too.
"""

from __future__ import annotations

import numpy as np
import states
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM, DIMENSION, Problem, build, worst

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, Tresca
from raymortar.core import compat

E, NU = 10.0, 0.3
SHEAR = lame(E, NU)[0]
HEIGHT, WIDTH = 0.6, 0.8  # of the upper block
SQUEEZE = 0.9  # a
OPEN, STICK, SLIP = 1, 2, 3
METHODS = {
    "augmented": AugmentedLagrangian,
    "elastic": lambda: Penalty(200.0),
    "rate": lambda: Penalty(200.0, tangential="rate"),
}
HOLDING = ("augmented", "elastic")
# Coefficients for blocks that go through partial slip
SOFT = {
    "augmented": AugmentedLagrangian,
    "elastic": lambda: Penalty(30.0),
    "rate": lambda: Penalty(30.0, tangential="rate"),
}


# Homogeneous blocks


def direction(dim):
    """Lateral direction e of the shear."""
    return np.array([1.0, 0.0] if dim == 2 else [0.8, 0.6, 0.0])


def up(dim):
    return np.eye(dim)[-1]


def deformation(dim, k, a=SQUEEZE):
    z = up(dim)
    return np.eye(dim) + (a - 1.0) * np.outer(z, z) + k * np.outer(direction(dim), z)


def nominal(dim, k, a=SQUEEZE):
    """Nominal stress."""
    H = deformation(dim, k, a) - np.eye(dim)
    return MATERIALS["neo-hookean"][1](H, *lame(E, NU))


def pressure(dim):
    """Normal traction on horizontal planes, < 0."""
    return nominal(dim, 0.0)[-1, -1]


class Blocks:
    """A block on a wide foundation that is fixed throughout, or one like itself.

    Its bottom is at height 1, or at 0 with the foundation from -0.6 to 0.
    """

    def __init__(self, cell, method, friction, degree=1, fixed=True, **options):
        self.dim, self.fixed = DIMENSION[cell], fixed
        self.gamma = method.gamma if isinstance(method, Penalty) else np.inf
        self.elastic = getattr(method, "tangential", "") == "elastic"
        lateral = self.dim - 1
        size = 2.0 if fixed else WIDTH
        self.scene = two_blocks(
            COMM,
            self.dim,
            cell,
            lower_divisions=(3,) * lateral + (1,),
            upper_divisions=(2,) * lateral + (2,),
            lower_size=(size,) * lateral + (HEIGHT,),
            upper_size=(WIDTH,) * lateral + (HEIGHT,),
        )
        bodies = ["upper"] if fixed else ["upper", "lower"]
        self.layer = fem.Constant(self.scene.mesh, np.zeros((self.dim, self.dim)))
        loaded = [t for t in self.scene.tags if t.split("_")[0] in bodies]
        self.problem: Problem = build(
            self.scene,
            degree,
            "neo-hookean",
            method,
            E=E,
            nu=NU,
            loaded=loaded,
            bcs=self.conditions,
            layer=self.layer,
            friction=friction,
            **options,
        )
        self.X = states.dof_positions(self.problem.u.function_space)
        self.bottom = HEIGHT  # of the upper block

    @property
    def contact(self):
        return self.problem.contact

    def conditions(self, V, scene):
        """The foundation or its bottom, and the top, are where `self.ends` says."""
        self.ends = fem.Function(V)
        find = scene.facet_tags.find
        facets = [find(scene.tags[name]) for name in ("top", "bottom")]
        dofs = fem.locate_dofs_topological(V, self.dim - 1, np.concatenate(facets))
        if self.fixed:
            cells = scene.cell_tags.find(scene.bodies["lower"])
            whole = fem.locate_dofs_topological(V, self.dim, cells)
            dofs = np.unique(np.concatenate([dofs, whole]))
        self.held = dofs
        return [fem.dirichletbc(self.ends, dofs)]

    @property
    def apart(self):
        """Height of what lies between the blocks."""
        return pressure(self.dim) / self.gamma

    def displacement(self, k, slide=0.0):
        """Of homogeneous shear, the upper block ahead of the foundation by `slide`."""
        upper = self.X[:, -1] > self.bottom - 1e-9
        F = deformation(self.dim, k)
        top = (self.X - self.bottom * up(self.dim)) @ F.T
        top += self.bottom * up(self.dim) + slide * direction(self.dim)
        top += self.apart * up(self.dim)
        below = self.X.copy()
        if not self.fixed:
            below = self.X @ F.T
            top += self.bottom * (F - np.eye(self.dim))[:, -1]
        return np.where(upper[:, None], top, below) - self.X

    def exact(self, k, slide=0.0):
        """Where nodes of both bodies coincide the upper one's cells decide."""
        V = self.problem.u.function_space
        u = self.displacement(k, slide)
        lower = np.unique(
            compat.dofmap_array(V)[
                self.scene.cell_tags.find(self.scene.bodies["lower"])
            ]
        )
        F = np.eye(self.dim) if self.fixed else deformation(self.dim, k)
        u[lower] = self.X[lower] @ F.T - self.X[lower]
        return u

    def drive(self, k, slide=0.0, Q=None):
        """Prescribe the ends and lateral tractions of a state, turned by Q."""
        Q = np.eye(self.dim) if Q is None else Q
        x = self.X + self.exact(k, slide)
        self.ends.x.array[:] = (x @ Q.T - self.X).ravel()
        self.load(k, Q)
        return x @ Q.T - self.X

    def load(self, k, Q):
        """Set the lateral tractions of a state, turned by Q."""
        S = nominal(self.dim, k)
        self.problem.load.value[:] = Q @ S
        shear = S[:, -1] - S[-1, -1] * up(self.dim)
        self.layer.value[:] = self.apart * np.outer(Q @ up(self.dim), shear)

    def step(self, k, slide=0.0):
        """Solve for a state; error of the displacement, the step not yet accepted."""
        u = self.drive(k, slide)
        self.problem.solve()
        return worst(self.problem.u.x.array - u.ravel())

    def press(self):
        """Pressure without shear, accepted.

        From near the solution: a tenth of the height in one step, with slip on the
        way there, is more than Newton's method can do in some of the cases.
        """
        self.problem.u.x.array[:] = self.exact(0.0).ravel()
        if self.contact.multiplier is not None:
            lam = self.contact.multiplier.x.array.reshape(-1, self.dim)
            lam[:, -1] = -0.9 * pressure(self.dim)
        assert self.step(0.0) <= 1e-9
        self.contact.advance()

    def statuses(self):
        """Of all closed points of all ranks."""
        status = self.contact.points()["status"]
        return set().union(*COMM.allgather(set(status[status >= OPEN])))

    def ratio(self):
        """R_T / R_N of the contact force."""
        r = self.contact.resultant()
        return np.linalg.norm(r.tangential) / np.linalg.norm(r.normal)

    def spring(self, k):
        """Slip of springs that hold the shear k."""
        return SHEAR * k / self.gamma if self.elastic else 0.0


def limit_of(friction, dim):
    """Shear k at which a law slips."""
    if isinstance(friction, Tresca):
        return friction.bound / SHEAR
    return friction.mu * -pressure(dim) / SHEAR


# Rotations


def perturb(problem, seed, size=1e-3):
    """Random error of the start, so that Newton's method has something to find."""
    rng = np.random.default_rng(seed)
    u, lam = problem.u, problem.contact.multiplier
    u.x.array[:] += size * rng.uniform(-1.0, 1.0, u.x.array.shape)
    if lam is not None:
        lam.x.array[:] *= 1.0 + size * rng.uniform(-1.0, 1.0, lam.x.array.shape)
    for f in (u, lam):
        if f is not None:
            compat.scatter_forward(f.x)


def turn_guess(problem, Q):
    contact, X = problem.contact, states.dof_positions(problem.u.function_space)
    u = problem.u.x.array.reshape(X.shape)
    u[:] = (X + u) @ Q.T - X
    if contact.multiplier is not None:
        lam = contact.multiplier.x.array.reshape(-1, len(Q))
        lam[:] = lam @ Q.T


# Clamped blocks


def clamped(cell, method, friction, degree=1):
    """A block pressed on a foundation, not homogeneous: both ends clamped.

    Returns the problem and a function that moves its top, turned by Q.
    """
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(3,) * (dim - 1) + (2,),
        upper_divisions=2,
        lower_size=(1.4,) * (dim - 1) + (0.6,),
        upper_size=0.7,
    )
    ends = {}

    def conditions(V, scene):
        for name in ("bottom", "top"):
            facets = scene.facet_tags.find(scene.tags[name])
            dofs = fem.locate_dofs_topological(V, dim - 1, facets)
            ends[name] = fem.Function(V), dofs
        return [fem.dirichletbc(*end) for end in ends.values()]

    problem = build(
        scene,
        degree,
        "neo-hookean",
        method,
        E=E,
        nu=NU,
        bcs=conditions,
        friction=friction,
    )
    X = states.dof_positions(problem.u.function_space)

    def move(top, Q=None):
        Q = np.eye(dim) if Q is None else Q
        for name, shift in (("bottom", np.zeros(dim)), ("top", np.asarray(top))):
            ends[name][0].x.array[:] = ((X + shift) @ Q.T - X).ravel()

    return problem, move


def pressed_and_sheared(cell, method, friction=None, degree=1):
    """Accepted state of `clamped` with partial slip, or nearly."""
    friction = Coulomb(0.5) if friction is None else friction
    problem, move = clamped(cell, method, friction, degree)
    push = np.zeros(DIMENSION[cell])
    # Small steps: slip spreads from the edges
    path = [(-0.01 * k, 0.0) for k in range(1, 7)] + [
        (-0.06, 0.01 * k) for k in (1, 2, 3)
    ]
    for push[-1], push[0] in path:
        move(push)
        problem.solve()
        problem.contact.advance()
    return problem, move, push
