"""Solvers that ranks drop at different times."""

import gc

from mpi4py import MPI

import pytest
from problems import COMM, SOLVERS, build, fix

from meshes.scenes import two_blocks
from raymortar.host import dropped

pytestmark = [pytest.mark.quick, pytest.mark.mpi]


def solved(scene, solver):
    case = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", 1, -0.01)]
    )
    case.solve(solver)
    return case


@pytest.mark.parametrize("solver", SOLVERS)
def test_ranks_may_free_a_solver_at_different_times(solver):
    scene = two_blocks(COMM, 2, "triangle")
    case = solved(scene, solver)
    cycle = [case]
    cycle.append(cycle)
    gc.collect()
    gc.disable()
    try:
        del case, cycle
        if COMM.rank == 0:
            gc.collect()
        # The others have theirs still, and none waits
        assert COMM.allreduce(1, op=MPI.SUM) == COMM.size
        solved(scene, solver)
        gc.collect()
        solved(scene, solver)
    finally:
        gc.enable()
    kept = COMM.allgather(sorted(dropped._dropped))
    assert all(numbers == kept[0] for numbers in kept)
