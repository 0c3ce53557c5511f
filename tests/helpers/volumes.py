"""What the tests of linear volumes share."""

import numpy as np
import pytest
from problems import COMM

from raymortar.core import compat
from raymortar.core.system.volume import Volume


def without_what_is_kept(problem):
    """The volume of a problem, all of which is assembled each time."""
    return Volume(problem.contact, problem.L, problem.a)


def disturb(problem, size=1e-2):
    """Any values of the unknowns, the same on all ranks that share them."""
    rng = np.random.default_rng(COMM.rank)
    for f in problem.contact.unknowns.functions:
        f.x.array[:] = size * rng.standard_normal(len(f.x.array))
        compat.scatter_forward(f.x)
    problem.contact.unknowns.pull()


def assert_as_assembled(problem):
    """Compare a volume that is kept with one that is assembled."""
    kept, plain = problem.volume, without_what_is_kept(problem)
    assert kept.kept is not None and plain.kept is None
    increment = problem.contact.unknowns.lacking(problem.bcs).increment
    found, wanted = (one.residual(problem.bcs, increment) for one in (kept, plain))
    largest = COMM.allreduce(np.abs(wanted).max(initial=0.0), op=max)
    assert found == pytest.approx(wanted, abs=1e-13 * largest)
    forces = [one.forces(problem.bcs) for one in (kept, plain)]
    assert forces[0] == pytest.approx(forces[1], abs=1e-13 * largest)
    A, B = problem.create_matrix(), problem.create_matrix()
    for matrix, one in ((A, kept), (B, plain)):
        matrix.zeroEntries()
        one.add_tangent(matrix, problem.bcs)
        matrix.assemble()
    size = B.norm()
    A.axpy(-1.0, B)
    assert A.norm() <= 1e-14 * size


def counted(monkeypatch):
    """Assemblies of tangents from here on."""
    calls, assemble = [], compat.assemble_jacobian
    monkeypatch.setattr(
        compat,
        "assemble_jacobian",
        lambda *args: (calls.append(1), assemble(*args)) and None,
    )
    return calls
