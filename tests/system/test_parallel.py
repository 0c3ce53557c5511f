"""The same answer on any number of ranks, wherever the cells are (F6).

A path on all ranks is compared with the same path on one of them, computed in the same
run. Alone, the tests have nothing to compare.
"""

from functools import lru_cache

from mpi4py import MPI

import numpy as np
import pytest
from problems import COMM
from sliding import PARTITIONS, STEPS, Sliding

pytestmark = [
    pytest.mark.mpi,
    pytest.mark.skipif(COMM.size == 1, reason="one rank is the reference"),
]
TOLERANCE = 1e-10  # of the largest value
# Every partition and every kind of facet, degree and law; the first ones are also run
# on more ranks than there are strips of cells to go round
CASES = [
    ("quadrilateral", 1, "augmented", "bodies_apart"),
    ("triangle", 2, "penalty", "striped"),
    ("tetrahedron", 1, "augmented", "striped"),
    ("hexahedron", 1, "penalty", "one_rank_empty"),
    ("triangle", 1, "penalty", "graph"),
    ("quadrilateral", 2, "frictionless", "contact_on_few"),
    ("tetrahedron", 1, "augmented", "columns"),
]
PARAMETERS = [
    pytest.param(c, marks=[pytest.mark.many_ranks] * (i < 4), id="-".join(map(str, c)))
    for i, c in enumerate(CASES)
]


@lru_cache(maxsize=None)
def serial(cell, degree, method):
    """Results of one rank, known to all."""
    alone = None
    if COMM.rank == 0:
        alone = Sliding(MPI.COMM_SELF, cell, degree, method).run()
    return COMM.bcast(alone, root=0)


@lru_cache(maxsize=None)
def parallel(cell, degree, method, partition):
    return Sliding(COMM, cell, degree, method, PARTITIONS[partition]).run()


@pytest.fixture(params=PARAMETERS)
def both(request):
    """The parallel results and the serial ones."""
    return parallel(*request.param), serial(*request.param[:3])


def assert_close(a, b, size):
    assert a.shape == b.shape
    nowhere = np.isnan(b)
    assert np.array_equal(np.isnan(a), nowhere)
    assert np.max(np.abs(a - b)[~nowhere], initial=0.0) <= TOLERANCE * size


def test_fields_are_those_of_one_rank(both):
    many, one = both
    assert many.fields.keys() == one.fields.keys()
    assert {"u", "gap", "total"} <= one.fields.keys()
    for name, field in one.fields.items():
        dim = many.fields["u"].shape[1] // 2
        stress = name in ("multiplier", "total", "normal", "tangential")
        scale = np.nanmax(np.abs(one.fields["total"])) if stress else 1.0
        np.testing.assert_allclose(
            many.fields[name][:, :dim], field[:, :dim], atol=1e-12
        )
        assert_close(many.fields[name], field, max(scale, 1.0))


def test_forces_and_counts_are_those_of_one_rank_at_every_step(both):
    many, one = both
    assert len(one.forces) == 4 * STEPS
    assert_close(np.array(many.forces), np.array(one.forces), np.abs(one.forces).max())
    # Gaps, in the blocks' length 1, and pressures
    assert_close(np.array(many.extremes), np.array(one.extremes), 1.0)
    assert many.counts == one.counts


def test_the_same_facets_meet_at_every_step(both):
    many, one = both
    assert many.pairs == one.pairs
    # Large sliding: no pair of the beginning is left at the end
    assert not set(one.pairs[STEPS - 1]) & set(one.pairs[-1])


@pytest.mark.parametrize("partition", ["bodies_apart", "striped", "one_rank_empty"])
def test_facets_change_the_rank_of_their_partners(partition):
    """The comparison is one of moving partners, or it would show less."""
    case = next(c for c in CASES if c[3] == partition)
    ranks = parallel(*case).partner_ranks
    if partition == "striped" or COMM.size > 2:
        assert len(set(map(frozenset, ranks))) > 1
    used = set().union(*ranks)
    if partition != "one_rank_empty" or COMM.size > 2:
        assert any(s != m for s, m in used)
    if partition == "one_rank_empty":
        assert 0 not in {rank for pair in used for rank in pair}
