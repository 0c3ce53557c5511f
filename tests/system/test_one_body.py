"""Two surfaces of one body in contact: a clip that closes."""

import numpy as np
import pytest
from interacting import Stack
from problems import COMM, DIMENSION, worst

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import Coulomb, SNESSolver
from raymortar.results import Status

pytestmark = pytest.mark.mpi
TAGS = {"bottom": 1, "top": 2, "lower_jaw": 3, "upper_jaw": 4}
# Of the clip: where its back ends, and its end; where its jaws begin, and its top
BACK, END, LOWER, UPPER, TOP = 0.5, 2.0, 0.4, 0.5, 0.9


def clip(cell):
    """A body with a slot, whose upper jaw has other facets than the lower one."""
    dim = DIMENSION[cell]

    def block(along, across, n, **tags):
        middle = ((0.0, 0.6),) * (dim - 2)
        lower, upper = zip(along, *middle, across)
        sides = {side: TAGS[name] for side, name in tags.items()}
        divisions = (n, *(1,) * (dim - 2), 2)
        return Block(divisions, lower, upper, tags=sides, body="clip")

    blocks = [
        block((0.0, BACK), (0.0, LOWER), 2, bottom="bottom"),
        block((BACK, END), (0.0, LOWER), 6, bottom="bottom", top="lower_jaw"),
        block((0.0, BACK), (LOWER, UPPER), 2),
        block((0.0, BACK), (UPPER, TOP), 2, top="top"),
        block((BACK, END), (UPPER, TOP), 4, top="top", bottom="upper_jaw"),
    ]
    return Scene(*assemble_blocks(COMM, blocks, cell, 1), TAGS, {"clip": 1})


@pytest.mark.quick
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_jaws_of_a_clip_meet(cell, friction):
    """The slot closes, and supports take no more than they give."""
    body = Stack(clip(cell), ["bottom"], ["top"])
    contact = body.contact(("upper_jaw", "lower_jaw"), friction=friction)
    problem = body.problem(contact)
    body.motion[-1].value = -2.0 * (UPPER - LOWER)
    iterations, _ = SNESSolver(problem).solve()
    assert iterations <= 12
    # At single points of facets that do not match; the top goes twice as deep
    gap, status = (contact.points()[name] for name in ("gap", "status"))
    assert COMM.allreduce(int((status >= Status.STICK).sum())) > 0
    assert worst(np.minimum(gap, 0.0)) <= 0.1 * (UPPER - LOWER)
    force = contact.resultant().force
    held = problem.reactions({"held": body.bcs[:1], "moved": body.bcs[1:]})
    assert force[-1] > 0.1
    size = np.abs(held["held"]).max()
    np.testing.assert_allclose(held["held"] + held["moved"], 0.0, atol=1e-9 * size)
