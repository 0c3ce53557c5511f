"""Problems in another frame, x -> eta Q x + shift, with moduli xi times as large.

What is found there is given in the frame and the units of the original.
"""

from __future__ import annotations

import dataclasses

import gathered
import numpy as np
import states
from dolfinx import fem
from problems import build, fix

from meshes.meshing import Scene
from raymortar import SNESSolver
from raymortar.core import compat
from raymortar.core.discretization.facets import shape_functions


def quarter_turn(dim):
    """A rotation that takes axes to axes: rollers stay rollers."""
    return np.roll(np.eye(3), 1, axis=0) if dim == 3 else np.array([[0, -1], [1, 0.0]])


@dataclasses.dataclass(frozen=True)
class Frame:
    """The transformation; `seed` is that of a renumbering, None: as it was."""

    Q: np.ndarray
    eta: float = 1.0
    xi: float = 1.0
    shift: np.ndarray | float = 0.0
    seed: int | None = None

    def place(self, scene):
        """The scene in this frame; its mesh is moved unless it is made anew."""
        if self.seed is not None:
            scene = states.renumbered(scene, self.seed)
        dim = len(self.Q)
        X = scene.mesh.geometry.x
        X[:, :dim] = self.eta * X[:, :dim] @ self.Q.T + self.shift
        return scene

    def original(self, X):
        """Positions (..., d) in the original."""
        return (X - self.shift) @ self.Q / self.eta

    def axis(self, k):
        """The axis that axis k becomes, and its sign; for `quarter_turn`."""
        j = int(np.argmax(np.abs(self.Q[:, k])))
        assert abs(self.Q[j, k]) == 1.0
        return j, self.Q[j, k]


class Framed:
    """What is found in a frame, for a class with `frame` and `problem`."""

    @property
    def displacement(self):
        """In the frame and unit of the original, (dofs, d)."""
        Q = self.frame.Q
        return self.problem.u.x.array.reshape(-1, len(Q)) @ Q / self.frame.eta

    @property
    def places(self):
        """Of the dofs, in the original, with the body as a further coordinate."""
        scene, V = self.problem.scene, self.problem.u.function_space
        X = self.frame.original(states.dof_positions(V))
        body = np.zeros((len(X), 1))
        for number in scene.bodies.values():
            body[states.body_dofs(scene, V, number)] = number * np.ptp(X)
        return np.hstack([body, X])

    @property
    def traction(self):
        """At the nodes, zero off the slave, in the original's frame and unit."""
        Q = self.frame.Q
        values = self.problem.contact.traction().x.array.reshape(-1, len(Q))
        return np.nan_to_num(values) @ Q / self.frame.xi

    @property
    def force(self):
        """On the slave of each zone, (zones, d)."""
        Q, contact = self.frame.Q, self.problem.contact
        forces = [contact.resultant(i).force for i in range(len(contact.zones))]
        return np.array(forces) @ Q / (self.frame.xi * self.frame.eta ** (len(Q) - 1))

    @property
    def counts(self):
        s = self.problem.contact.statistics
        return s.pairs, s.segments, s.points, s.hits, s.active_points

    @property
    def pairs(self):
        """Facets' numbers, (segments, 2), those of the slave on their rank."""
        parts = [zone.cpp.segments() for zone in self.problem.contact.zones]
        numbers = [np.column_stack([s["slave"], s["master"]]) for s in parts]
        return gathered.concatenated(np.concatenate(numbers))

    @property
    def segments(self):
        """Their bounding boxes in the reference of the original, (segments, 2 d)."""
        boxes = [self._boxes(zone) for zone in self.problem.contact.zones]
        return gathered.concatenated(np.concatenate(boxes))

    def _boxes(self, zone):
        """A vertex more or less, where two coincide, does not change them."""
        found, s = zone.cpp.segments(), zone.facets.slave_surface
        facet = np.repeat(found["slave"], np.diff(found["offsets"]))
        N, _ = shape_functions(s.shape, s.node_degree, found["xi"])
        X = np.einsum("qa,qad->qd", N, s.X[s.facet_nodes[facet]])
        X, first = self.frame.original(X), found["offsets"][:-1]
        if len(first) == 0:
            return np.empty((0, 2 * s.gdim))
        return np.hstack([f.reduceat(X, first) for f in (np.minimum, np.maximum)])


@dataclasses.dataclass(frozen=True)
class Hold:
    """Dirichlet condition on a part of the boundary.

    Attributes
    ----------
    name
        Of the tag.
    axes
        Components; None: all.
    path
        Takes the load factor to the displacement (d,); None: at rest.
    """

    name: str
    axes: tuple | None = None
    path: object = None

    def conditions(self, V, scene, frame):
        """Dirichlet conditions, and a function that moves them to a load factor."""
        dim = len(frame.Q)
        if self.axes is None:
            value = fem.Constant(scene.mesh, np.zeros(dim))
            parts, turned = [(None, value)], [(value, frame.Q)]
        else:
            parts, turned = [], []
            for k in self.axes:
                value, (j, sign) = fem.Constant(scene.mesh, 0.0), frame.axis(k)
                parts.append((j, value))
                turned.append((value, sign * np.eye(dim)[k]))

        def move(t):
            for value, Q in turned:
                u = np.zeros(dim) if self.path is None else np.asarray(self.path(t))
                value.value = frame.eta * Q @ u

        return [fix(V, scene, self.name, j, value) for j, value in parts], move


@dataclasses.dataclass(frozen=True)
class Model:
    """A boundary value problem that can be posed in any frame.

    Attributes
    ----------
    scene
        Builds the scene.
    holds
        `Hold`s.
    steps
        Load factors of the steps.
    E
        Number, numbers by body, or a function of places (n, d).
    nu, material, degree
        Of `problems.build`.
    rigid
        Body at rest with all its cells, if any.
    pressure
        Where iterations start from: on the slave, along the last axis.
    load
        Takes the load factor to the nominal stress (d, d) on the sides `loaded`.
    method
        Takes the unit of the augmentation to a method; None: the default.
    options
        Takes the unit of length to options of `Contact`.
    search
        Line search of SNES.
    """

    scene: object
    holds: tuple
    steps: tuple
    E: object = 2000.0
    nu: float = 0.3
    material: str = "neo-hookean"
    degree: int = 1
    rigid: str | None = None
    pressure: float = 0.0
    load: object = None
    loaded: tuple = ()
    method: object = None
    options: object = None
    search: str = "basic"

    @property
    def turns(self):
        """Whether any rotation will do: rollers go along axes alone."""
        return all(hold.axes is None for hold in self.holds)


class Solution(Framed):
    """A model solved in a frame."""

    def __init__(self, model: Model, frame: Frame):
        self.frame, self._moves = frame, []
        scene: Scene = frame.place(model.scene())
        callable_E = callable(model.E)
        E = dict.fromkeys(scene.bodies, 1.0) if callable_E else model.E
        E = E if isinstance(E, dict) else dict.fromkeys(scene.bodies, E)
        self.problem = build(
            scene,
            model.degree,
            model.material,
            model.method and model.method(frame.xi / frame.eta),
            E={body: frame.xi * value for body, value in E.items()},
            nu=model.nu,
            bcs=lambda V, s: self._conditions(model, V, s),
            loaded=model.loaded,
            **(model.options(frame.eta) if model.options else {}),
        )
        if callable_E:
            for modulus in self.problem.moduli:
                self._scale(modulus, model.E)
        self._solve(model)

    def _scale(self, modulus, E):
        """Multiply a function that is constant on each cell by one of places."""
        x = modulus.function_space.tabulate_dof_coordinates()[:, : len(self.frame.Q)]
        modulus.x.array[:] *= E(self.frame.original(x))

    def _conditions(self, model, V, scene):
        bcs = []
        for hold in model.holds:
            conditions, move = hold.conditions(V, scene, self.frame)
            bcs += conditions
            self._moves.append(move)
        if model.rigid is not None:
            cells = scene.cell_tags.find(scene.bodies[model.rigid])
            dim = len(self.frame.Q)
            compat.connectivity(V.mesh, dim, dim)  # DOLFINx 0.9 does not make it itself
            dofs = fem.locate_dofs_topological(V, dim, cells)
            bcs.append(fem.dirichletbc(fem.Function(V), dofs))
        return bcs

    def _solve(self, model):
        Q, contact = self.frame.Q, self.problem.contact
        self.iterations, self.closed = [], []
        if model.pressure:
            self._press(model.pressure)
        options = {"snes_linesearch_type": model.search, "snes_max_it": 40}
        for t in model.steps:
            for move in self._moves:
                move(t)
            if model.load is not None:
                self.problem.load.value[:] = self.frame.xi * Q @ model.load(t) @ Q.T
            self.iterations.append(self.problem.solve(SNESSolver, options))
            self.closed.append(contact.statistics.active_points)
            contact.advance()

    def _press(self, pressure):
        contact, Q = self.problem.contact, self.frame.Q
        values = contact.multiplier.x.array.reshape(-1, len(Q))
        for zone in contact.zones:
            values[zone.multiplier_nodes] = self.frame.xi * pressure * Q[:, -1]
