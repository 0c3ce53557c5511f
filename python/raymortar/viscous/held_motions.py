"""Motions of bodies that nothing resists, which viscous forces on one cell hold."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..core.compat import Array, Mask
from ..core.errors import ConvergenceError, warn
from ..core.finding import Finding
from ..core.interface.zone_data import mean_facet_size
from ..core.state import State
from ..diagnose.failure import attempt, iterations_of
from ..diagnose.holding import has_no_springs, touched
from ..diagnose.rigid_motions import motion_in_words
from ..solvers.settings import temporarily
from .approach import Approach
from .budget import GAIN, MOST_IDLE, Backoff, Budget
from .grip import grips, has_friction
from .loads import forces_on, resultants
from .viscosity import Viscosity

# Largest motion of loose bodies in one solve, in sizes of slave facets. Contact is
# found up to a distance or depth of two facets. Held bodies may also close gaps
FARTHEST = 1.0

# Share of all forces up to which a motion counts as driven by nothing but noise
IDLE = 1e-3

# Share of a body's forces up to which a motion that does not end is held all the same
DRIVEN = 1e-2

# Forces that hold such a motion act in one cell, as a share of its stiffness: at first,
# and while they let go of what else has moved. Largest number of motions held at once
HOLDS, YIELDS, MOST_HELD = 0.1, 0.01, 6

# A held motion is told again once the share of forces that drives it has grown by this
# factor: it grows by 2.7 for a disc with its weight aside, by 5 for a block that is pushed
# beyond its friction
GROWN = 4.0

PRESCRIBE = "prescribe it if its place matters"

# Largest motion in the last solve, without viscous forces, as a share of the limit: a
# body that moves further is held by nothing. And in a linear step, of a motion that
# needs no forces to hold it any more
SETTLED, RESISTED = 0.1, 0.01


class HeldMotions:
    """Solves loose bodies, which no support holds, with motions held that nothing
    resists. Collective.

    A motion that takes off in a linear step is held in one cell, and so are further ones
    that take off then. If it is driven, a solve goes on without what held it; one that
    little drives, and that has not ended after a while, is held where it was driven
    least; one that more drives ends the step.

    `work` is the work of the viscous forces so far. Energy. `share` is the largest share
    of all forces of a body at the end of the last step. `gave_up` tells why the last step
    was given up, if it took too many tangents. `holds` tells whether a motion is held. A
    body that nothing stops `is_lost` in this step and in halves of it.
    """

    def __init__(self, solver: Any) -> None:
        self._problem = problem = solver.problem
        assert problem.contact.unknowns.only  # or it raises
        self._solver, self._contact = solver, problem.contact
        self.work = self.share = 0.0
        groups = problem.convergence.groups
        held = groups.on_rows(problem.constrained)
        self._loose = groups.sum(held)[: groups.bodies] == 0.0
        self.has_loose = bool(self._loose.any())
        self._limit = self._facet if self.has_loose else np.inf
        self._approach = Approach(self._contact, self._loose, self._limit)
        self.gave_up: str | None = None
        self.holds = self._said = self.is_lost = False
        self._without_it, self._no_hold = Backoff(), Backoff()
        # Share of forces that a held motion may be driven by, and the end of the solve
        # with it held that was driven least: share, state and what held it
        self._may_drive, self._drives = 0.0, Budget(problem)
        self._rest: tuple[float, State, Array] | None = None
        # Share of forces that drives the motion in the last solve, and the last one told
        self._drive = self._told = 0.0
        self._ways: dict[str, list[str]] = {}  # by body, motions that are held
        # Motions of bodies, and change of the displacement, in the last solve under viscous
        # forces, and in a linear step that has moved a loose body far
        self._moving = np.zeros(groups.bodies), np.zeros(problem.contact.layout.n_u)
        self._free: tuple[Array, Array] | None = None

    def begin(self) -> None:
        """Begin a step."""
        self.gave_up, self._rest = None, None
        self._drives.begin()
        self._no_hold.reset()

    def accepted(self) -> None:
        """Note that a step is accepted."""
        self.gave_up, self.is_lost = None, False

    @property
    def goes_on(self) -> bool:
        """Whether a motion that may be held has been driven as much for a while."""
        return self._rest is not None and self._drives.is_spent

    @cached_property
    def _facet(self) -> float:
        """Largest motion of a loose body in one solve, and of one that falls. Length."""
        return FARTHEST * mean_facet_size(self._contact.zones)

    @cached_property
    def _viscosity(self) -> Viscosity:
        return Viscosity(self._problem)

    def _plain(self) -> int:
        """Solve once by the solver as it was given."""
        return iterations_of(self._solver)

    def _without(self, share: float = SETTLED) -> int | None:
        """Solve without viscous forces, first for a linear step; return None if that
        fails, or moves a loose body by more than a share of the limit."""
        begin, steps = self._contact.state(), int(self.has_loose)
        if self.has_loose and self._takes_off(share):
            self._contact.restore(begin)
            return None
        self._viscosity.begin()
        last = self._within(self._plain, SETTLED * self._limit, begin)
        return None if last is None else last + steps

    def _takes_off(self, share: float = SETTLED) -> bool:
        """Take a linear step and tell whether it moves a loose body far: a motion that
        nothing resists is by far its largest part."""
        self._viscosity.begin()
        with temporarily(self._solver, max_it=1):
            attempt(self._plain)
        motions, loose = self._motions()
        takes_off = share * self._limit < loose < np.inf
        self._free = (motions, self._viscosity.change()) if takes_off else None
        return bool(takes_off)

    def hold(self) -> int | None:
        """Solve a step with a motion held that nothing resists; return None if there is
        none, or that fails. Collective."""
        begin = self._contact.state()
        takes_off = self._takes_off()
        self._contact.restore(begin)
        return self._hold(self._limit) if takes_off else None

    def _hold(self, farthest: float, may_let_go: bool = False) -> int | None:
        """Solve with the motion held of the loose body that has taken off, and say so
        once; return None if that fails or moves a body too far. If it `may_let_go`, and
        the body then stays without being held, it is not held: it may have taken off
        only because the state was out of balance."""
        self._ways.clear()
        self._hold_more()
        self._without_it = Backoff()
        self._without_it.failed()
        iterations = self.hold_on(self._plain, farthest)
        if iterations is not None and self.holds:
            more = self._without() if may_let_go else None
            if more is not None:
                self._let_go()
                return iterations + more
            self._say("nothing resists that")
        return iterations

    def _let_go(self) -> None:
        """Hold no motion any more."""
        self._viscosity.release()
        self.holds, self.share = False, 0.0

    def _say(self, why: str, remedy: str = PRESCRIBE) -> None:
        """Say once that motions are held."""
        if not self._said:
            self._said = True
            warn(
                f"{self._in_words()}: {why}. Viscous forces hold it from here on; {remedy}"
            )

    def _say_again(self) -> None:
        """Say what drives a held motion where that has grown much: the load may be beyond
        what contact and friction bear."""
        if self._told and self._drive > GROWN * self._told:
            self._said = False
            self._say_driven(self._drive)

    def _say_driven(self, drive: float) -> None:
        """Say once by what share of its forces a held motion is driven."""
        self._told = drive
        self._say(*self._driven(drive))

    def _driven(self, drive: float) -> tuple[str, str]:
        """Words on the share of forces that drives a held motion, and the remedy."""
        driven = f"{drive:.2g} of its forces drive that"
        # Friction does not resist what rolls
        slides = not any("turn" in way for ways in self._ways.values() for way in ways)
        if slides and any(one.friction is not None for one in self._contact.contacts):
            remedy = 'a limit load takes strategy="halve"'
            return f"{driven}, more than friction resists", remedy
        return f"{driven}, nothing resists it", PRESCRIBE

    def doubts(self) -> list[Finding]:
        """Tell of a motion that is held in the accepted state, and driven."""
        if not (self.holds and self._drive > 0.0):
            return []
        why, remedy = self._driven(self._drive)
        text = f"{self._in_words()}: {why}"
        return [
            Finding("", (), text, remedy.capitalize(), self._drive, about=("held",))
        ]

    def _hold_more(self) -> None:
        """Hold the motion of the loose body that has taken off."""
        assert self._free is not None
        (motions, change), problem = self._free, self._problem
        body = int(np.where(self._loose, motions, 0.0).argmax())
        self._viscosity.hold(body, change)
        name = problem.convergence.groups.names()[body]
        way = motion_in_words(problem, body, change)
        ways = self._ways.setdefault(name, [])
        if way not in ways:
            ways.append(way)

    def _in_words(self) -> str:
        """Words on the motions that are held, body by body."""
        each = self._ways.items()
        return " and ".join(f"{name} may {' or '.join(ways)}" for name, ways in each)

    def _under_hold(
        self, solve: Callable[[], int], farthest: float, scale: float = HOLDS
    ) -> int | None:
        """Solve with motions held, and with further ones that take off then; return None
        if that fails or moves a loose body too far."""
        for _ in range(MOST_HELD):
            begin = self._contact.state()
            with self._viscosity.acting(scale, holds=True):
                iterations = self._within(solve, farthest)
                if iterations is not None:
                    return iterations
                takes_off = self._takes_off()
                self._contact.restore(begin)
            if not takes_off:
                break
            self._hold_more()
            solve = self._plain
        self._no_hold.failed()
        return None

    def hold_on(
        self, solve: Callable[[], int], farthest: float | None = None
    ) -> int | None:
        """Solve one step as `solve` does with motions held, and from there without where
        more than noise drives them, or now and then, as something else may hold them;
        return None if that fails or moves a loose body too far. Collective."""
        self.holds, last = True, None
        iterations = self._under_hold(solve, farthest or self._limit)
        if iterations is not None:
            more, is_driven = self._relaxed()
            iterations += more
            if is_driven:
                last = self._within(self._plain, self._limit)
            else:
                if not self._without_it.rests():
                    last = self._without(RESISTED)
                    self._without_it.failed()
                if last is None:
                    self._say_again()
                    return iterations
        self._let_go()
        return None if iterations is None or last is None else iterations + last

    def _relaxed(self) -> tuple[int, bool]:
        """Solve on with motions held from where they are, as long as that halves what
        holds them: it resists what the load does, too. Return the iterations more, and
        whether the motions are driven. Collective."""
        iterations, last = 0, np.inf
        work, self.share = self._viscosity.measure()
        while (is_driven := self._is_driven()) and self.share <= GAIN * last:
            self.work, last = self.work + work, self.share
            more = self._under_hold(self._plain, self._limit, YIELDS)
            if more is None:
                break
            iterations += more
            work, self.share = self._viscosity.measure()
        self.work += work
        return iterations, is_driven

    def _is_driven(self) -> bool:
        """Whether more than noise, or than may be, drives the motion that is held. Where
        it is least driven, it may be held later on."""
        self._drive = 0.0
        if self.share <= IDLE:
            return False
        self._drive = drive = self._viscosity.drive()
        self._drives.note(drive)
        if drive <= self._may_drive:
            return False
        if drive <= DRIVEN and (self._rest is None or drive < self._rest[0]):
            self._rest = drive, self._contact.state(), self._viscosity.held()
        return True

    def give_in(self, share: float) -> int:
        """Hold a motion that has not ended where it was driven least; where more drives
        it, say which body nothing stops, and end the step."""
        problem, (motions, change) = self._problem, self._moving
        if self._rest is not None:
            drive, state, held = self._rest
            self._may_drive = DRIVEN
            self._contact.restore(state)
            self._viscosity.begin()
            self._viscosity.hold_as(held)
            iterations = self.hold_on(self._plain)
            if iterations is not None:
                self._say_driven(drive)
                return iterations
        self.is_lost = self.has_loose
        body = int(np.where(self._loose | ~self.is_lost, motions, 0.0).argmax())
        self.gave_up = (
            f"{problem.convergence.groups.names()[body]} goes on to "
            f"{motion_in_words(problem, body, change)} under viscous forces of "
            f"{share:.2g} of its forces, in {MOST_IDLE} tangents: nothing stops it"
            f"{self._may_be_borne(body)}"
        )
        raise ConvergenceError(self.gave_up)

    def _may_be_borne(self, body: int) -> str:
        """Say whether what a body touches may bear its load. Collective."""
        if not self._unborne(faced=False)[body]:
            return ". stabilize=True goes on for longer"
        return f", as contact{self._friction} does not bear its load"

    def unborne(self) -> list[str]:
        """Tell which loose bodies touch something, and have a load that nothing in reach
        can bear. Collective."""
        self._contact.update()
        names = self._problem.convergence.groups.names()
        return [
            f"contact{self._friction} does not bear the load of {names[body]}"
            for body in np.flatnonzero(self._loose & self._unborne(faced=True))
        ]

    def _unborne(self, faced: bool) -> Mask:
        """Whether each body touches something, and contact cannot bear its load while
        others stay, (bodies,). No body where hoops, ties, bonds or terms may bear it, and
        none on springs. Collective."""
        problem, contact, count = self._problem, self._contact, len(self._loose)
        found = touched(contact, count) & has_no_springs(problem)
        may_be_tied = any(
            one.tied is not None or one.bond is not None for one in contact.contacts
        )
        is_constrained = problem.constraints is not None
        if (
            may_be_tied
            or problem.terms
            or is_constrained
            or contact.system.axisymmetric
        ):
            return np.zeros(count, dtype=bool)
        loads, _ = resultants(problem, forces_on(problem))
        for body in np.flatnonzero(found):
            at = np.ones(count + 1, dtype=np.int32)
            at[body] = 0
            found[body] = not grips(contact, at, loads[[body]], faced)
        return np.asarray(found)

    @property
    def _friction(self) -> str:
        return ", with friction," if has_friction(self._contact) else ""

    def _motions(self) -> tuple[Array, float]:
        """Find the motions of all bodies and the largest of loose ones. Collective."""
        motions = self._viscosity.motions()
        return motions, float(motions[self._loose].max(initial=0.0))

    def _within(
        self, solve: Callable[[], int], farthest: float, begin: State | None = None
    ) -> int | None:
        """Solve; return None if that fails or moves a loose body too far from where the
        solve, or what is given, begins."""
        if begin is None:
            begin = self._contact.state()
            self._viscosity.begin()

        def near() -> int | None:
            iterations = solve()
            motions, loose = self._motions()
            self._approach.require(motions)
            return iterations if loose <= farthest else None

        iterations = attempt(near)
        if iterations is None:
            self._contact.restore(begin)
        return iterations
