"""Results of 4 and 8 ranks are those of one: ties, solids of revolution."""

from mpi4py import MPI

import boxes
import numpy as np
import problems
import pytest
import revolution
import tying
from problems import fix

from meshes.scenes import two_blocks
from raymortar import Coulomb


def tied_beam():
    """Force and moments of a beam of two halves bent to a quarter circle, with a gap."""
    found = tying.bent(2, 0.06)
    parts = (found.through, found.wall, found.end)
    return np.concatenate([np.append(force, moment) for force, moment in parts])


def turned_rings():
    """Force of rings, one pressed on the other and out over it, with friction."""
    scene = two_blocks(problems.COMM, 2, "triangle", (7, 3), (5, 4))
    scene = revolution.moved(scene, 2.0)

    def bcs(V, scene):
        def driven(X):
            return np.tile((0.05, -0.1), (len(X), 1))

        return [fix(V, scene, "bottom"), fix(V, scene, "top", value=driven)]

    found = revolution.build(
        scene, 2, "neo-hookean", bcs=bcs, friction=Coulomb(0.2), measure="current"
    )
    revolution.solve(found)
    resultant = found.contact.resultant()
    return np.append(resultant.force, resultant.radial)


@pytest.mark.many_ranks
@pytest.mark.parametrize("case", (tied_beam, turned_rings))
def test_ranks_agree(case, monkeypatch):
    found = case()
    with monkeypatch.context() as patch:
        for module in (problems, tying, revolution, boxes):
            patch.setattr(module, "COMM", MPI.COMM_SELF)
        alone = case()
    assert found == pytest.approx(alone, rel=1e-10, abs=1e-10 * np.abs(alone).max())
