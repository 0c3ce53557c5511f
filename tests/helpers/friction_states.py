"""Contact with friction at random states, where all points stick, all slip, or some."""

from __future__ import annotations

from dataclasses import dataclass

import gathered
import numpy as np
import states
from dolfinx import fem
from problems import COMM
from tangents import Pair

from raymortar import AugmentedLagrangian, Contact, Coulomb, Penalty, Stick, Tresca
from raymortar.core import compat
from raymortar.core.discretization import facets

NONE, OPEN, STICK, SLIP = 0, 1, 2, 3
METHODS = {
    "augmented": lambda: AugmentedLagrangian(states.GAMMA),
    "elastic": lambda: Penalty(states.GAMMA),
    "rate": lambda: Penalty(states.GAMMA, tangential="rate"),
}
# Its springs are none: the law holds at nodes
AT_NODES = {
    "nodes": lambda: AugmentedLagrangian(states.GAMMA, condition="nodes"),
    "dual": lambda: AugmentedLagrangian(
        states.GAMMA, condition="nodes", multiplier="dual"
    ),
}
# Slip of the step, next to the random deformation
DRAG = np.array([0.05, 0.03])
SMALLEST_TRACTION = 0.5


@dataclass(frozen=True)
class FrictionCase(states.Case):
    """What a contact with friction is made of."""

    law: str = "coulomb"
    regime: str = "slip"  # of all closed points: stick, slip, mixed

    def contact(self, scene, friction, tangent="fixed", **options):
        # Few points in 3D, where each has facets to cross and a limit to pass
        return Contact(
            fem.Function(compat.vector_space(scene.mesh, self.degree)),
            scene.facet_tags,
            [(scene.tags["slave"], scene.tags["master"])],
            (METHODS | AT_NODES)[self.method](),
            friction,
            quadrature_degree=2 if self.dim == 3 else None,
            measure=self.measure,
            tangent=tangent,
            **options,
        )


def set_history(contact, scene, seed, drag=DRAG):
    """A random accepted state, with random traction in the springs: with a multiplier
    and with elastic slip they hold lengths."""
    rng, V = np.random.default_rng(1000 + seed), contact.u.function_space
    X, upper = states.dof_positions(V), states.upper_dofs(scene, V)
    u = states.smooth_field(rng, X, 0.05)
    u[upper] = states.smooth_field(rng, X[upper], 0.05)
    u[upper, :-1] -= drag[: X.shape[1] - 1]
    contact.u.x.array[:] = u.ravel()
    contact.update()
    contact.advance()
    for zone in contact.zones:
        if zone.traction_old is not None:
            size = zone.traction_old.shape
            one = states.TRACTION
            if contact.multiplier is not None or is_elastic(contact):
                one /= states.GAMMA
            zone.traction_old = rng.uniform(-1.0, 1.0, size) * one
            zone.cpp.set_field("traction_old", zone.traction_old)
        if is_elastic(contact) and zone.has_law_at_nodes:
            stretch_nodes(zone, states.TRACTION / states.GAMMA)


def is_elastic(contact):
    return contact.surfaces.options.has_elastic_slip


def stretch_nodes(zone, size):
    """Give each node an elastic slip of this size, a function of its place."""
    surface, rows = zone.facets.slave_surface, zone.spring_points
    d, facet = surface.gdim, rows[:, 0].astype(int)
    X = surface.X[surface.facet_nodes[facet]]
    shape, degree = surface.shape, surface.node_degree
    x = facets.interpolate(shape, degree, X, rows[:, 1:d])
    phases = np.outer(x @ np.linspace(7.0, 3.0, d), np.linspace(1.0, 2.0, d))
    rows[:, d + 1 :] = size * np.sin(phases)
    zone.cpp.set_spring_points(rows)


def set_both(contact, scene, seed):
    set_history(contact, scene, seed)
    states.set_state(contact, scene, "active", seed)


def tangential(points, vectors):
    n = points["contact_normal"]
    return vectors - np.einsum("qi,qi->q", vectors, n)[:, None] * n


def trial_traction(contact):
    """Tangential trial traction where the law of a contact that sticks holds."""
    if contact.method.condition == "nodes":
        return trial_at_nodes(contact)
    p = gathered.points(contact)
    q = tangential(p, p["traction"])
    if contact.multiplier is not None:
        q -= states.GAMMA * tangential(p, p["slip"])
    hit = p["status"] != NONE
    return np.linalg.norm(q[hit], axis=1), -p["pressure"][hit]


def trial_at_nodes(contact):
    """The same at the nodes of the first slave surface."""
    zone = contact.zones[0]
    nodes = gathered.dictionary(zone.cpp.nodes())
    n = nodes["normal"]
    lam = contact.multiplier.x.array.reshape(-1, n.shape[1])[zone.multiplier_nodes]
    lam = np.concatenate(COMM.allgather(lam))
    q = lam - nodes["gamma"][:, None] * nodes["slip"]
    q -= np.einsum("qi,qi->q", q, n)[:, None] * n
    hit = nodes["status"] != NONE
    return np.linalg.norm(q[hit], axis=1), nodes["pressure"][hit]


def widest(values):
    """Middle of the widest gap within the middle half of some values."""
    values = np.sort(values)
    middle = values[len(values) // 4 : -(len(values) // 4)]
    k = np.argmax(np.diff(middle))
    return (middle[k] + middle[k + 1]) / 2


def law_for(case, scene, seed, **options):
    """Friction law that puts a random state in a regime; None: too near q = 0."""
    if case.law == "stick":
        return Stick()
    if case.law == "elastic":
        return elastic_law_for(case, scene, seed, **options)
    sticking = case.contact(scene, Stick(), **options)
    set_both(sticking, scene, seed)
    q, p = trial_traction(sticking)
    if q.min() < SMALLEST_TRACTION or p.max() >= 0.0:
        return None  # strongly curved there, or open
    ratio = q / -p if case.law == "coulomb" else q
    limit = {
        "stick": lambda: 1.5 * ratio.max(),
        "slip": lambda: 0.7 * ratio.min(),
        "mixed": lambda: widest(ratio),
    }[case.regime]()
    return Coulomb(limit) if case.law == "coulomb" else Tresca(limit)


def elastic_law_for(case, scene, seed, **options):
    """The law with an elastic slip that does so; None: there is none."""
    wanted = {"stick": {STICK}, "slip": {SLIP}, "mixed": {STICK, SLIP}}[case.regime]
    for size in np.geomspace(20.0, 0.01, 12) * states.TRACTION / states.GAMMA:
        law = Coulomb(0.3, elastic_slip=size)
        contact = case.contact(scene, law, **options)
        set_both(contact, scene, seed)
        status = gathered.points(contact)["status"]
        if set(status[status != NONE]) == wanted:
            return law
    return None


def check_regime(contact, regime):
    status = gathered.points(contact)["status"]
    found = set(status[status != NONE])
    assert found == {"stick": {STICK}, "slip": {SLIP}, "mixed": {STICK, SLIP}}[regime]


def in_regime(contact, regime):
    """Whether all points that hit are in stick, or in slip."""
    status = gathered.points(contact)["status"]
    return set(status[status != 0]) == {{"stick": STICK, "slip": SLIP}[regime]}


def frictional_pairs(case, scene, **options):
    """What makes contacts of both tangents for a seed; None where no law fits."""

    def make(seed):
        friction = law_for(case, scene, seed)
        if friction is None:
            return None
        return Pair(
            *(
                case.contact(scene, friction, tangent=t, **options)
                for t in ("fixed", "full")
            )
        )

    return make
