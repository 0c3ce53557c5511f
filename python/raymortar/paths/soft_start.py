"""Solves with softened tangents, smaller coefficients, shorter steps."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cached_property, partial
from typing import Any

from dolfinx.fem import Function

from ..bending.coefficients import BENDS, softer
from ..core.errors import ContactWarning, SetUpError
from ..core.solvers.newton import SNESSolver
from ..diagnose.failure import FAILURES, iterations_of
from ..solvers.correcting import LINE_SEARCH, takes_full_steps
from ..solvers.settings import temporarily
from ..viscous.budget import Backoff
from .soft_stick import SoftStick

# Iterations of a solve above which another coefficient is worth its while, and number of
# such steps in a row
MANY, IN_A_ROW = 8, 2

# Relative tolerance of a first solve, whose solution is a start
ROUGH = 1e-3

# Smaller coefficient, over the one in use. It hardly changes the solution, but with it
# fewer points open and close during a solve (docs/measured/robustness_paths.md)
SMALL = 0.1

# Largest number of times that a path goes on with a tenth of gamma
MOST_KEPT = 2

# Factor for the number of iterations where shorter steps need more, as those of a line
# search, or where halving the load step would not save them
MORE_ITERATIONS = 2

# Coefficient in use, and the contact's own
Gammas = tuple[Any, Any]


class SoftStart:
    """Solves with the coefficient of what surfaces yield.

    Where bodies bend, the coefficient (5.2) of a law at points is up to 1e3 times that
    of (5.16), and hundreds of points change their status in a solve. With (5.16) few
    points do. A solve starts from a rough solution with it, goes on with the one in use,
    and only the second solution is kept. Where the second solve fails or takes long, an
    automatic coefficient gives way to (5.16) for good. Where bodies do not bend, there is
    no soft start. Collective.
    """

    def __init__(self, problem: Any) -> None:
        self._softer = [
            (one, gamma)
            for one, gamma in _that_bend(problem)
            if not one.assembly.gamma_is_soft
        ]

    def __bool__(self) -> bool:
        return bool(self._softer)

    @property
    def may_stay(self) -> bool:
        """Whether a soft coefficient may take the place of an automatic one in use."""
        return any(map(_is_automatic, self._softer))

    def stay(self) -> list[tuple[Any, Any]]:
        """Put soft coefficients in the place of automatic ones; return what `undo`
        takes. Collective."""
        changed = list(filter(_is_automatic, self._softer))
        _soften(changed)
        self._softer = [pair for pair in self._softer if pair not in changed]
        return changed

    def undo(self, changed: list[tuple[Any, Any]]) -> None:
        """Take back the automatic coefficients. Collective."""
        for one, _ in changed:
            one.set_gamma(one.assembly.automatic_gamma)
        self._softer += changed

    def solve(
        self,
        solver: Any,
        softening: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> int:
        """Solve roughly from the present state, within what `softening` makes; return
        the iterations. Collective."""
        with _given_back([one for one, _ in self._softer]):
            _soften(self._softer)
            with softening():
                return solve_roughly(solver)


class PlainSolver:
    """Solves steps by the solver as it was given, with softened tangents, and from a soft
    start where bodies bend. Collective."""

    def __init__(self, solver: Any, may_start_softly: bool) -> None:
        self._solver, self._may_start = solver, may_start_softly
        self._convergence = solver.problem.convergence
        # None: not yet asked for. It is left out for a while after failures
        self._start: SoftStart | None = None
        self._starts_softly, self._without_it = False, Backoff()
        # Whether this step has started softly, slow steps in a row, and whether the soft
        # coefficients stay from the next step on
        self._has_started, self._slow, self._stays = False, 0, False

    @cached_property
    def _soft_stick(self) -> SoftStick:
        return SoftStick(self._solver.problem)

    def begin_step(self) -> None:
        """Begin a step at the accepted state."""
        if self._stays and self._start is not None:
            self._start.stay()
        self._starts_softly = bool(self._start) and not self._without_it.rests()
        self._has_started = self._stays = False

    def learn(self, iterations: int) -> None:
        """Find a soft start after slow steps in a row, at a state of the path; a step of
        twice as many iterations counts for two."""
        slow = (iterations - 1) // MANY
        self._slow = self._slow + slow if slow else 0
        if self._slow >= IN_A_ROW:
            self._find_start()

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        found = [self._start is not None, self._slow, self._stays]
        return [*map(float, found), *self._without_it.remember()]

    def recall(self, numbers: Sequence[float]) -> None:
        """Go on from numbers. Collective."""
        if numbers[0]:
            self._find_start()
        self._slow, self._stays = int(numbers[1]), numbers[2] > 0.0
        self._without_it.recall(numbers[3:])

    def may_start_softly(self) -> bool:
        """Find a soft start, once, at a state of the path; return whether there is one
        that this step has not tried."""
        return self._find_start() and not self._has_started

    def _find_start(self) -> bool:
        if self._start is None and self._may_start:
            self._start = SoftStart(self._solver.problem)
        return bool(self._start)

    def start_softly(self) -> int:
        """Solve from a soft start."""
        self._starts_softly = True
        return self.solve(opens=True)

    def solve(self, opens: bool = False) -> int:
        """Solve once, from a soft start if it is its turn; nodes without a traction
        soften tangents too, if it `opens`. Return the iterations."""
        start = self._start
        if not (start and self._starts_softly):
            return self._softened(opens)
        self._has_started = True
        try:
            with self._patient(opens and start.may_stay):
                acting = partial(self._soft_stick.acting, opens)
                iterations = start.solve(self._solver, acting)
            iterations += self._from_rough(start, opens)
        except FAILURES:
            self._starts_softly = False
            self._without_it.failed()
            raise
        self._without_it.reset()
        return iterations

    def _from_rough(self, start: SoftStart, opens: bool) -> int:
        """Solve from a rough solution; where that fails, with soft coefficients that
        stay, and where it takes long, they stay from the next step on."""
        contact = self._solver.problem.contact
        rough = contact.state()
        try:
            iterations = self._softened(opens)
            self._stays = iterations > MANY and start.may_stay
            return iterations
        except FAILURES as failure:
            if isinstance(failure, SetUpError) or not start.may_stay:
                raise
        changed = start.stay()
        contact.restore(rough)
        try:
            return self._softened(opens)
        except FAILURES:
            start.undo(changed)
            raise

    def _softened(self, opens: bool) -> int:
        """Solve once with softened tangents."""
        parts = self._solver.problem.contact.parts
        # Fronts of bodies that bend take long, and no other way does any better
        is_soft = opens and any(part.gamma_is_soft for part in parts)
        with self._patient(is_soft), self._soft_stick.acting(opens):
            return iterations_of(self._solver)

    def _patient(self, is_patient: bool) -> AbstractContextManager[None]:
        """Let solves go on until they are hopeless, if asked."""
        patient = self._convergence.patient or is_patient
        return temporarily(self._convergence, patient=patient)


def propose_nodes(problem: Any) -> list[str]:
    """Sentences on contacts that a law at nodes suits better, at a state that is no
    failed iterate. Collective."""
    try:
        contacts = _that_bend(problem)
    except FAILURES:  # on all ranks: the failure that is told of counts
        return []
    return [
        f"{' and '.join(zone.facets.spoken for zone in one.zones)} bends under contact, "
        "or its master does, which takes many iterations with the law at points: try "
        "AugmentedLagrangian(condition='nodes'), whose gamma accounts for bending"
        for one, _ in contacts
    ]


def _that_bend(problem: Any) -> list[tuple[Any, Any]]:
    """Contacts with a law at points and a coefficient far above what their surfaces
    yield, or one that has stayed soft, and soft coefficients of them. Collective."""
    contact = problem.contact
    return [
        (one, gamma)
        for one, gamma in zip(contact.contacts, softer(contact.system, problem.bcs))
        if gamma is not None
        and (
            one.assembly.gamma_is_soft
            or _largest(gamma) < BENDS * one.assembly.gamma_scale
        )
    ]


def _is_automatic(pair: tuple[Any, Any]) -> bool:
    """Whether a contact has its automatic coefficient: no other is replaced."""
    one, _ = pair
    return one.gamma is not None and one.gamma is one.assembly.automatic_gamma


def _soften(contacts: list[tuple[Any, Any]]) -> None:
    """Set soft coefficients. Collective."""
    for one, gamma in contacts:
        one.set_gamma(gamma)
        one.assembly.soft_gamma = one.gamma


def solve_roughly(solver: Any) -> int:
    """Solve for a state to start from; return the iterations. Collective."""
    rtol, atol = solver.tolerances
    # The state is not kept, and warnings of it are of no interest
    with temporarily(solver, tolerances=(max(ROUGH, rtol), atol)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            return iterations_of(solver)


def solve_by_small_gamma(solver: Any, kept: list[list[Gammas]] | None = None) -> int:
    """Solve with a tenth of gamma, then with gamma from there. Collective.

    Where that fails, the tenth stays for contacts with a multiplier, if there is a list
    for what was given: both solutions meet the contact conditions in the mean.
    """
    contact = solver.problem.contact
    with _given_back(contact.contacts) as given:
        _lend_tenths(contact.contacts)
        iterations = solve_roughly(solver)
    reached = contact.state()
    try:
        return iterations + iterations_of(solver)
    except FAILURES as failure:
        if isinstance(failure, SetUpError) or not _led(solver.problem):
            raise
        if kept is None or len(kept) == MOST_KEPT:
            raise
    contact.restore(reached)
    lend_tenths(solver.problem)
    try:
        iterations += iterations_of(solver)
    except FAILURES:
        set_gammas(contact.contacts, given)
        raise
    kept.append(given)
    return iterations


def _led(problem: Any) -> list[Any]:
    """Contacts with a multiplier."""
    return [one for one in problem.contact.contacts if one.multiplier is not None]


def lend_tenths(problem: Any) -> list[Gammas]:
    """Lend contacts with a multiplier a tenth of their coefficients; return what
    `set_gammas` takes to undo it. Collective."""
    given = _gammas(problem.contact.contacts)
    _lend_tenths(_led(problem))
    return given


def _gammas(contacts: Sequence[Any]) -> list[Gammas]:
    return [(one.gamma, one.assembly.own_gamma) for one in contacts]


@contextmanager
def _given_back(contacts: Sequence[Any]) -> Iterator[list[Gammas]]:
    """Give contacts their coefficients back in the end. Collective."""
    given = _gammas(contacts)
    try:
        yield given
    finally:
        set_gammas(contacts, given)


def set_gammas(contacts: Sequence[Any], gammas: Sequence[Gammas]) -> None:
    """Give each contact the coefficient in use and its own. Collective."""
    for contact, (gamma, own) in zip(contacts, gammas):
        contact.assembly.set_gamma(gamma, own)


def _lend_tenths(contacts: Sequence[Any]) -> None:
    """Lend each contact a tenth of the coefficient in use. Collective."""
    tenths = [(_tenth(gamma), own) for gamma, own in _gammas(contacts)]
    set_gammas(contacts, tenths)


def _tenth(gamma: Any) -> Any:
    """Make a coefficient, a number or a field, of a tenth of the size."""
    if not isinstance(gamma, Function):
        return SMALL * gamma
    small = Function(gamma.function_space)
    small.x.array[:] = SMALL * gamma.x.array
    return small


def _largest(gamma: Any) -> float:
    """Largest value of a number or of coefficients by pair."""
    tables = getattr(gamma, "tables", None)
    return float(gamma) if tables is None else max(float(t.max()) for t in tables)


def with_line_search(solver: Any) -> SNESSolver | None:
    """SNES with line search, on the matrix and with the linear solver of another one.

    None if the given solver already has a line search, or is of another kind.
    Collective.
    """
    options = dict(solver.options.given) if hasattr(solver, "options") else {}
    # A tolerance of the user's is among the settings that are taken. The default was
    # the rounding error of all bodies when the solver was made: asked for as a
    # tolerance, it would be one that the softest body is not solved to
    options.pop("snes_atol", None)
    if not takes_full_steps(solver):
        return None
    other = SNESSolver(solver.problem, {**options, LINE_SEARCH: "l2"}, matrix=solver.A)
    rtol, most = solver.tolerances[0], MORE_ITERATIONS * solver.max_it
    other.snes.setTolerances(rtol=rtol, max_it=most, atol=solver.force_tolerance)
    return other
