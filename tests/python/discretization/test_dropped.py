"""Solvers that ranks drop at different times, and what is left of them."""

import ctypes
import gc

from mpi4py import MPI

import pytest
from problems import COMM, SOLVERS, build, fix

from meshes.scenes import two_blocks
from raymortar import SNESSolver, solvers
from raymortar.core.discretization import ranks as dropped

pytestmark = pytest.mark.quick


def solved(scene, solver):
    case = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", 1, -0.01)]
    )
    case.solve(solver)
    return case


@pytest.mark.mpi
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


class Malloc(ctypes.Structure):
    """What mallinfo2 of glibc 2.33 and later tells, by its names."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks "
        "fordblks keepcost".split()
    ]


@pytest.fixture
def in_use():
    """Function that counts the bytes which malloc has handed out."""
    try:
        mallinfo = ctypes.CDLL(None).mallinfo2
    except AttributeError:
        pytest.skip("the C library does not tell what malloc has handed out")
    mallinfo.restype = Malloc

    def count():
        gc.collect()
        found = mallinfo()
        return found.uordblks + found.hblkhd

    return count


@pytest.mark.parametrize("options", [None, solvers.iterative("bodies")])
def test_a_solver_that_is_dropped_leaves_nothing(options, in_use):
    """A vector would be some 17 kB, and the next solver would lose another one."""
    scene, repeats = two_blocks(COMM, 2, "triangle", 24, 20), 100
    case = build(scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top")])
    vector = 8 * case.problem.create_vector().getSize()
    for _ in range(10):
        SNESSolver(case.problem, options)

    def growth():
        before = in_use()
        for _ in range(repeats):
            SNESSolver(case.problem, options)
        return (in_use() - before) / repeats

    # What is lost is lost each time; Python's own memory grows now and then
    assert min(growth(), growth()) < 0.1 * vector
