"""Blocks of a former tangent that GMRES takes for exact, where they are not."""

import interacting
import numpy as np
import pytest
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import Contact, Coulomb, LoadSteps, NonlinearProblem, SNESSolver, solvers

STEPS = 3


def three(gap):
    """A block between two others, which hold it by contact alone."""
    tags = {"bottom": 1, "top": 2}
    sides = [{name: 10 * (i + 1) + k for name, k in tags.items()} for i in range(3)]
    corners = [
        ((4, 4, 2), (0.0, 0.0, 0.0), (1.2, 1.2, 0.5)),
        ((3, 3, 2), (0.1, 0.1, 0.5 + gap), (0.9, 0.9, 1.0 + gap)),
        ((4, 4, 2), (-0.05, -0.05, 1.0 + 2 * gap), (1.05, 1.05, 1.4 + 2 * gap)),
    ]
    blocks = [Block(*place, tags=of) for place, of in zip(corners, sides)]
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, blocks, "hexahedron", 1)
    names = {f"{n}_{i}": k for i, of in enumerate(sides) for n, k in of.items()}
    names |= {"slave": names["bottom_1"]}
    bodies = {str(i): i + 1 for i in range(3)}
    return Scene(mesh, cell_tags, facet_tags, names, bodies)


def forces(options, pairs, moduli, gap):
    """Of all steps and contacts, with the steps that were accepted."""
    scene = three(gap)
    stack = interacting.Stack(scene, ["bottom_0"], ["top_2"])
    for body, modulus in moduli.items():
        cells = scene.cell_tags.find(scene.bodies[body])
        for function in stack.moduli:
            function.x.array[cells] *= modulus
    contacts = [
        Contact(
            stack.u,
            scene.facet_tags,
            [tuple(scene.tags[name] for name in pair)],
            friction=Coulomb(0.3),
        )
        for pair in pairs
    ]
    solver = SNESSolver(NonlinearProblem(stack.F, contacts, stack.bcs), options)

    def press(t):
        down = -0.05 * t - 2 * gap * min(1.0, 2 * t)
        for value, part in zip(stack.motion, (0.02 * t, 0.01 * t, down)):
            value.value = part

    steps = LoadSteps(solver, press, STEPS)
    return np.array([[c.resultant().force for c in contacts] for _ in steps])


DOWN = [("bottom_1", "top_0"), ("bottom_2", "top_1")]
UP = [pair[::-1] for pair in DOWN]
SCENES = {
    # Blocks of a body that touches nothing were kept when it did: no step arrived. Where it
    # lands depends on the size of steps
    "loose": (solvers.with_fallback, DOWN, {}, 0.02, 1e-5),
    # Corrections were none, so that steps were halved
    "hard": (solvers.iterative, UP, {"1": 1e6}, 0.0, 1e-9),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.filterwarnings("ignore:the iterative linear solver has stalled")
def test_a_path_is_that_of_the_direct_solver(name):
    make, *scene, tolerance = SCENES[name]
    expected, found = (forces(one(), *scene) for one in (solvers.direct, make))
    assert len(found) == STEPS
    size = np.abs(expected[-1]).max()
    assert size > 0.0
    assert np.abs(found[-1] - expected[-1]).max() < tolerance * size
