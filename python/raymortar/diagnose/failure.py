"""Messages for a solve that did not converge: what was seen, and what to try."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

from petsc4py import PETSc

import numpy as np
from dolfinx.fem import FunctionSpace

from ..core import compat
from ..core.compat import Array
from ..core.contact import Contact
from ..core.discretization.ranks import sums_at
from ..core.errors import ContactError, ConvergenceError, SetUpError, format_point
from ..core.finding import placed
from ..core.gamma.probing import VolumePattern
from ..core.gamma.stiffness import contact_stiffness, of_sides
from ..core.interface.coefficients import Interfaces
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.point_results import CLOSED
from ..core.interface.slave_nodes import corners_between
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem
from .inverted import most_compressed
from .lost_contact import far_on_springs, loose_bodies, unheld
from .trouble import cycle_length

# Errors that another way, or a smaller step, may cure
FAILURES = (ConvergenceError, ContactError, PETSc.Error)

# Residuals at either end of a history that a message lists
_ENDS = 5
# Newton's method may yet converge if none of the last residuals is larger than so many
# times the one before it: number of residuals, and factor
_LAST, _JUMP = 10, 10.0

# Relative difference of residuals that a message calls the same
_ALIKE = 0.02
# Factor off the automatic coefficient up to which solves hardly suffer
FAR_OFF = 100.0
# Halvings from which on more do not help; stretch of cells that may be what stops a path
ENOUGH, PRESSED = 6, 0.6
# Ratio of moduli from which the softer side is the better slave (docs/surfaces)
STIFFER = 10.0


def attempt(solve: Callable[[], int | None]) -> int | None:
    """Solve; return the iterations, None where that fails and another way may do."""
    try:
        return solve()
    except FAILURES as failure:
        if isinstance(failure, SetUpError):
            raise
        return None


def iterations_of(solver: Any) -> int:
    """Solve once and return the iterations."""
    return int(solver.solve()[0])


@dataclass(frozen=True)
class InUse:
    """Use of a solve, so that messages give advice that fits."""

    steps: bool = False  # of `LoadSteps`
    automatic: bool = False  # `LoadSteps` tries other ways
    controlled: bool = False  # the load factor is an unknown
    may_be_viscous: bool = True  # viscous forces are possible and not yet used
    degree: int = 2  # the largest one of a multiplier
    led: Any = None  # weights of the owned dofs of u in the controlled displacement


def in_use_of(problem: CoupledProblem) -> InUse:
    """Describe the present use of a problem's solves."""
    multipliers = [one.multiplier for one in problem.contact.contacts]
    spaces = [m.function_space for m in multipliers if m is not None]
    degree = max((compat.element_info(W).degree for W in spaces), default=0)
    one_mesh = len(problem.contact.unknowns.displacements) == 1
    alone: dict[str, Any] = {"may_be_viscous": one_mesh, "degree": degree}
    return InUse(**(alone | part_of(problem)))


# Of problems whose solves are a part of a task: members of `InUse`
_TASKS: WeakKeyDictionary[CoupledProblem, dict[str, Any]] = WeakKeyDictionary()


def part_of(problem: CoupledProblem) -> dict[str, Any]:
    """Return what is known of the task that a problem's solves are a part of."""
    return _TASKS.get(problem, {})


@contextmanager
def as_part(problem: CoupledProblem, **task: Any) -> Iterator[None]:
    """Mark solves as part of a task, such as load steps."""
    before = part_of(problem)
    _TASKS[problem] = {**before, **task}
    try:
        yield
    finally:
        _TASKS[problem] = before


def describe(problem: CoupledProblem) -> str:
    """State of contact and residual history, for messages. Collective."""
    contact, in_use = problem.contact, in_use_of(problem)
    led = in_use.controlled
    free = loose_bodies(problem, in_use.led) if led else unheld(problem)
    rubbed = list[str]()
    sprung = far_on_springs(problem) if has_diverged(problem.history) else []
    if contact.layout.bodies and not sprung:
        free += contact.system.free_bodies.unheld()
        if not free and not in_use.steps:  # steps look at their start
            rubbed = contact.system.free_bodies.rubbed()
    softer = list[str]()
    for part in contact.parts:
        assert part.volume is not None
        softer += swaps(part.surfaces, part.volume, problem.bcs)
    excess = [
        one.offsets.excess for one in contact.contacts if one.offsets.excess is not None
    ]
    seen = problem.history, contact.statistics, free, problem.convergence.describe()
    corners = [corner_between(one, pressed=1) for one in contact.contacts]
    shared = [
        f"{corner[0]} share a corner at {format_point(corner[1])}, with one multiplier for "
        "both faces: give each its own Contact"
        for corner in corners
        if corner is not None
    ]
    odd = [*strange_gammas(problem), *rubbed, *shared]
    return describe_failure(*seen, softer, excess, odd, in_use, sprung)


def describe_failure(
    history: Sequence[float],
    statistics: Any,
    unheld: Sequence[str],
    imbalance: str,
    swaps: Sequence[str] = (),
    excess: Sequence[str] = (),
    odd: Sequence[str] = (),
    in_use: InUse = InUse(),
    sprung: Sequence[str] = (),
) -> str:
    """Describe the state of contact, the residuals, and what to try.

    `unheld`, `excess` and `odd` are sentences, on bodies that nothing holds, on
    interferences larger than the bodies are thick, and on odd coefficients and loads that
    friction alone resists. `swaps` are proposals for slaves that are too fine for their
    masters, `sprung` sentences on bodies that have moved far on springs alone.
    """
    text = f"{statistics}; residual history: {list_of_residuals(history)}"
    period = cycle_length(history, _ALIKE)
    if period:
        text += (
            f"; it repeats every {period} residuals: points open and close, or stick and "
            "slip, in turn"
        )
    diverged = has_diverged(history)
    if sprung:
        proposals = [
            "contact.adjust(within=...) where gaps are of the meshes",
            "a first step whose load moves them less than a facet",
            "stiffer springs",
        ]
    elif unheld:
        proposals = ways_to_hold(in_use)
    elif excess:
        proposals = ["a smaller interference"]
    elif not statistics.hits and not diverged:
        proposals = ["a larger reach in Search, if the bodies should touch"]
    else:
        # Steps have been halved already; `what_limits` says what helps
        smaller = ["LoadSteps, which takes smaller steps"] * (not in_use.steps)
        wanders = diverged or _has_jumps(history)
        against = _against_cycles(in_use) if period else smaller * wanders
        proposals = [*swaps, *against]
    text = "; ".join([text + imbalance, *unheld, *excess, *odd, *sprung])
    return text + (f". Try {one_of(proposals)}" if proposals else "")


def what_limits(problem: CoupledProblem, halvings: int) -> list[str]:
    """Say what limits a path whose last step has diverged after some halvings, from the
    state before that step. Collective."""
    if not has_diverged(problem.history) or cycle_length(problem.history, _ALIKE):
        return []
    if halvings < ENOUGH:
        return ["a larger max_halvings allows smaller steps"]
    stretch, place = most_compressed(problem.contact)
    if stretch < PRESSED:
        return [
            f"cells are pressed to {stretch:.2g} of their length before it, most around "
            f"the undeformed {place}: to go further, mesh the deformed bodies anew"
        ]
    return [
        "the load may have its maximum here: control= passes it where bodies give way, "
        "not where friction does"
    ]


def has_diverged(history: Sequence[float]) -> bool:
    """Whether residuals grew, or are no numbers any more."""
    norms = np.array(history)
    return len(norms) > 0 and bool(
        not np.isfinite(norms).all() or norms[-1] > 10.0 * max(norms[0], norms.min())
    )


def _has_jumps(history: Sequence[float]) -> bool:
    """Whether some of the last residuals are tenfold those before them."""
    last = np.array(history[-_LAST:])
    return bool((last[1:] > _JUMP * last[:-1]).any())


def list_of_residuals(history: Sequence[float]) -> str:
    """Norms as text; of a long history the first and the last ones."""
    texts = [f"{r:.3e}" for r in history]
    left_out = len(texts) - 2 * _ENDS
    if left_out > 0:
        texts[_ENDS:-_ENDS] = [f"({left_out} more)"]
    return ", ".join(texts)


def one_of(proposals: Sequence[str]) -> str:
    """Proposals as a list in words."""
    *others, last = proposals
    return f"{', '.join(others)}, or {last}" if others else last


def ways_to_hold(in_use: InUse) -> list[str]:
    """Proposals where nothing holds a body."""
    viscous = ["LoadSteps(stabilize=True)"] * in_use.may_be_viscous
    return ["a condition that holds it", "a start where it touches", *viscous]


def _against_cycles(in_use: InUse) -> list[str]:
    """Proposals where residuals repeat."""
    found = []
    if not in_use.automatic:
        steps = 'LoadSteps(strategy="auto")' if in_use.steps else "LoadSteps"
        found.append(f"{steps}, which tries other ways")
    found.append("a tenth of gamma (contact.set_gamma(0.1 * contact.gamma))")
    if in_use.degree > 1:
        found.append("AugmentedLagrangian(degree=1) where degree 2 meets friction")
    if not in_use.controlled:
        found.append('snes_linesearch_type "bt" in SNESSolver')
    return found


def automatic_gamma(problem: CoupledProblem, contact: Contact) -> float | None:
    """Find the automatic coefficient of a form as it is now, with its present
    constants; None if it has no stiffness. Traction per length. Collective."""
    layout, interfaces = contact.layout, contact.surfaces.interfaces
    try:
        volume = VolumePattern(problem.a, layout, contact.system.axisymmetric)
        tables = contact_stiffness(volume, interfaces, problem.bcs)
    except ContactError:  # on all ranks
        return None
    return contact.method.automatic_factor * min(float(t.min()) for t in tables)


def compared(contact: Contact, now: float) -> str:
    """A sentence on the coefficient in use beside the automatic one, `now`."""
    return (
        f"gamma = {contact.assembly.gamma_scale:.3g} is "
        f"{contact.assembly.gamma_scale / now:.3g} times the automatic gamma of the "
        f"present stiffness: contact.set_gamma({now:.3g})"
    )


def strange_gammas(problem: CoupledProblem) -> list[str]:
    """Sentences on coefficients far off the automatic ones, with the stiffness of the
    accepted displacement: that of an iterate may be any. Collective."""
    contact, found = problem.contact, []
    with contact.unknowns.lent() as accepted:
        accepted[contact.unknowns.u_local] = contact.states.u_old
        contact.unknowns.set_values(accepted)
        for one in contact.contacts:
            now = automatic_gamma(problem, one)
            if now and not 1.0 / FAR_OFF <= one.assembly.gamma_scale / now <= FAR_OFF:
                found.append(compared(one, now))
    return found


def swaps(
    surfaces: ContactSurfaces, volume: VolumePattern, bcs: Sequence[Any]
) -> list[str]:
    """Advice on slaves of one contact that are much stiffer than their masters, or of a
    higher degree. Collective."""
    if surfaces.multiplier is None:
        return []
    degree = compat.element_info(surfaces.multiplier.function_space).degree
    lower = "AugmentedLagrangian(degree=1), or " * (degree > 1)
    ratios = stiffness_ratios(volume, surfaces.interfaces, bcs)
    found = []
    for zone, ratio in zip(surfaces.zones, ratios):
        if zone.facets.bodies:
            continue  # a rigid tool cannot be the slave
        both = zone.facets.slave_surface, zone.facets.master_surface
        p, q = (side.displacement_degree for side in both)
        most = float(ratio.max(initial=0.0))
        reasons = [f"has degree {p} and its master degree {q}"] * (p > q)
        if most >= STIFFER:
            reasons.append(f"is {most:.2g} times as stiff as its master")
        if reasons:
            found.append(
                f"{lower}the other side as the slave ("
                f"{zone.facets.spoken} {' and '.join(reasons)})"
            )
    return found


# Force beside a corner, of the larger one on its other face, that is worth a word
WORTH = 0.05


def corner_between(one: Contact, pressed: int) -> tuple[str, tuple[float, ...]] | None:
    """Name a corner between slave surfaces of which one or two press there.
    Collective."""
    zones = one.zones
    if one.multiplier is None or one.tied is not None or len(zones) == 1:
        return None
    W, comm = one.multiplier.function_space, one.layout.comm
    *_, second, first = np.sort([_forces(zone, W) for zone in zones], axis=0)
    enough = first > 0.0 if pressed == 1 else (second > 0.0) & (second > WORTH * first)
    if not comm.allreduce(int(enough.any())):
        return None
    at = np.flatnonzero(enough & corners_between(zones, W))
    meet = [np.isin(at, zone.multiplier_nodes).tolist() for zone in zones]
    X = W.tabulate_dof_coordinates()[at, : W.mesh.geometry.dim].tolist()
    # A rank may know a corner by some of its faces alone
    found = sorted(sum(comm.allgather(list(zip(X, zip(*meet)))), []))
    if not found:
        return None
    place = found[0][0]
    faces = np.any([meets for x, meets in found if x == place], axis=0)
    named = " and ".join(zone.facets.spoken for zone, on in zip(zones, faces) if on)
    return named, placed(place, [x for x, _ in found])


def _forces(zone: ZoneData, W: FunctionSpace) -> Array:
    """Sum the forces on the facets around each block dof of the multiplier. Collective."""
    points = zone.points()
    closed = points["status"] >= CLOSED
    size = np.abs(points["weight"] * points["pressure"])[closed]
    table = zone.multiplier_table
    force = np.bincount(points["slave"][closed], size, len(table))
    return sums_at(W.dofmap.index_map, 1, (table, force[:, None, None]))[:, 0]


def stiffness_ratios(
    volume: VolumePattern, interfaces: Interfaces, bcs: Sequence[Any] = ()
) -> list[Array]:
    """Modulus of the slave's side of pairs of bodies over that of the master's.

    A table for each zone; 0 where one side cannot move or has no stiffness. Collective.
    """

    def pair(slave: Array, master: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = slave[:, 0] * slave[:, 2] / (master[:, 0] * master[:, 2])
        moves = (slave[:, 1] > 0.0) & (master[:, 1] > 0.0)
        return np.where(moves & np.isfinite(ratio), ratio, 0.0)

    return interfaces.tables(of_sides(volume, interfaces, bcs), pair)
