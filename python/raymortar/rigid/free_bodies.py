"""Free rigid bodies: their equations, and how they come to rest."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array
from ..core.errors import ConvergenceError, SetUpError, format_point, warn
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData, mean_facet_size, positions
from ..core.system.assembly import ContactAssembly
from .body import Body
from .push import (
    AT_REST,
    STEEP,
    Push,
    across_and_whole,
    in_space,
    moves_of,
    parts_of,
    sums_of,
)

# Share of a motion along the normals of closed points that counts as zero
_NOTHING = 1e-10

# Least and largest penetration of a body at its first touch, in sizes of slave facets:
# with none no point would close, and a large one would be a poor first guess
LEAST, MOST = 0.02, 1.0

# Halvings of the interval that contain this penetration
_HALVINGS = 40


class FreeBodies:
    """Equations of the free bodies of one contact or several."""

    def __init__(self, system: Any) -> None:
        self._system, self.layout = system, system.layout
        self.bodies: tuple[Body, ...] = system.layout.bodies
        self._comm: MPI.Comm = system.layout.comm
        self._size = mean_facet_size(system.zones)
        self._stiffness: float | None = None
        # At the start of this solve
        self._moved: set[Body] = set()
        # Bodies with a turn that the user has been told of
        self._told: set[Body] = set()

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the derivative of the forces other than contact. Collective.

        A motion that nothing resists gets an artificial stiffness: it stays where it is
        if nothing pushes along it, and otherwise moves by the distance to the slave, or
        by a facet.
        """
        for body in self.bodies:
            block = body.pushed()[1]
            push = self.push(body)
            block = block + self._hold(push)
            if body in self._moved:
                # At its first touch each motion is limited to a facet, and vanishes with
                # the residual, so that Newton's method stays quadratic
                brake = np.linalg.norm(push.forces) / (MOST * self._size)
                block += brake * np.eye(len(body.freedom))
            if self.layout.own_bodies:
                rows = self.layout.body_rows[body].astype(PETSc.IntType)
                A.setValues(rows, rows, block, addv=PETSc.InsertMode.ADD_VALUES)

    def _hold(self, push: Push) -> Array:
        """Artificial stiffness against loose motions, (n, n). Collective."""
        size = float(np.linalg.norm(push.unmet))
        if size == 0.0:
            # The mean of the volume's dofs
            if self._stiffness is None:
                diagonal = np.abs(self._system.stiffness_diagonal)
                sums = self._comm.allreduce(np.array([diagonal.sum(), len(diagonal)]))
                self._stiffness = float(sums[0] / sums[1])
            stiffness = self._stiffness
        else:
            way, ahead = push.way, np.inf
            if way is not None:
                ahead = self._nearest(self._ahead(push.body, way))
            turns = np.any(push.unmet[push.body.freedom.is_turn])
            far = self._size if turns or not np.isfinite(ahead) else ahead
            stiffness = size / (far + LEAST * self._size)
        return stiffness * push.loose @ push.loose.T

    def push(self, body: Body) -> Push:
        """Forces on a body at the last update. Collective."""
        freedom = body.freedom
        n = len(freedom)
        sums = sums_of(body, self._points(body))
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        resists, contact = sums[: n * n].reshape(n, n), sums[n * n : n * n + n]
        area, size = sums[-2:]
        if area > 0.0:
            resists = resists / area
        values, motions = np.linalg.eigh(resists + np.diag(1.0 * freedom.is_resisted))
        pushed, _ = body.pushed()
        return Push(
            body,
            pushed - contact,
            float(np.linalg.norm(pushed) + size),
            motions[:, values <= _NOTHING],
            area > 0.0,
        )

    def _met(self, body: Body) -> list[tuple[ContactAssembly, ZoneData]]:
        """Slave surfaces that meet a body, with their contacts."""
        parts = self._system.parts
        each = ((part, zone) for part in parts for zone in part.zones)
        return [(part, zone) for part, zone in each if body in zone.facets.bodies]

    def _rubs(self, body: Body) -> bool:
        """Whether a contact that meets a body has friction, or ties it."""
        parts = [part for part, _ in self._met(body)]
        return any(
            part.present.has_friction or part.surfaces.tied is not None
            for part in parts
        )

    def _points(self, body: Body) -> dict[str, Array]:
        """Points that hit a body."""
        names = "x normal master_normal distance traction weight status".split()
        found = []
        for _, zone in self._met(body):
            number, points = zone.facets.bodies.index(body), zone.points()
            mine = (points["master"] == number) & (points["status"] >= OPEN)
            found.append([points[name][mine] for name in names])
        return dict(zip(names, map(np.concatenate, zip(*found))))

    def _ahead(self, body: Body, way: Array) -> tuple[Array, Array]:
        """This rank's slave points ahead of a body that flies along a direction: their
        distances, and the stiffnesses of their springs of contact along it."""
        ahead, springs = [np.empty(0)], [np.empty(0)]
        for part, zone in self._met(body):
            points = zone.points()
            facing = -(in_space(points["normal"]) @ way)
            faces = facing > 0.0
            facing, x = facing[faces], in_space(points["x"])[faces]
            clearance = zone.at_points(zone.whole_offset, points)[faces] / facing
            found = _cast(body, body.motion(), x, way) + clearance
            stiffness = part.gamma_scale * points["weight"][faces] * facing**2
            is_ahead = np.isfinite(found) & (found >= 0.0)
            ahead.append(found[is_ahead])
            springs.append(stiffness[is_ahead])
        return np.concatenate(ahead), np.concatenate(springs)

    def _was_near(self, body: Body, way: Array, depth: float = 0.0) -> float:
        """Least distance of slave points ahead of a body along a direction at the
        accepted step, or in it by no more than a depth; infinite without any. Length.
        Collective."""
        nearest = np.inf
        for part, zone in self._met(body):
            points, surface = zone.points(), zone.facets.slave_surface
            at = points["slave"].astype(np.int32), points["xi"]
            x = positions(surface, *at, part.present.u_old.reshape(-1, surface.gdim))
            found = _cast(body, zone.motions.accepted(body), in_space(x), way)
            nearest = min(nearest, found[found >= -depth].min(initial=np.inf))
        return float(self._comm.allreduce(nearest, op=MPI.MIN))

    def _nearest(self, found: tuple[Array, Array]) -> float:
        """Least distance in a result of `_ahead`, infinite if it is empty. Length.
        Collective."""
        return float(self._comm.allreduce(found[0].min(initial=np.inf), op=MPI.MIN))

    def _closing_distance(self, found: tuple[Array, Array], force: float) -> float:
        """Way that a body flies until the springs of contact balance a force, with a
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

    def close_gaps(self) -> None:
        """Move free bodies that touch nothing to the slave ahead, where nothing but turns
        of round bodies without friction may be loose. Collective."""
        if not self.bodies or any(part.gamma is None for part in self._system.parts):
            return
        self._system.update()
        self._moved.clear()
        moved = [self._close_gap(body) for body in self.bodies]
        if any(moved):
            self._system.update()
        for body in self.bodies:
            self._require_resisted_turns(body)

    def _require_resisted_turns(self, body: Body) -> None:
        """Refuse moments about an axis of symmetry of a body without friction, and warn
        of such a turn without one. Collective."""
        may_turn = bool(np.any(body.freedom.is_turn & ~body.freedom.is_resisted))
        if not may_turn or self._rubs(body):
            return
        loose = self._loose_turns(body)
        if not loose.shape[1]:
            return
        pushed, _ = body.pushed()
        names = ", ".join(map(repr, parts_of(body, np.abs(loose).sum(axis=1))))
        is_turned = np.linalg.norm(loose.T @ pushed) > AT_REST * np.linalg.norm(pushed)
        text = (
            f"the rigid {body.name} {'is turned' if is_turned else 'may turn'} about an "
            f"axis of its symmetry, and nothing resists that: leave {names} out of free, or "
            "give stiffness or friction"
        )
        if is_turned:
            raise SetUpError(text)
        if body not in self._told:
            self._told.add(body)
            warn(text, page="contact")

    def _loose_turns(self, body: Body) -> Array:
        """Turns that change no gap and that no spring resists, as orthonormal columns
        (n, turns). Collective."""
        freedom, points = body.freedom, self._points(body)
        is_open = freedom.is_turn & ~freedom.is_resisted
        ways = np.eye(len(freedom))[:, is_open]
        moves = np.einsum("qja,jk->qka", moves_of(body, points), ways)
        along = np.einsum("qka,qa->qk", moves, in_space(points["master_normal"]))
        sums = np.stack([along.T @ along, np.einsum("qka,qla->kl", moves, moves)])
        sums = self._comm.allreduce(sums)
        values, turns = np.linalg.eigh(sums[0])
        loose: Array = ways @ turns[:, values <= _NOTHING * np.trace(sums[1])]
        return loose if sums[1].any() else loose[:, :0]

    def _close_gap(self, body: Body) -> bool:
        """Move a body to the slave ahead, if it touches nothing. Whether it was moved.
        Collective."""
        push = self.push(body)
        if push.touches:
            return False
        way, far, force = push.freed.flight
        if far == 0.0:
            return False
        found = self._ahead(body, way)
        nearest = self._nearest(found)
        if nearest > far:
            return False  # springs hold it before
        was_near = self._was_near(body, way, MOST * self._size)
        if not np.isfinite(nearest):
            # A fault of the set-up, unless the slave was ahead of the body, or beside
            # it, at the accepted step
            raise (ConvergenceError if np.isfinite(was_near) else SetUpError)(
                f"the rigid {body.name} is pushed along {format_point(way, digits=3)}, "
                "and nothing stops it: no slave facet that it meets is ahead of it. Give "
                "it stiffness, a force towards the slave, or a place from which it sees "
                "the slave"
            )
        freedom = body.freedom
        if np.isfinite(far):
            force *= 1.0 - nearest / far
        along = np.where(freedom.is_turn, 0.0, way[freedom.axis])
        force -= float(along @ (push.freed.forces - push.forces))
        freedom.values = freedom.values + self._closing_distance(found, force) * along
        self._moved.add(body)
        # Without inertia a flight takes no time, and is no slip; but a body that lay on
        # its slave has not flown
        if was_near > LEAST * self._size and not freedom.has_inertia:
            for part in self._system.parts:
                part.present.begin_slip_here(body)
        return True

    def _has_left(self, push: Push) -> bool:
        """Whether a body flies away from all that it meets, and would from the place of
        the accepted step. Collective."""
        way = push.freed.way
        if way is None:
            return False
        is_ahead = np.isfinite(self._nearest(self._ahead(push.body, way)))
        return not is_ahead and not np.isfinite(self._was_near(push.body, way))

    def any_left(self) -> bool:
        """Whether a body touches nothing and flies away, whatever the step.
        Collective."""
        pushes = [self.push(body) for body in self.bodies]
        return any([not one.touches and self._has_left(one) for one in pushes])

    def rubbed(self) -> list[str]:
        """Sentences on bodies with a load that friction alone resists, at the last
        update. Collective."""
        found = []
        for body in self.bodies:
            if not self._rubs(body):
                continue
            freedom, sums = body.freedom, across_and_whole(body, self._points(body))
            self._comm.Allreduce(MPI.IN_PLACE, sums)
            across, whole = sums
            slides = (across < STEEP * whole) & (freedom.stiffness == 0.0)
            slides &= ~(freedom.is_turn & freedom.spins)
            names = parts_of(body, np.where(slides, body.pushed()[0], 0.0))
            if names:
                found.append(
                    f"friction alone resists the load on the rigid {body.name} along "
                    f"{', '.join(names)}, and may be too small for it"
                )
        return found

    def unheld(self) -> list[str]:
        """Sentences on bodies with a force that nothing resists. Collective."""
        found = []
        for body in self.bodies:
            push = self.push(body)
            names = parts_of(body, push.unmet)
            end = "and nothing stops it"
            if push.touches and self._rubs(body):
                end = "where friction alone resists"
            if not names:
                continue
            text = f"the rigid {body.name} is pushed along {', '.join(names)}, {end}"
            if self._has_left(push):
                text += (
                    ": no slave facet that it meets is ahead of it, whatever the step. "
                    "Give it stiffness, or a force towards the slave"
                )
            found.append(text)
        return found


def _cast(body: Body, motion: Array, x: Array, way: Array) -> Array:
    """Distances that a body in a position flies along a direction to points (n, 3)."""
    R, shift = body.pose_of(motion)
    rays = np.tile(-(R.T @ way), (len(x), 1))
    return body.tool.distances_along((x - shift) @ R, rays)
