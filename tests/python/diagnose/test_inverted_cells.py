"""Cells that a solve turns inside out, which linear elasticity allows."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual
from told import refuse_warnings

from meshes.scenes import two_blocks
from raymortar import Contact, ContactWarning, LoadSteps, NonlinearProblem
from raymortar.diagnose.inverted import inverted_cells
from raymortar.tools import vector_space

TOLD = r"the bodies at \(.*\): {} cell\(s\) are turned inside out"


class Blocks:
    """A block of linear elasticity, held on top, pressed on another one."""

    def __init__(self, cell="quadrilateral", degree=1, geometry_degree=1):
        dim = DIMENSION[cell]
        scene = two_blocks(COMM, dim, cell, 2, 2, geometry_degree)
        V = vector_space(scene.mesh, degree)
        self.u, self.top = fem.Function(V), fem.Constant(scene.mesh, np.zeros(dim))
        bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, self.top)]
        pair = (scene.tags["slave"], scene.tags["master"])
        self.cells = scene.mesh.topology.index_map(dim).size_global
        self.contact = Contact(self.u, scene.facet_tags, [pair])
        F = residual(scene, self.u)[0]
        self.problem = NonlinearProblem(F, self.contact, bcs)

    def press(self, way):
        self.top.value[-1] = -way


@pytest.mark.mpi(where=lambda cell, degree, **_: (cell, degree) == ("quadrilateral", 1))
@pytest.mark.parametrize(
    "cell, degree, geometry_degree, way, count",
    [
        ("quadrilateral", 1, 1, 5.0, 8),
        ("triangle", 2, 1, 5.0, 16),
        ("quadrilateral", 2, 2, 5.0, 8),
        ("tetrahedron", 1, 1, 3.0, "[0-9]+"),
        ("hexahedron", 1, 1, 5.0, 16),
    ],
)
def test_cells_inside_out_are_told(cell, degree, geometry_degree, way, count):
    blocks = Blocks(cell, degree, geometry_degree)
    blocks.press(way)
    with pytest.warns(ContactWarning, match=TOLD.format(count)):
        blocks.problem.solve()


@pytest.mark.quick
def test_a_path_tells_once():
    blocks = Blocks()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        LoadSteps(blocks.problem.snes_solver, lambda t: blocks.press(5.0 * t), 4).run()
    assert sum("inside out" in str(w.message) for w in caught) == 1


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_what_is_far_from_its_place_is_not_inside_out(cell):
    """Large rotations, shears and compressions keep the sign of the Jacobian."""
    blocks = Blocks(cell)
    for moved in (
        lambda x: np.array([-x[0] - x[1], x[0] - x[1]]) - x[:2],
        lambda x: np.array([7.0 * x[1], np.zeros_like(x[0])]),
        lambda x: np.array([np.zeros_like(x[0]), -0.999 * x[1]]),
        lambda x: 50.0 + 0.0 * x[:2],
    ):
        blocks.u.interpolate(moved)
        assert list(inverted_cells(blocks.contact)) == []
    blocks.u.interpolate(lambda x: np.array([-2.0 * x[0], np.zeros_like(x[0])]))
    (found,) = inverted_cells(blocks.contact)
    assert found.size == blocks.cells


@pytest.mark.mpi
def test_a_step_that_can_be_is_told_nothing():
    blocks = Blocks()
    blocks.press(0.5)
    with warnings.catch_warnings():
        refuse_warnings()
        blocks.problem.solve()
