"""Find what is doubtful about a converged state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask
from ..core.contact import Contact
from ..core.finding import Finding, placed
from ..core.interaction import Interaction
from ..core.interface.pairs import in_other_order
from ..core.interface.point_results import CLOSED, Status
from ..core.interface.zone_data import ZoneData, mean_facet_size
from ..core.options.methods import AugmentedLagrangian, Penalty
from ..core.problem import CoupledProblem
from ..core.target import Target
from ..results.tractions import seen_points
from ..setup.rigid_slaves import distance_ratio
from ..setup.straight_facets import ALLOWED, CURVED, are_inside_flats
from .failure import automatic_gamma, compared, corner_between, stiffness_ratios
from .few_facets import NO_PRESSURE, FewFacets, approach, rounding_force
from .inverted import inverted_cells
from .lost_contact import passed_points
from .narrow import forces_on_facets, jump
from .sliding import sliding_bodies

# Depth of a pressed point, over the size of its slave facet. Multipliers close gaps in
# the mean: a point keeps a few hundredths where facets resolve the surfaces
DEEP = 0.25
# Depth allowed to a penalty whose coefficient is below the automatic one by a factor:
# less would not make it much less deep
SOFT, SOFTER = 0.1, 2.0
REFINE = "Refine the facets there, or leave a face beside a sharp corner out of the slave's tag"
# Tension of a node, of the largest pressure
TENSION = 0.05
# The other order of sides lessens it where the slave's nodes are closer than its master's
# by this factor, and its modulus is more than this part of the master's
FINER, NOT_SOFTER = 1.2, 0.7
# Degrees by which a force may be turned without a word, and from which on its part along
# the surface is off by 10 % of the force
TILT, TILTED = 2.0, 5.74
# Parts of the slip around a body that may be missing without a word and without a warning,
# and the terms of the arc's series in theory (2.17)
SHORT, TOO_SHORT, ARC_TERMS = 0.027, 0.1, 8
# Force of a pair that is not worth a word, of the largest pair's
SMALL_FORCE = 0.01

# A size with what `Finding` says of it: pair, place and text
Worst = tuple[float, str, tuple[float, ...], str]
NOTHING: Worst = (0.0, "", (), "")


def all_of_them(about: object, force: float) -> bool:
    """Look at findings of every force."""
    return True


def findings(
    problem: CoupledProblem, counts: Callable[[object, float], bool] = all_of_them
) -> Iterator[Finding]:
    """Yield all doubts about a converged state. Collective.

    Doubts about contact of few facets, which take time, are looked at where `counts`
    says that their force does.
    """
    contact = problem.contact
    yield from inverted_cells(contact)
    names = pair_names(contact)
    depth, pair, place, text = _worst(
        contact, (_unseen(z, contact.layout.comm, names[id(z)]) for z in contact.zones)
    )
    if depth > 0.0:
        remedy = "Take smaller steps, or a larger depth in Search"
        yield Finding(pair, place, text, remedy, depth, about=("unseen",))
    share, pair, place, text = _worst(
        contact, (_pressed(z, names[id(z)]) for z in _zones(contact))
    )
    if share > DEEP:
        yield Finding(pair, place, text, REFINE, share, about=("deep",))
    for k, one in enumerate(contact.contacts):
        if one.tied is not None:
            continue
        if isinstance(one.method, Penalty):
            share, pair, place, text = _worst(
                contact, (_pressed(z, names[id(z)]) for z in one.zones)
            )
            stiffer = _stiffer(problem, one) if share > SOFT else None
            if stiffer is not None:
                yield Finding(pair, place, text, stiffer, share, about=("soft", k))
        yield from _corner(one, k)
        for number, zone in enumerate(one.zones):
            points, scalar = zone.points(), contact.parts[k].surfaces.scalar
            at_points = one.multiplier is not None and not zone.has_law_at_nodes
            angle, place, text, remedy = jump(zone, points, scalar)
            if angle > 0.0:
                pair, about = names[id(zone)], ("jump", id(zone))
                yield Finding(pair, place, text, remedy, angle, about=about)
            yield from _straight(problem, zone, points, names[id(zone)], counts)
            if one.multiplier is None:
                continue
            if at_points:
                few, about = FewFacets(zone, points), ("few", id(zone))
                if counts(about, few.force):
                    yield from few.told(problem, names[id(zone)], about)
            if one.friction is None:
                yield from _tension(problem, one, number, names[id(zone)])
    yield from _tilts(contact, names)
    yield from _turns(contact, names)
    yield from sliding_bodies(problem)


def pair_names(contact: Interaction) -> dict[int, str]:
    """Names of the pairs of each slave surface, by the identity of its zone."""
    return {
        id(zone): ", ".join(str(pair) for pair in one.pairs if pair.surface == number)
        for one in contact.contacts
        for number, zone in enumerate(one.zones)
    }


def deepest_on_tools(contact: Interaction) -> tuple[float, str]:
    """Find the deepest pressed point of slaves with multipliers on rigid tools, over its
    facet's size, and a sentence on it. Collective."""
    on_tools = [z for z in _zones(contact) if z.facets.bodies and not z.tied]
    names = pair_names(contact) if on_tools else {}
    share, pair, place, text = _worst(
        contact, (_pressed(z, names[id(z)]) for z in on_tools)
    )
    return share, str(Finding(pair, place, text, REFINE, share))


def _worst(contact: Interaction, found: Iterable[Worst]) -> Worst:
    """The largest over zones and ranks. Collective."""
    return max(contact.layout.comm.allgather(max(found, default=NOTHING)))


def _corner(one: Contact, k: int) -> Iterator[Finding]:
    """Find a corner between slave surfaces that both press there. Collective."""
    corner = corner_between(one, pressed=2)
    if corner is not None:
        yield Finding(
            *corner,
            "both press at their corner, where one multiplier is not the traction on two "
            "faces: forces are off by a few percent",
            "Give each slave surface its own Contact",
            1.0,
            is_wrong=False,
            about=("corner", k),
        )


def _zones(contact: Interaction) -> list[ZoneData]:
    """Slave surfaces with the augmented Lagrangian method."""
    contacts = (
        c for c in contact.contacts if isinstance(c.method, AugmentedLagrangian)
    )
    return [zone for one in contacts for zone in one.zones]


def _pressed(zone: ZoneData, pair: str) -> Worst:
    """Find the largest penetration of a pressed point over its facet's size."""
    points, surface = seen_points(zone), zone.facets.slave_surface
    pressed = np.flatnonzero((points["pressure"] > 0.0) & (points["gap"] < 0.0))
    if not len(pressed):
        return NOTHING
    nodes = surface.X[surface.facet_nodes[points["slave"][pressed]]]
    share = -points["gap"][pressed] / np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    k = int(np.argmax(share))
    place, text = _depth(zone, points, pressed[k])
    return float(share[k]), pair, place, f"{text}, {share[k]:.2g} of its facet"


def _unseen(zone: ZoneData, comm: MPI.Comm, pair: str) -> Worst:
    """Find the depth of the deepest point that is too deep for contact. Collective."""
    penetrating, points = passed_points(zone, comm), zone.points()
    if not len(penetrating):
        return NOTHING
    q = penetrating[np.argmin(points["gap"][penetrating])]
    place, text = _depth(zone, points, q)
    return float(-points["gap"][q]), pair, place, f"{text}, where contact is not seen"


def _depth(
    zone: ZoneData, points: dict[str, Array], q: int
) -> tuple[tuple[float, ...], str]:
    """Say where a point is, and how deep in the master."""
    text = f"a point is {-points['gap'][q]:.3e} deep in the master"
    return placed(points["x"][q], points["x"]), text


def _stiffer(problem: CoupledProblem, one: Contact) -> str | None:
    """Propose the automatic coefficient of a penalty that is softer. Collective."""
    now = automatic_gamma(problem, one)
    is_soft = now is not None and SOFTER * one.assembly.gamma_scale < now
    return compared(one, now) if now is not None and is_soft else None


def _tension(
    problem: CoupledProblem, contact: Contact, number: int, pair: str
) -> Iterator[Finding]:
    """Compare the largest tension of a surface's nodes with its pressure: the multiplier
    swings about zero beside contact that few facets carry. Collective."""
    zone = contact.zones[number]
    comm, nodes = contact.layout.comm, zone.multiplier_nodes
    assert contact.multiplier is not None
    normal = contact.multiplier.x.array
    if contact.assembly.layout.components > 1:
        normal = -contact.pressure().x.array
    own = normal[nodes]
    mine: tuple[float, tuple[float, ...]] = (0.0, ())
    if own.max(initial=0.0) > 0.0:
        k = int(np.argmax(own))
        X = contact.surfaces.scalar.tabulate_dof_coordinates()
        X = X[nodes, : zone.facets.slave_surface.gdim]
        mine = float(own[k]), placed(X[k], X)
    tension, place = max(comm.allgather(mine))
    pressure = max(comm.allgather(-own.min(initial=0.0)))
    if tension <= TENSION * pressure:
        return
    modulus = contact.assembly.gamma_scale * mean_facet_size([zone])
    if pressure <= NO_PRESSURE * modulus:
        return
    if not zone.against_tension:
        zone.against_tension = _against_tension(problem, contact, number)
    yield Finding(
        pair,
        place,
        f"tension of {tension / pressure:.2g} of the largest pressure, as the multiplier "
        "swings about zero beside contact that few facets carry",
        zone.against_tension,
        tension / pressure,
        is_wrong=False,
        about=("tension", id(zone)),
    )


def _against_tension(problem: CoupledProblem, contact: Contact, number: int) -> str:
    """Say what lessens tension: the other order of sides where the slave is the finer one
    and not the softer. Collective."""
    surfaces, volume = contact.assembly.surfaces, contact.assembly.volume
    zone = contact.zones[number]
    refined = "Refine the slave there if tractions count"
    if zone.facets.bodies or volume is None:
        return refined
    closer = distance_ratio(zone, surfaces)
    stiffer = stiffness_ratios(volume, surfaces.interfaces, problem.bcs)[number].max()
    if closer < FINER or stiffer < NOT_SOFTER:
        return refined
    own = in_other_order(pair for pair in contact.pairs if pair.surface == number)
    return f"{own} lessens that, as the slave is finer than its master and not softer"


def _straight(
    problem: CoupledProblem,
    zone: ZoneData,
    points: dict[str, Array],
    pair: str,
    counts: Callable[[object, float], bool],
) -> Iterator[Finding]:
    """Compare how far straight facets lie off curved surfaces with how far bodies are
    pressed. Collective."""
    if not zone.off_curve:
        return
    mine, about = forces_on_facets(zone, points).sum(), ("straight", id(zone))
    force = float(zone.comm.allreduce(mine))
    if force <= 0.0 or not counts(about, force):
        return
    size = approach(problem, zone)
    yield Finding(
        pair,
        (),
        f"straight facets lie {zone.off_curve:.3e} off the curved surfaces, and bodies are "
        f"pressed by {size:.3e}",
        CURVED,
        zone.off_curve / size if size > 0.0 else np.inf,
        is_wrong=zone.off_curve > ALLOWED * size,
        about=about,
        force=force,
    )


def _tilts(contact: Interaction, names: dict[int, str]) -> Iterator[Finding]:
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
            # Tools have no facets to be a slave by
            swap = "" if isinstance(master, Target) else ", or swap sides"
            remedy = f"Give frame='master' on smooth masters{swap}"
            yield Finding(
                names[id(zone)],
                (),
                "slave facets on the master are tilted against it by "
                f"{angle[k]:.2g} degrees, and turn the force so",
                remedy,
                float(angle[k]),
                is_wrong=bool(angle[k] > TILTED),
                about=("tilt", number, k),
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


def _turns(contact: Interaction, names: dict[int, str]) -> Iterator[Finding]:
    """Find rigid bodies that turn by much in this step about an axis along the surface
    that slides on them: the series of the arc ends [theory (2.17)]. Collective."""
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
            short = _missing_arc(angle)
            if short > SHORT:
                yield Finding(
                    names[id(zone)],
                    (),
                    f"{body.name} turns by {angle:.2g} rad in this step, so that slip and "
                    f"the work of friction are {short:.0%} too small",
                    "Take steps of 0.5 rad",
                    float(angle),
                    is_wrong=bool(short > TOO_SHORT),
                    about=("turn", number, k),
                )


def _missing_arc(angle: float) -> float:
    """Share by which a slip around a bend of an angle is too small."""
    sine = np.sin(min(angle, 0.5 * np.pi))
    factors = np.cumprod([n / (n + 1.0) for n in range(2, 2 + 2 * ARC_TERMS, 2)])
    chord = np.sin(2.0 * angle) / (2.0 * angle) if angle > 0.0 else 1.0
    return float(
        1.0 - chord * (1.0 + factors @ sine ** (2.0 * np.arange(1, ARC_TERMS + 1)))
    )
