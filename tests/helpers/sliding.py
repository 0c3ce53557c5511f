"""A block that slides across all of another, for comparison between numbers of ranks.

Where the cells are is up to `PARTITIONS`; every one of the results is keyed by places
in the undeformed bodies, so that it can be compared whatever the numbering.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from dolfinx import fem
from problems import DIMENSION, build, fix

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty
from raymortar.core import compat
from raymortar.io.partitions import columns

E, NU = 10.0, 0.3
LOWER, UPPER, HEIGHT, GAP = 2.4, 0.6, 0.5, 0.05
PRESS, SLIDE = 0.06, 1.5
STEPS = 3  # of pressing; thrice as many of sliding


def bodies_apart(x, ranks):
    """The upper block on the last rank, the lower one in strips on the others."""
    strips = (x[:, 0] / LOWER * max(ranks - 1, 1)).astype(int)
    return np.where(x[:, -1] > HEIGHT, ranks - 1, np.clip(strips, 0, ranks - 2))


def one_rank_empty(x, ranks):
    """Strips for all ranks but the first, which has no cell."""
    return 1 + np.clip((x[:, 0] / LOWER * (ranks - 1)).astype(int), 0, ranks - 2)


def striped(x, ranks):
    """Narrow strips, in turns: no rank has a coherent piece."""
    return ((x[:, 0] + 0.5 * x[:, -1]) / LOWER * 11).astype(int) % ranks


def contact_on_few(x, ranks):
    """All but the last rank have cells far from contact only, as far as there are."""
    far = np.abs(x[:, -1] - HEIGHT) > 0.5 * HEIGHT
    return np.where(
        far & (ranks > 1), (x[:, 0] * 7).astype(int) % (ranks - 1), ranks - 1
    )


def columns_of_contact(x, ranks):
    """Cells above each other on one rank."""
    return columns(np.eye(x.shape[1])[-1])(x, ranks)


PARTITIONS = {
    "graph": None,
    "columns": columns_of_contact,
    "bodies_apart": bodies_apart,
    "one_rank_empty": one_rank_empty,
    "striped": striped,
    "contact_on_few": contact_on_few,
}
METHODS = {
    "augmented": AugmentedLagrangian,
    "penalty": lambda: Penalty(100.0),
    "frictionless": AugmentedLagrangian,
}


@dataclass
class Results:
    """What a run gives, equal on all ranks: fields by place at the end, and of every
    step forces, extreme gaps and pressures, counts, and pairs of facets."""

    fields: dict = field(default_factory=dict)
    forces: list = field(default_factory=list)
    extremes: list = field(default_factory=list)
    counts: list = field(default_factory=list)
    pairs: list = field(default_factory=list)
    partner_ranks: list = field(default_factory=list)


class Sliding:
    """Upper block pressed into the lower one, and then dragged along. Collective."""

    def __init__(self, comm, cell, degree, method, partition=None):
        self.comm, self.dim = comm, DIMENSION[cell]
        lateral = self.dim - 2  # directions across the slide
        self.scene = two_blocks(
            comm,
            self.dim,
            cell,
            lower_divisions=(12,) + (2,) * lateral + (2,),
            upper_divisions=(3,) + (2,) * lateral + (2,),
            lower_size=(LOWER,) + (0.8,) * lateral + (HEIGHT,),
            upper_size=(UPPER,) + (0.5,) * lateral + (HEIGHT,),
            overhang=(-0.5 * (LOWER - UPPER) + 0.12,) + (0.05,) * lateral,
            gap=GAP,
            partition=partition,
        )
        self.problem = build(
            self.scene,
            degree,
            "neo-hookean",
            METHODS[method](),
            E={"lower": E, "upper": 5 * E},
            nu=NU,
            bcs=self._conditions,
            friction=None if method == "frictionless" else Coulomb(0.2),
            search=raymortar.Search(reach=0.4, depth=0.4),
        )
        self.contact = self.problem.contact
        self.solver = raymortar.SNESSolver(
            self.problem.problem, {"snes_rtol": 1e-13, "snes_max_it": 40}
        )

    def _conditions(self, V, scene):
        zero = np.zeros(self.dim)
        self.motion = fem.Constant(scene.mesh, zero)
        return [fix(V, scene, "bottom"), fix(V, scene, "top", value=self.motion)]

    def apply(self, t):
        """Down until t = 0.25, then along."""
        self.motion.value[-1] = -(GAP + PRESS) * min(t / 0.25, 1.0)
        self.motion.value[0] = SLIDE * max(t - 0.25, 0.0) / 0.75

    def run(self):
        """Results of the whole path."""
        results = Results()
        for t in np.linspace(0.0, 1.0, 4 * STEPS + 1)[1:]:
            self.apply(t)
            self.solver.solve()
            self._record(results)
            self.contact.advance()
        self._record_end(results)
        return results

    def _owned(self, f):
        """Places (n, d) and values (n, m) of a function at owned dofs."""
        V = f.function_space
        n, bs = V.dofmap.index_map.size_local, V.dofmap.index_map_bs
        places = V.tabulate_dof_coordinates()[:n, : self.dim]
        return places, f.x.array[: n * bs].reshape(n, bs)

    def _gather(self, places, values):
        """All ranks' rows, sorted by place."""
        rows = np.hstack([places, values])
        rows = np.concatenate(self.comm.allgather(rows))
        key = np.round(rows[:, : self.dim], 9)
        return rows[np.lexsort(key.T)]

    def _record(self, results):
        contact = self.contact
        r = contact.resultant()
        results.forces.append(
            np.concatenate(
                [r.force, np.atleast_1d(r.moment), r.tangential, self._reaction()]
            )
        )
        pairs, ranks = self._pairs()
        results.pairs.append(pairs)
        results.partner_ranks.append(ranks)
        s = contact.statistics
        results.counts.append(
            [s.slave_facets, s.pairs, s.segments, s.points, s.hits, s.active_points]
        )
        results.extremes.append([s.min_gap, s.max_gap, s.max_pressure])

    def _reaction(self):
        """Force on the top, from the stress in the block."""
        V = self.problem.u.function_space
        r = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        compat.assemble_residual(r.array, self.problem.problem.L)
        compat.scatter_reverse_add(r)
        top = self.scene.facet_tags.find(self.scene.tags["top"])
        dofs = fem.locate_dofs_topological(V, self.dim - 1, top)
        dofs = dofs[dofs < V.dofmap.index_map.size_local]
        force = r.array.reshape(-1, self.dim)[dofs].sum(axis=0)
        return self.comm.allreduce(force)

    def _pairs(self):
        """Pairs of facets as pairs of midpoints, and as pairs of ranks."""
        facets = self.contact.zones[0].facets
        place = {}
        for s in (facets.slave_surface, facets.master_surface):
            middles = s.X[s.facet_nodes].mean(axis=1)
            for i, x in zip(s.facet_ids, middles):
                place[int(i)] = (self.comm.rank, *np.round(x, 9).tolist())
        known = {}
        for one in self.comm.allgather(place):
            known.update(one)
        here = [(known[a], known[b]) for a, b in self.contact.zones[0].cpp.pairs()]
        met = [pair for part in self.comm.allgather(here) for pair in part]
        pairs = sorted((s[1:], m[1:]) for s, m in met)
        return pairs, {(s[0], m[0]) for s, m in met}

    def _record_end(self, results):
        contact = self.contact
        fields = {"u": self.problem.u, "gap": contact.gap(), "status": contact.status()}
        if contact.friction is not None:
            fields["slip"] = contact.slip()
        for part in ("total", "normal", "tangential"):
            fields[part] = contact.traction(part)
        if contact.multiplier is not None:
            fields["multiplier"] = contact.multiplier
        for name, f in fields.items():
            results.fields[name] = self._gather(*self._owned(f))
