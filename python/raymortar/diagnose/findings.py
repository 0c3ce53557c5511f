"""Find what is doubtful about a converged state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..compat import Array, Mask
from ..contact import Contact
from ..errors import format_point
from ..interaction import Interaction
from ..interface.pairs import in_other_order
from ..interface.point_results import CLOSED, Status
from ..interface.slave_nodes import are_inside_flats
from ..interface.stiffness import (
    NO_PRESSURE,
    mean_facet_size,
    rounding_force,
    stiffness_ratios,
)
from ..interface.zone_data import ZoneData
from ..options.methods import AugmentedLagrangian, Penalty
from ..problem import CoupledProblem
from ..rigid.body import Body
from .failure import automatic_gamma, compared, corner_between
from .few_facets import FewFacets
from .inverted import inverted_cells
from .narrow import jump
from .rigid_slaves import distance_ratio

# Depth of a pressed point, over the size of its slave facet. Multipliers close gaps in
# the mean: a point keeps a few hundredths where facets resolve the surfaces
DEEP = 0.25
# Depth allowed to a penalty whose coefficient is below the automatic one by a factor:
# less would not make it much less deep
SOFT, SOFTER = 0.1, 2.0
UNRESOLVED = (
    ": the facets do not resolve what touches there (a face beside a sharp corner, a "
    "step): refine it, or leave it out of the slave's tag"
)
SHARED = (
    ": one multiplier is not the traction on two faces, and forces are off by up to a few "
    "percent. Give each slave surface a Contact of its own"
)
TOO_FAR = (
    ": no material can be pressed so far, but linear elasticity does not resist it. Is a "
    "motion in another unit than the mesh? A law for large strains, as neo-Hookean, and "
    "smaller steps show how far it can go"
)
# Tension of a node, of the largest pressure
TENSION = 0.05
# The other order of sides lessens it where the slave's nodes are closer than its master's
# by this factor, and its modulus is more than this part of the master's
FINER, NOT_SOFTER = 1.2, 0.7
# Degrees by which a force may be turned without a word
TILT = 2.0
# Radians that a body may turn in a step without a word: 2.7 % of the slip around it
TURN = 0.2
# Force of a pair that is not worth a word, of the largest pair's
SMALL_FORCE = 0.01


@dataclass(frozen=True)
class Finding:
    """A doubt about a state, the same on all ranks.

    `about` is the same for the same doubt about another state, and `size` says how bad
    it is. `text` names pair or body, place and value. `remedy` gives the end of the text,
    once it is to be warned of, or None if there is no doubt. A doubt with a `force`
    counts where this is the largest of a path, and is warned of at its end: bodies that
    begin to touch do so with one facet. Collective.
    """

    about: tuple[Any, ...]
    size: float
    text: str
    remedy: Callable[[], str | None] = str
    force: float | None = None


def findings(problem: CoupledProblem) -> Iterator[Finding]:
    """Yield all doubts about a converged state. Collective."""
    contact = problem.contact
    cells, place = inverted_cells(contact)
    if cells:
        text = (
            f"converged with {cells} cell(s) turned inside out, the worst around the "
        )
        yield Finding(("inverted",), cells, f"{text}undeformed {place}{TOO_FAR}")
    depth, text = _worst(contact, map(_unseen, contact.zones))
    if depth > 0.0:
        yield Finding(("unseen",), depth, text)
    share, text = _worst(contact, map(_pressed, _zones(contact)))
    if share > DEEP:
        yield Finding(("deep",), share, text, lambda: UNRESOLVED)
    for k, one in enumerate(contact.contacts):
        if one.tied is not None:
            continue
        if isinstance(one.method, Penalty):
            share, text = _worst(contact, map(_pressed, one.zones))
            if share > SOFT:
                yield Finding(("soft", k), share, text, partial(_stiffer, problem, one))
        corner = corner_between(one, pressed=2)
        if corner is not None:
            yield Finding(("corner", k), 1.0, f"{corner}, and both press there{SHARED}")
        for number, zone in enumerate(one.zones):
            points, scalar = zone.points(), contact.parts[k].surfaces.scalar
            at_points = one.multiplier is not None and not zone.has_law_at_nodes
            angle, text = jump(zone, points, scalar, at_points)
            if angle > 0.0:
                yield Finding(("jump", id(zone)), angle, text)
            if one.multiplier is None:
                continue
            few = None
            if at_points and not zone.depends_on_gamma:
                few = FewFacets(zone, points)
                told = partial(few.told, problem)
                yield Finding(("few", id(zone)), 0.0, "", told, few.force)
            if one.friction is None and not zone.is_pulled:
                yield from _tension(problem, one, number, few)
    yield from _tilts(contact)
    yield from _turns(contact)


def deepest_on_tools(contact: Interaction) -> tuple[float, str]:
    """Find the deepest pressed point of slaves with multipliers on rigid tools, over its
    facet's size. Collective."""
    on_tools = (zone for zone in _zones(contact) if zone.facets.bodies)
    return _worst(contact, map(_pressed, on_tools))


def _worst(
    contact: Interaction, found: Iterable[tuple[float, str]]
) -> tuple[float, str]:
    """The largest number over zones and ranks, and its sentence. Collective."""
    mine = max(found, default=(0.0, ""))
    return max(contact.layout.comm.allgather(mine))


def _zones(contact: Interaction) -> list[ZoneData]:
    """Slave surfaces with the augmented Lagrangian method."""
    contacts = (
        c for c in contact.contacts if isinstance(c.method, AugmentedLagrangian)
    )
    return [zone for one in contacts for zone in one.zones]


def _depth(zone: ZoneData, points: dict[str, Array], q: int, share: str = "") -> str:
    """Say how deep a point is in the master, and where."""
    return (
        f"converged with a point of {zone.facets.spoken} "
        f"{-points['gap'][q]:.3e} deep in the master, {share}at "
        f"{format_point(points['x'][q], points['x'])}"
    )


def _pressed(zone: ZoneData) -> tuple[float, str]:
    """Find the largest penetration of a pressed point over its facet's size."""
    points, surface = zone.seen_points(), zone.facets.slave_surface
    pressed = np.flatnonzero((points["pressure"] > 0.0) & (points["gap"] < 0.0))
    if not len(pressed):
        return 0.0, ""
    nodes = surface.X[surface.facet_nodes[points["slave"][pressed]]]
    share = -points["gap"][pressed] / np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    k = int(np.argmax(share))
    text = _depth(zone, points, pressed[k], f"{share[k]:.2g} of its facet, ")
    return float(share[k]), text


def _unseen(zone: ZoneData) -> tuple[float, str]:
    """Find the depth of the deepest point that is too deep for contact."""
    penetrating, points = zone.cpp.penetrating_points(), zone.points()
    if not len(penetrating):
        return 0.0, ""
    q = penetrating[np.argmin(points["gap"][penetrating])]
    remedy = "where it is not seen: take smaller steps, or a larger depth in Search"
    return float(-points["gap"][q]), f"{_depth(zone, points, q)}, {remedy}"


def _stiffer(problem: CoupledProblem, one: Contact) -> str | None:
    """Propose the automatic coefficient of a penalty that is softer. Collective."""
    now = automatic_gamma(problem, one)
    is_soft = now is not None and SOFTER * one.assembly.gamma_scale < now
    return f": {compared(one, now)}" if now is not None and is_soft else None


def _tension(
    problem: CoupledProblem, contact: Contact, number: int, few: FewFacets | None
) -> Iterator[Finding]:
    """Compare the largest tension of a surface's nodes with its pressure. Collective.

    Forces are not said to be right where few facets make them depend on gamma.
    """
    zone = contact.zones[number]
    comm, nodes = contact.layout.comm, zone.multiplier_nodes
    assert contact.multiplier is not None
    normal = contact.multiplier.x.array
    if contact.assembly.layout.components > 1:
        normal = -contact.pressure().x.array
    own, mine = normal[nodes], (0.0, "")
    if own.max(initial=0.0) > 0.0:
        k = int(np.argmax(own))
        X = contact.surfaces.scalar.tabulate_dof_coordinates()
        X = X[nodes, : zone.facets.slave_surface.gdim]
        mine = float(own[k]), format_point(X[k], X)
    tension, place = max(comm.allgather(mine))
    pressure = max(comm.allgather(-own.min(initial=0.0)))
    if tension <= TENSION * pressure:
        return
    modulus = contact.assembly.gamma_scale * mean_facet_size([zone])
    if pressure <= NO_PRESSURE * modulus:
        return
    zone.is_pulled = True
    depends = few is not None and few.told(problem) is not None
    depends = depends or zone.depends_on_gamma
    forces = "" if depends else ". Forces are right to the square of the facets' size"
    pairs = [str(pair) for pair in contact.pairs if pair.surface == number]
    yield Finding(
        ("tension", id(zone)),
        tension / pressure,
        f"converged with tension of {tension / pressure:.2g} of the largest pressure "
        f"between {', '.join(pairs)}, at the undeformed {place}: the multiplier swings "
        f"about zero beside contact that few facets carry{forces}; ",
        partial(_against_tension, problem, contact, number),
    )


def _against_tension(problem: CoupledProblem, contact: Contact, number: int) -> str:
    """Say what lessens tension: the other order of sides where the slave is the finer one
    and not the softer. Collective."""
    surfaces, volume = contact.assembly.surfaces, contact.assembly.volume
    zone = contact.zones[number]
    refined = "refine the slave there if tractions count"
    if zone.facets.bodies or volume is None:
        return refined
    closer = distance_ratio(zone, surfaces)
    stiffer = stiffness_ratios(volume, surfaces.interfaces, problem.bcs)[number].max()
    if closer < FINER or stiffer < NOT_SOFTER:
        return refined
    own = in_other_order(pair for pair in contact.pairs if pair.surface == number)
    return (
        f"{own} lessens that, as the slave has nodes {closer:.2g} times as close as its "
        f"master's, and is {stiffer:.2g} times as stiff"
    )


def _tilts(contact: Interaction) -> Iterator[Finding]:
    """Find pairs whose slave facets are tilted against the master, and turn the force,
    where the slave's normal is that of the law [theory (2.14)]. Collective.

    Slave facets inside a flat have the right normal, however the master stands on them.
    """
    zones = [(part, zone) for part in contact.parts for zone in part.zones]
    found = [
        _tilt(zone, are_inside_flats(zone, part.surfaces.scalar))
        for part, zone in zones
    ]
    least = SMALL_FORCE * max(force.max(initial=0.0) for force, _ in found)
    for number, ((part, zone), (force, angle)) in enumerate(zip(zones, found)):
        for k in np.flatnonzero((angle > TILT) & (force > least)):
            if force[k] <= rounding_force(zone, part.gamma_scale):
                continue
            master = zone.facets.master_tags[k]
            is_tool = isinstance(master, Body)
            name = master.name if is_tool else zone.facets.spoken_masters[k]
            # Tools have no facets to be a slave by
            swap = "" if is_tool else "make that side the slave, "
            remedy = (
                "give Contact(frame='master') where the master is flat or smooth, "
                f"{swap}or round the slave's corner if one presses there"
            )
            yield Finding(
                ("tilt", number, k),
                1.0,
                f"the facets of {zone.facets.spoken} that press on {name} "
                f"are tilted against it by {angle[k]:.2g} degrees in the mean, and the "
                f"force is turned by as much: {remedy}",
            )


def _tilt(zone: ZoneData, is_flat: Mask) -> tuple[Array, Array]:
    """Sum of the pressures' forces on each master, and the angle by which the slave's
    normals turn them against the master's, (masters,), but for slave facets that are
    flat. Degrees. Collective."""
    points = zone.points()
    n, n_m = points["normal"], points["master_normal"]
    counts = (points["status"] >= CLOSED) & (points["contact_normal"] == n).all(axis=1)
    counts &= n_m.any(axis=1) & ~is_flat[points["slave"]]  # ties have none
    force = np.abs(points["weight"] * points["pressure"])[counts]
    values = force * np.vstack([np.ones_like(force), n[counts].T, -n_m[counts].T])
    sums = np.zeros((zone.master_tags.count, len(values)))
    np.add.at(sums, zone.masters_of(points)[counts], values.T)
    sums = zone.comm.allreduce(sums)
    size, mine, right = np.split(sums, [1, 1 + n.shape[1]], axis=1)
    tiny = np.finfo(float).tiny
    along = right / np.maximum(np.linalg.norm(right, axis=1, keepdims=True), tiny)
    aside = mine - np.einsum("mi,mi->m", mine, along)[:, None] * along
    sine = np.linalg.norm(aside / np.maximum(size, tiny), axis=1)
    return size[:, 0], np.rad2deg(np.arcsin(np.minimum(sine, 1.0)))


def _turns(contact: Interaction) -> Iterator[Finding]:
    """Find rigid bodies that turn by much in this step about an axis along the surface
    that slides on them: slip is projected there and back [theory (2.9)]. Collective."""
    for number, zone in enumerate(contact.zones):
        points = zone.points()
        slips = points["status"] == Status.SLIP
        force = np.abs(points["weight"] * points["pressure"])
        for k, body in enumerate(zone.facets.bodies):
            mine = slips & (points["master"] == k)
            turn, n = body.cpp.seen[3:6] - zone.motions.old[k][3:6], points["normal"]
            n = np.pad(n[mine], ((0, 0), (0, 3 - n.shape[1])))
            across = np.linalg.norm(turn - n * (n @ turn)[:, None], axis=1)
            sums = np.array([force[mine] @ across, force[mine].sum()])
            work, size = contact.layout.comm.allreduce(sums)
            angle = work / size if size > 0.0 else 0.0
            if angle > TURN:
                short = 1.0 - np.sin(2.0 * angle) / (2.0 * angle)
                yield Finding(
                    ("turn", number, k),
                    angle,
                    f"the rigid {body.name} turns by {angle:.2g} rad in this step below "
                    f"{zone.facets.spoken}, which slides around it: slip "
                    f"and the work of friction are about {short:.0%} too small, where "
                    "tractions are right. Take steps of 0.1 rad",
                )
