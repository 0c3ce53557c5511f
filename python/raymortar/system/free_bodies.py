"""Free rigid bodies: their equations, and how they come to rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..compat import Array
from ..errors import SetUpError, raise_everywhere
from ..interface.point_results import CLOSED, OPEN, PointStatus
from ..interface.stiffness import mean_facet_size
from ..rigid.body import Body

if TYPE_CHECKING:
    from .coupled import CoupledSystem

# Share of a motion along the normals of closed points that counts as zero
_NOTHING = 1e-10

# Share of all forces on a body that counts as zero
_AT_REST = 1e-9

# Least and largest penetration of a body at its first touch, in sizes of slave facets:
# with none no point would close, and a large one would be a poor first guess
LEAST, MOST = 0.02, 1.0

# Halvings of the interval that contain this penetration
_HALVINGS = 40


@dataclass(frozen=True)
class Push:
    """Forces on a free body at its present place, and what resists them.

    Attributes
    ----------
    body
        The body.
    forces
        Forces along its unknowns, with those of contact, (n,). Force.
    scale
        Sum of the sizes of all forces on it. Force.
    loose
        Motions that neither springs nor closed points resist, as orthonormal columns,
        (n, motions).
    touches
        Whether any point is closed.
    """

    body: Body
    forces: Array
    scale: float
    loose: Array
    touches: bool

    @property
    def unmet(self) -> Array:
        """Part of the forces that nothing resists, (n,); zero if it is rounding
        error."""
        part: Array = self.loose @ (self.loose.T @ self.forces)
        return part if np.linalg.norm(part) > _AT_REST * self.scale else 0.0 * part

    @property
    def way(self) -> Array | None:
        """Direction of the translation that nothing resists, (3,); None without one."""
        freedom = self.body.freedom
        way = np.where(freedom.is_turn, 0.0, self.unmet)
        size = float(np.linalg.norm(way))
        if size == 0.0:
            return None
        way = way / size
        if np.linalg.norm(way - self.loose @ (self.loose.T @ way)) > 1e-6:
            return None
        vector = np.zeros(3)
        vector[freedom.axis[way != 0.0]] = way[way != 0.0]
        return vector

    @property
    def flight(self) -> tuple[Array, float, float]:
        """How a body that touches nothing flies: its direction (3,), the distance to
        which springs and dampers let it go, and the force along the direction."""
        way, freedom = self.way, self.body.freedom
        if way is not None:
            return way, np.inf, float(np.linalg.norm(self.unmet))
        stiffness = np.diag(self.body.pushed()[1])
        is_held = ~freedom.is_turn & (stiffness > 0.0)
        moves = np.zeros(3)
        moves[freedom.axis[is_held]] = self.forces[is_held] / stiffness[is_held]
        far = float(np.linalg.norm(moves))
        force = float(np.linalg.norm(self.forces[is_held]))
        return (moves / far if far > 0.0 else moves), far, force


class FreeBodies:
    """Equations of the free bodies of one contact or several.

    Parameters
    ----------
    system
        One contact or several, after the first update.
    """

    def __init__(self, system: CoupledSystem) -> None:
        self._system, self.layout = system, system.layout
        self._comm: MPI.Comm = system.layout.comm
        self._size = mean_facet_size(system.layout, system.zones)
        self._stiffness: float | None = None
        # At the start of this solve
        self._flown: set[Body] = set()

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The free bodies."""
        bodies: tuple[Body, ...] = self.layout.bodies
        return bodies

    def add_residual(self, b: PETSc.Vec) -> None:
        """Add the forces other than contact to the residual."""
        for body in self.layout.own_bodies:
            pushed, _ = body.pushed()
            rows = self.layout.body_rows[body].astype(PETSc.IntType)
            b.setValues(rows, -pushed, addv=PETSc.InsertMode.ADD_VALUES)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the derivative of the forces other than contact. Collective.

        A motion that nothing resists gets an artificial stiffness: it stays where it is
        if nothing pushes along it, and otherwise moves by the distance to the slave, or
        by a facet.
        """
        for body in self.bodies:
            block = body.pushed()[1]
            push = self.push(body)
            block = block + self._hold(push) + self._brake(push)
            if self.layout.own_bodies:
                rows = self.layout.body_rows[body].astype(PETSc.IntType)
                A.setValues(rows, rows, block, addv=PETSc.InsertMode.ADD_VALUES)

    def _hold(self, push: Push) -> Array:
        """Artificial stiffness against loose motions, (n, n). Collective."""
        size = float(np.linalg.norm(push.unmet))
        if size == 0.0:
            stiffness = self._mean_stiffness()
        else:
            way, ahead = push.way, np.inf
            if way is not None:
                ahead = self._nearest(self._ahead(push.body, way))
            turns = np.any(push.unmet[push.body.freedom.is_turn])
            far = self._size if turns or not np.isfinite(ahead) else ahead
            stiffness = size / (far + LEAST * self._size)
        held: Array = stiffness * push.loose @ push.loose.T
        return held

    def _brake(self, push: Push) -> Array:
        """Artificial stiffness of a body at its first touch, (n, n). It limits each
        motion to a facet, and vanishes with the residual, so that Newton's method stays
        quadratic."""
        count = len(push.body.freedom)
        if push.body not in self._flown:
            return np.zeros((count, count))
        return np.linalg.norm(push.forces) / (MOST * self._size) * np.eye(count)

    def _mean_stiffness(self) -> float:
        """Mean stiffness of the volume's dofs. Force per length. Collective."""
        if self._stiffness is None:
            diagonal = np.abs(self._system.stiffness_diagonal)
            sums = self._comm.allreduce(np.array([diagonal.sum(), len(diagonal)]))
            self._stiffness = float(sums[0] / sums[1])
        return self._stiffness

    def push(self, body: Body) -> Push:
        """Forces on a body at the last update. Collective."""
        freedom = body.freedom
        n = len(freedom)
        rates = freedom.rates()
        sums = np.zeros(n * n + n + 2)
        for points in self._points(body):
            _add_points(sums, n, body, rates, points)
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        resists, contact = sums[: n * n].reshape(n, n), sums[n * n : n * n + n]
        area, size = sums[-2:]
        if area > 0.0:
            resists = resists / area
        has_spring = (freedom.stiffness > 0.0) | (freedom.damping > 0.0)
        values, motions = np.linalg.eigh(resists + np.diag(1.0 * has_spring))
        pushed, _ = body.pushed()
        return Push(
            body,
            pushed - contact,
            float(np.linalg.norm(pushed) + size),
            motions[:, values <= _NOTHING],
            area > 0.0,
        )

    def _points(self, body: Body) -> list[dict[str, Array]]:
        """Points that hit a body, zone by zone."""
        found = []
        for zone in self._system.zones:
            if body not in zone.facets.bodies:
                continue
            number = zone.facets.bodies.index(body)
            points = zone.points()
            mine = (points["master"] == number) & (points["status"] >= OPEN)
            names = "x", "normal", "distance", "traction", "weight", "status"
            found.append({name: points[name][mine] for name in names})
        return found

    def _ahead(self, body: Body, way: Array) -> tuple[Array, Array]:
        """This rank's slave points ahead of a body that flies along a direction: their
        distances, and the stiffnesses of their springs of contact along it."""
        R, shift = body.pose_of(body.motion())
        ahead, springs = [np.empty(0)], [np.empty(0)]
        for part in self._system.parts:
            for zone in part.zones:
                if body not in zone.facets.bodies:
                    continue
                points = zone.points()
                facing = -(_in_space(points["normal"]) @ way)
                x = _in_space(points["x"])[facing > 0.0]
                rays = np.broadcast_to(-(R.T @ way), x.shape)
                found = body.tool.distances_along((x - shift) @ R, rays.copy())
                stiffness = part.gamma_scale * points["weight"] * facing**2
                is_ahead = np.isfinite(found) & (found >= 0.0)
                ahead.append(found[is_ahead])
                springs.append(stiffness[facing > 0.0][is_ahead])
        return np.concatenate(ahead), np.concatenate(springs)

    def _nearest(self, found: tuple[Array, Array]) -> float:
        """Least distance in a result of `_ahead`, infinite if it is empty. Length.
        Collective."""
        return float(self._comm.allreduce(found[0].min(initial=np.inf), op=MPI.MIN))

    def _landing(self, found: tuple[Array, Array], force: float) -> float:
        """How far a body flies until the springs of contact balance a force, with a
        rigid slave. Length. Collective."""
        ahead, springs = found
        nearest = self._nearest(found)
        low, high = (nearest + share * self._size for share in (LEAST, MOST))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            held = float(springs @ np.maximum(middle - ahead, 0.0))
            if self._comm.allreduce(held) < force:
                low = middle
            else:
                high = middle
        return low

    def seat(self) -> None:
        """Move free bodies that touch nothing to the slave ahead. Collective.

        Raises
        ------
        SetUpError
            If nothing stops a body.
        """
        if not self.bodies or any(part.gamma is None for part in self._system.parts):
            return
        self._system.update()
        self._flown.clear()
        moved = [self._fly(body) for body in self.bodies]
        if any(moved):
            self._system.update()

    def _fly(self, body: Body) -> bool:
        """Move a body to the slave ahead, if it touches nothing. Whether it was moved.
        Collective."""
        push = self.push(body)
        if push.touches:
            return False
        way, far, force = push.flight
        if far == 0.0:
            return False
        found = self._ahead(body, way)
        nearest, message = self._nearest(found), None
        if nearest > far:
            return False  # springs hold it before
        if not np.isfinite(nearest):
            message = (
                f"the rigid {body.name} is pushed along "
                f"({', '.join(f'{x:.3g}' for x in way)}), and nothing stops it: no "
                "slave facet that it meets is ahead of it. Give it stiffness, a force "
                "towards the slave, or a place from which it sees the slave"
            )
        raise_everywhere(self._comm, message, SetUpError)
        freedom = body.freedom
        if np.isfinite(far):
            force *= 1.0 - nearest / far
        along = np.where(freedom.is_turn, 0.0, way[freedom.axis])
        freedom.values = freedom.values + self._landing(found, force) * along
        self._flown.add(body)
        # A flight is no slip
        for part in self._system.parts:
            part.present.forget_flight(body)
        return True

    def _left_behind(self, push: Push) -> str:
        """What to say of a body that flies away from all that it meets. Collective."""
        way = push.way
        if way is None or np.isfinite(self._nearest(self._ahead(push.body, way))):
            return ""
        return (
            ": no slave facet that it meets is ahead of it, whatever the step. Give it "
            "stiffness, or a force towards the slave"
        )

    def unheld(self) -> list[str]:
        """Sentences on bodies with a force that nothing resists. Collective."""
        found = []
        for body in self.bodies:
            push = self.push(body)
            unmet = push.unmet
            names = [
                name
                for name, part in zip(body.freedom.names, unmet)
                if abs(part) > 1e-3 * np.linalg.norm(unmet) > 0.0
            ]
            if names:
                found.append(
                    f"the rigid {body.name} is pushed along {', '.join(names)}, and "
                    "nothing stops it" + self._left_behind(push)
                )
        return found


def _in_space(x: Array) -> Array:
    """Vectors (n, d) padded to (n, 3)."""
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))


def _add_points(
    sums: Array,
    n: int,
    body: Body,
    rates: tuple[Array, Array, Array],
    points: dict[str, Array],
) -> None:
    """Add points to the sums of `FreeBodies.push`: resistance for each pair of
    unknowns, forces of contact, area of closed points, sum of the sizes of forces."""
    drift, spin, _ = rates
    normal, weight = _in_space(points["normal"]), points["weight"]
    hit = _in_space(points["x"]) + points["distance"][:, None] * normal
    moves = drift + np.einsum("jab,qb->qja", spin, hit - body.place)
    force = weight[:, None] * _in_space(points["traction"])
    sums[n * n : n * n + n] += np.einsum("qja,qa->j", moves, force)
    sums[-1] += np.linalg.norm(force, axis=1).sum()
    closed, sticks = points["status"] >= CLOSED, points["status"] == PointStatus.STICK
    along = np.einsum("qja,qa->qj", moves, normal)[closed]
    resists = np.einsum("q,qj,qk->jk", weight[closed], along, along)
    resists += np.einsum("q,qja,qka->jk", weight[sticks], moves[sticks], moves[sticks])
    sums[: n * n] += resists.ravel()
    sums[-2] += weight[closed].sum()
