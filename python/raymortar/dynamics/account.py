"""Energies and momentum of accepted time steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from mpi4py import MPI

import numpy as np
import ufl

from ..core.compat import Array
from ..core.problem import CoupledProblem
from ..core.state import Quantity, of_array, of_function
from ..records.functionals import functional
from .motion import End, Motion
from .moving_bodies import MovingBodies
from .rest import Rest
from .schemes import Midpoint


@dataclass(frozen=True)
class Energy:
    """Energies at the end of a time step, and work since the first one began.

    Attributes
    ----------
    kinetic
        Kinetic energy of bodies and of free rigid bodies.
    elastic
        Stored energy, the value of the given functional; None without one.
    contact
        Work of contact on all bodies so far: minus the work of friction and what is in
        the springs of a penalty. With a multiplier and without friction it is an error:
        of the steps, and on round surfaces of the facets too.
    external
        Work of loads and supports so far. Without a functional the stresses count as
        loads. Dampers of free rigid bodies are loads.
    dissipated
        Energy that the damping of `Inertia` has taken so far.
    adhesion
        Energy that bonds of adhesion store, and what their damage has taken so far.
    """

    kinetic: float
    elastic: float | None
    contact: float
    external: float
    dissipated: float = 0.0
    adhesion: float = 0.0

    @property
    def total(self) -> float:
        """Kinetic and elastic energy."""
        return self.kinetic + (self.elastic or 0.0)


# Least force of contact on a value that it holds, over the largest of all forces: more
# than rounding
PUSHED = 1e-10


class Account:
    """Accounts for energy, momentum and impulse, step by step. Collective.

    The problem's volume is then the user's forms alone.
    """

    def __init__(
        self,
        problem: CoupledProblem,
        motion: Motion,
        bodies: MovingBodies,
        energy: Sequence[ufl.Form],
    ) -> None:
        self._problem, self._motion, self._bodies = problem, motion, bodies
        self._volume = problem.volume
        self._energy = functional(energy, problem.comm) if energy else None
        unknowns, layout = problem.contact.unknowns, problem.contact.layout
        V = unknowns.u.function_space
        self._d, n = V.mesh.geometry.dim, V.dofmap.index_map.size_local
        self._comm, self._of_u = layout.comm, unknowns.u_owned
        self._X = V.tabulate_dof_coordinates()[:n, : self._d]
        contacts = problem.contact.contacts
        self._bonds = [one.bond for one in contacts if one.bond is not None]
        # On the state that was solved for
        kinds = ["forms", "contact", "inertia"] + ["damping"] * motion.inertia.is_damped
        kinds += ["adhesion"] * bool(self._bonds)
        self._forces = [motion.functions(f"forces of {kind}") for kind in kinds]
        # Work of contact, and of loads and supports, up to the state that was solved for
        # and up to the end of the step; and of both on rigid bodies
        self._work, self._shown, self._of_bodies = np.zeros((3, 2))
        self._dissipated = np.zeros(1)
        self.was_read = False
        # Stored energy of the state that was solved for, and at the end of the step
        self._solved = np.zeros(0)
        self._stored_then: float | None = None
        self._elastic: float | None = None
        # Energy of bonds on the state that was solved for, and at the end of the step
        self._bonded_then, self._bonded = np.zeros(1), 0.0
        self._impulse = np.zeros((len(problem.contact.zones), self._d))
        self._push = self._impulse.copy()
        self._rest: Rest | None = None
        self.now = Energy(0.0, None, 0.0, 0.0)
        self.moments: tuple[Array, Array] = (np.zeros(self._d), np.zeros(3))

    # Forces

    def static(self) -> tuple[Array, Array]:
        """Forces of the forms and of contact at the owned unknowns of the forms, (n,)
        each, at the last update. Collective."""
        contact, b = self._problem.contact, self._problem.create_vector()
        contact.system.add_residual(b)
        of_contact = b.array_r[: contact.layout.n].copy()
        b.destroy()
        return self._volume.forces(self._problem.bcs), of_contact

    def _of_bonds(self) -> list[Array]:
        """Forces of adhesion at the owned unknowns of the forms, (n,), if there is any.
        Collective."""
        if not self._bonds:
            return []
        return [sum(one.forces(self._problem.bcs) for one in self._bonds)]

    def _in_bonds(self) -> float:
        """Energy that bonds store and damage has taken, at the present unknowns.
        Collective."""
        return float(sum(one.stored() + one.dissipated() for one in self._bonds))

    def begin(self) -> Array:
        """Begin at the present state; return all forces without inertia, (n,).
        Collective."""
        of_form, of_contact = self.static()
        of_bonds = self._of_bonds()
        rows = np.zeros((len(self._forces), len(of_form)))
        rows[:2] = of_form, of_contact
        if of_bonds:
            rows[-1] = of_bonds[0]
        self._set_rows(rows)
        self._elastic = self._stored_then = self._stored()
        self._bonded_then[:] = self._bonded = self._in_bonds()
        self._push[:] = self._pushes()
        self._solved = self._problem.contact.unknowns.owned_values()
        return np.sum([of_form, of_contact, *of_bonds], axis=0)

    def set_begin(self, inertia: Array) -> None:
        """Take the forces of inertia, (n,), that motion starts with. Collective."""
        self._motion.set(self._forces[2], inertia)
        if self._motion.inertia.is_damped:
            velocity = self._motion.values(self._motion.velocity)
            self._motion.set(self._forces[3], self._motion.inertia.damped(velocity))
        self.now = self._energies(self._motion.values(self._motion.velocity))

    def go_on(self, solved: Array) -> bool:
        """Go on from the state that was read, given what its step was solved for; False
        where it has no account. Collective."""
        if not self.was_read:
            return False
        self._solved = solved
        return True

    # State

    def quantities(self) -> Iterator[Quantity]:
        """Yield forces on the state that was solved for, and sums up to it."""
        for of in self._forces:
            for f in of:
                yield of_function(f.name, f)
        yield of_array("works", self._work)
        yield of_array("works on bodies", self._of_bodies)
        if self._motion.inertia.is_damped:
            yield of_array("dissipated", self._dissipated)
        if self._bonds:
            yield of_array("energy of bonds", self._bonded_then)
        yield of_array("impulses", self._impulse)
        yield of_array("pushes", self._push)

        def write(values: Array) -> None:
            has, stored = values.tolist()
            self._stored_then = stored if self._energy is not None else None
            self.was_read = has > 0.0 and not (np.isnan(stored) and self._energy)

        yield Quantity("account", self._summary, write)

    def _summary(self) -> Array:
        """Whether there is an account, and the energy stored; NaN: not asked for."""
        stored = self._stored_then
        return np.array([len(self._solved) > 0, np.nan if stored is None else stored])

    @property
    def _rows(self) -> Array:
        """Forces of forms, contact, inertia and, if there are any, of damping and of
        adhesion, (3 to 5, n)."""
        return np.array([self._motion.values(of) for of in self._forces])

    def _set_rows(self, rows: Array) -> None:
        for of, row in zip(self._forces, rows):
            self._motion.set(of, row)

    def _stored(self) -> float | None:
        """Stored energy at the present unknowns."""
        return None if self._energy is None else self._energy()

    def _pushes(self) -> Array:
        """Force of contact on each slave surface, (surfaces, d)."""
        results = self._problem.contact.results
        found = [results.resultant(i, None).force for i in range(len(self._push))]
        return np.array(found).reshape(self._push.shape)

    # Steps

    def record(self, end: End) -> None:
        """Add the solved step, and take its end. Collective."""
        of_form, of_contact = self.static()
        rows = np.array([of_form, of_contact, self._motion.inertia_now()])
        if self._motion.inertia.is_damped:
            rows = np.vstack([rows, self._motion.damping_now()])
            self._dissipated += self._taken(rows[3], end)
        rows = np.vstack([rows, *self._of_bonds()])
        pushes, gamma = self._pushes(), self._motion.scheme.gamma
        # A step's work is that between the states which are solved for, by the mean of
        # the forces in both: values without mass know no others
        stored, bonded = self._stored(), self._in_bonds()
        mean, change = 0.5 * (rows + self._rows), end.solved - self._solved
        self._work += self._works(mean, change, self._gained(stored, bonded))
        self._of_bodies += self._bodies.work_of_contact, self._bodies.work()
        mean_push = gamma * pushes + (1.0 - gamma) * self._push
        self._impulse += self._motion.dt * mean_push
        self._set_rows(rows)
        self._push[:] = pushes
        self._solved, self._stored_then = end.solved, stored
        self._bonded_then[:] = bonded
        self._finish(end)

    def _taken(self, new: Array, end: End) -> float:
        """Work that damping takes in a step with forces (n,) where it was solved
        [theory (6.21)]."""
        mean = new
        if not isinstance(self._motion.scheme, Midpoint):
            mean = 0.5 * (new + self._motion.values(self._forces[3]))
        return float(self._comm.allreduce(mean @ (end.u - self._motion.begun)))

    def _gained(self, stored: float | None, bonded: float) -> float:
        """Energy of bodies and bonds, less that of the state that was solved for."""
        before = (self._stored_then or 0.0) + float(self._bonded_then[0])
        return (stored or 0.0) + bonded - before

    def _works(self, rows: Array, change: Array, gained: float) -> Array:
        """Work of contact, and of loads and supports, by the rows of forces on the way of
        a change (n,), on which bodies and bonds gain energy."""
        on_supports = np.where(self._problem.prescribed, rows.sum(axis=0), 0.0)
        inner = rows[0] + rows[-1] if self._bonds else rows[0]
        works = [-rows[1] @ change, (on_supports - inner) @ change]
        of_contact, of_others = self._comm.allreduce(np.array(works))
        return np.array([of_contact, of_others + gained])

    def _finish(self, end: End) -> None:
        """Take energies and moments at the end of a step; its work goes on from the state
        that was solved for."""
        u, rest = end.u, np.zeros(2)
        if isinstance(self._motion.scheme, Midpoint):
            u = self._at_rest(end.u)
            rows = self._rows
            with self._motion.at(u):
                rows[0] = 0.5 * (rows[0] + self._volume.forces(self._problem.bcs))
                for of_bonds in self._of_bonds():
                    rows[-1] = 0.5 * (rows[-1] + of_bonds)
                self._elastic, self._bonded = self._stored(), self._in_bonds()
            gained = self._gained(self._elastic, self._bonded)
            rest = self._works(rows, u - end.solved, gained)
        else:
            self._elastic, self._bonded = self._stored(), float(self._bonded_then[0])
        self._shown = self._work + rest + self._of_bodies
        self.now = self._energies(end.v)
        self.moments = self.momentum(u, end.v)

    def _at_rest(self, u: Array) -> Array:
        """Bring values without mass to rest at the end of a step, where neither contact
        nor a condition holds them [theory (6.18)]: the midpoint rule has them in balance
        at its middle only. Collective."""
        if self._rest is None:
            self._rest = Rest(self._problem, self._volume, self._bonds)
        rows = np.abs(self._rows)
        force, largest = rows[1], rows.max(initial=0.0)
        least = PUSHED * self._comm.allreduce(largest, op=MPI.MAX)
        is_held = self._motion.inertia.is_massive | self._problem.prescribed
        with self._motion.at(u):
            return u + self._rest.change(~(is_held | (force > least)))

    def _energies(self, v: Array) -> Energy:
        """Energies with velocities, (n,)."""
        kinetic = 0.5 * self._motion.size(v) ** 2 + self._bodies.kinetic()
        contact, external = self._shown.tolist()
        (dissipated,) = self._dissipated.tolist()
        return Energy(
            kinetic, self._elastic, contact, external, dissipated, self._bonded
        )

    # Columns

    def momentum(self, end: Array, v: Array) -> tuple[Array, Array]:
        """Momentum (d,) and moment of momentum about the origin, (1,) in the plane, (3,)
        in space, at unknowns and velocities (n,). Collective."""
        p = self._motion.inertia.times(v)[self._of_u].reshape(-1, self._d)
        x = self._X + end[self._of_u].reshape(-1, self._d)
        if self._d == 2:  # NumPy 2 has no cross product of vectors in the plane
            turns = (x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0])[:, None]
        else:
            turns = np.cross(x, p)
        sums = np.concatenate([p.sum(axis=0), turns.sum(axis=0)])
        sums = self._comm.allreduce(sums) + self._bodies.momentum()
        return sums[: self._d], sums[self._d :]

    def _impulse_names(self) -> list[str]:
        axes = "xyz"[: self._d]
        return [f"impulse_{i}_{x}" for i in range(len(self._impulse)) for x in axes]

    def columns(self) -> dict[str, Callable[[], float]]:
        """Columns of a history by name."""
        found: dict[str, Callable[[], float]] = {
            "kinetic": lambda: self.now.kinetic,
            "contact_work": lambda: self.now.contact,
            "external_work": lambda: self.now.external,
        }
        if self._motion.inertia.is_damped:
            found["dissipated"] = lambda: self.now.dissipated
        if self._bonds:
            found["adhesion"] = lambda: self.now.adhesion
        if self._energy is not None:
            found["elastic"] = lambda: float(self.now.elastic or 0.0)
        axes = "xyz"[: self._d]
        turns = [""] if self._d == 2 else [f"_{x}" for x in axes]
        names = [
            *((0, k, f"momentum_{x}") for k, x in enumerate(axes)),
            *((1, k, f"moment_of_momentum{x}") for k, x in enumerate(turns)),
        ]
        for of, k, name in names:
            found[name] = partial(lambda of, k: float(self.moments[of][k]), of, k)
        for k, name in enumerate(self._impulse_names()):
            found[name] = partial(lambda k: float(self._impulse.flat[k]), k)
        return found
