"""Forces on a free rigid body, and what resists them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.compat import Array
from ..core.interface.point_results import CLOSED, Status
from .body import Body

# Share of all forces on a body that counts as zero
AT_REST = 1e-9

# Share of a motion's square across the slave below which friction alone resists it
STEEP = 0.05


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
    def freed(self) -> Push:
        """This push without contact: multipliers that are not yet in balance may push a
        body that touches nothing."""
        return replace(self, forces=self.body.pushed()[0])

    @property
    def unmet(self) -> Array:
        """Part of the forces that nothing resists, (n,); zero if it is rounding
        error."""
        part: Array = self.loose @ (self.loose.T @ self.forces)
        return part if np.linalg.norm(part) > AT_REST * self.scale else 0.0 * part

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
        """Flight of a body that touches nothing: its direction (3,), the distance to
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


def moves_of(body: Body, points: dict[str, Array]) -> Array:
    """Motion of the places that points hit, by the unknowns of a body, (points, n, 3)."""
    drift, spin, _ = body.freedom.rates()
    normal = in_space(points["normal"])
    hit = in_space(points["x"]) + points["distance"][:, None] * normal
    return drift + np.einsum("jab,qb->qja", spin, hit - body.place)


def across_and_whole(body: Body, points: dict[str, Array]) -> Array:
    """Squares of the motions of closed points across the slave, and of all their motion,
    by the unknowns of a body, (2, n)."""
    closed = points["status"] >= CLOSED
    weight, moves = points["weight"][closed], moves_of(body, points)[closed]
    across = np.einsum("qja,qa->qj", moves, in_space(points["normal"])[closed])
    return np.stack([weight @ across**2, np.einsum("q,qja->j", weight, moves**2)])


def parts_of(body: Body, forces: Array) -> list[str]:
    """Names of the motions along which there is a part of forces (n,)."""
    size = np.linalg.norm(forces)
    return [
        name
        for name, part in zip(body.freedom.names, forces)
        if abs(part) > 1e-3 * size > 0.0
    ]


def in_space(x: Array) -> Array:
    """Vectors (n, d) with zeros up to (n, 3)."""
    found = np.zeros((len(x), 3))  # `np.pad` enters thirty functions
    found[:, : x.shape[1]] = x
    return found


def sums_of(body: Body, points: dict[str, Array]) -> Array:
    """Sum up points for `FreeBodies.push`: resistance for each pair of unknowns, forces
    of contact, area of closed points, sizes of forces."""
    normal, weight, moves = (
        in_space(points["normal"]),
        points["weight"],
        moves_of(body, points),
    )
    force = weight[:, None] * in_space(points["traction"])
    closed, sticks = points["status"] >= CLOSED, points["status"] == Status.STICK
    along = np.einsum("qja,qa->qj", moves, normal)[closed]
    resists = np.einsum("q,qj,qk->jk", weight[closed], along, along)
    resists += np.einsum("q,qja,qka->jk", weight[sticks], moves[sticks], moves[sticks])
    sizes = weight[closed].sum(), np.linalg.norm(force, axis=1).sum()
    return np.concatenate(
        [resists.ravel(), np.einsum("qja,qa->j", moves, force), sizes]
    )
