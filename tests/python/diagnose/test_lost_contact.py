"""Contact that goes is told: surfaces that pass each other, bodies that nothing holds."""

import warnings

from petsc4py import PETSc

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, SOLVERS, build, fix
from told import keep_warnings, refuse_warnings

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import ContactWarning, ConvergenceError, LoadSteps
from raymortar.core.errors import ContactLost

GAP = 0.01
TAGS = {"bottom": 1, "slave": 3, "master": 4}
LOWER = {"bottom": TAGS["bottom"], "top": TAGS["master"]}


class Tool:
    """A small block that is moved as a whole over a wide one whose bottom is held.

    Parameters
    ----------
    swap
        Whether the tool is the master.
    thickness
        Of the wide block, whose width is 1.
    """

    def __init__(self, cell, swap=False, thickness=1.0, degree=1, **options):
        dim = DIMENSION[cell]
        scene = two_blocks(
            COMM,
            dim,
            cell,
            (8, 4) if dim == 2 else (5, 5, 2),
            2,
            gap=GAP,
            lower_size=(1.0,) * (dim - 1) + (thickness,),
            upper_size=(0.4,) * dim,
        )
        self.place = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))

        def conditions(V, scene):
            heights = V.tabulate_dof_coordinates()[:, dim - 1]
            held = np.flatnonzero(heights > thickness + GAP / 2).astype(np.int32)
            return [fix(V, scene, "bottom"), fem.dirichletbc(self.place, held, V)]

        self.case = build(scene, degree, bcs=conditions, swap=swap, **options)
        self.solver = SOLVERS[0](self.case.problem)

    def solve(self, across, down):
        """Warnings of a solve with the tool at a place: below the touch by `down`."""
        self.place.value[0], self.place.value[-1] = across, -GAP - down
        with warnings.catch_warnings(record=True) as caught:
            keep_warnings()
            self.solver.solve()
        return [str(w.message) for w in caught if w.category is ContactWarning]

    def path(self, *places):
        """Warnings of several accepted steps."""
        found = []
        for across, down in places:
            found += self.solve(across, down)
            self.case.contact.advance()
        return found


# Ends that are wrong


@pytest.mark.quick
@pytest.mark.mpi(where=lambda down, **_: down < 1.0)
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("down", [0.9, 3.0])
def test_a_tool_that_jumps_into_or_through_a_block(cell, swap, down):
    found = Tool(cell, swap).path((0.0, down))
    assert len(found) >= 1 and "passed into or through" in found[-1]
    assert f"{down:.3e}"[:3] in found[-1]


@pytest.mark.mpi(where=lambda cell_2d, **_: cell_2d == "triangle")
@pytest.mark.parametrize("swap", [False, True])
def test_a_tool_that_jumps_on_from_contact(cell_2d, swap):
    tool = Tool(cell_2d, swap)
    assert tool.path((0.0, -0.005), (0.0, 0.005)) == []
    assert any("passed into or through" in text for text in tool.path((0.0, 2.0)))


@pytest.mark.mpi(where=lambda cell_2d, **_: cell_2d == "triangle")
@pytest.mark.parametrize("swap", [False, True])
def test_a_tool_that_goes_through_a_thin_plate(cell_2d, swap):
    tool = Tool(cell_2d, swap, thickness=0.05)
    found = tool.path((0.0, 0.001), (0.0, 0.3))
    assert any("passed into or through" in text for text in found)


@pytest.mark.mpi(where=lambda cell_2d, **_: cell_2d == "triangle")
@pytest.mark.parametrize("swap", [False, True])
def test_a_tool_that_is_torn_off_along_the_surface(cell_2d, swap):
    tool = Tool(cell_2d, swap)
    found = tool.path((0.0, 0.002), (3.0, 0.002))
    assert any("slid past the end" in text for text in found)


@pytest.mark.quick
@pytest.mark.mpi
def test_load_steps_take_smaller_ones_instead(cell_2d):
    """A step that would end inside the block, as a lone solve does, is cut."""
    alone, path = Tool(cell_2d), Tool(cell_2d)
    assert any("passed into or through" in text for text in alone.path((0.0, 0.7)))
    assert alone.case.contact.statistics.active_points == 0

    def apply(t):
        path.place.value[-1] = -GAP - 0.7 * t

    steps = LoadSteps(path.solver, apply, 1)
    with warnings.catch_warnings():
        refuse_warnings()
        steps.run()
    assert steps.halvings > 0
    assert path.case.contact.statistics.active_points > 0


@pytest.mark.mpi
def test_load_steps_say_that_contact_was_lost(cell_2d):
    tool = Tool(cell_2d)

    def apply(t):
        tool.place.value[-1] = -GAP - 0.7 * t

    lost = "contact is lost: .* slave tag"
    with pytest.raises(ConvergenceError, match=lost) as failure:
        LoadSteps(tool.solver, apply, 1, max_halvings=0).run()
    assert isinstance(failure.value.__cause__, ContactLost)


ROOF = 3.0  # height of a plate above all


class TwoTools:
    """Two small blocks of one slave over a wide one: the left one stays in touch."""

    def __init__(self, cell, has_roof=False):
        dim = DIMENSION[cell]
        fine, coarse = (6,) * (dim - 1), (1,) * dim
        blocks = [Block((*fine, 4), (0.0,) * dim, (1.0,) * dim, tags=LOWER)]
        for left in (0.1, 0.6):
            begin, end = (left, 0.2)[: dim - 1], (left + 0.3, 0.5)[: dim - 1]
            corners = (*begin, 1.0 + GAP), (*end, 1.3 + GAP)
            blocks.append(Block(coarse, *corners, tags={"bottom": TAGS["slave"]}))
        if has_roof:
            corners = (-1.0,) * (dim - 1) + (ROOF,), (3.0,) * (dim - 1) + (ROOF + 0.5,)
            blocks.append(Block(coarse, *corners, tags={"top": TAGS["master"]}))
        scene = Scene(*assemble_blocks(COMM, blocks, cell), TAGS)
        self.places = [
            fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType)) for _ in range(2)
        ]

        def conditions(V, scene):
            x = V.tabulate_dof_coordinates()
            height, right = x[:, dim - 1], x[:, 0] > 0.5
            above, roof = (height > 1.0 + GAP / 2) & (height < ROOF), height >= ROOF
            held = [np.flatnonzero(above & ~right), np.flatnonzero(above & right)]
            still = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))
            return [
                fix(V, scene, "bottom"),
                fem.dirichletbc(still, np.flatnonzero(roof).astype(np.int32), V),
                *(
                    fem.dirichletbc(place, dofs.astype(np.int32), V)
                    for place, dofs in zip(self.places, held)
                ),
            ]

        self.case = build(scene, bcs=conditions)

    def solve(self, across, down):
        """Warnings of a step that moves the right one alone."""
        for place in self.places:
            place.value[-1] = -GAP - 0.005
        solver = SOLVERS[0](self.case.problem)
        solver.solve()
        self.case.contact.advance()
        self.places[1].value[0], self.places[1].value[-1] = across, -GAP - down
        with warnings.catch_warnings(record=True) as caught:
            keep_warnings()
            solver.solve()
        assert self.case.contact.statistics.active_points > 0
        return [str(w.message) for w in caught if w.category is ContactWarning]


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("across", [0.0, 0.55])
def test_a_tool_that_goes_in_while_another_touches(cell, across):
    """Its rays meet nothing within reach, and so do those of one beside the edge."""
    found = TwoTools(cell).solve(across, 1.5)
    told = any("passed into or through" in text for text in found)
    assert told == (across == 0.0)


def test_a_master_above_what_hangs_beside_another_is_not_what_it_faced(cell):
    """A top is tagged alone, so that all below it counts as its inside."""
    assert TwoTools(cell, has_roof=True).solve(0.55, 1.5) == []


# Ends that are right

RIGHT = {
    "rest": [(0.0, -GAP)],
    "pressed": [(0.0, 0.01), (0.0, 0.02)],
    "lift": [(0.0, 0.01), (0.0, -0.05)],
    "far lift": [(0.0, 0.01), (0.0, -30.0)],
    "lift and return": [(0.0, 0.01), (0.0, -1.0), (0.0, 0.01)],
    "slide": [(0.0, 0.01), (0.1, 0.01), (0.25, 0.01)],
    "off the rim": [(0.2, 0.01), (0.3, 0.01), (0.45, 0.01), (0.6, 0.01), (0.75, 0.01)],
    "lift aside": [(0.0, 0.01), (0.3, -0.6)],
    # With a step of more than the reach, which leaves facets of the block behind
    "leap": [(-0.2, 0.01), (0.2, 0.01)],
}


@pytest.mark.mpi(where=lambda cell_2d, swap, **_: swap and cell_2d == "triangle")
@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("swap", [False, True])
def test_contact_that_is_kept_or_ends_by_itself_is_left_alone(cell_2d, name, swap):
    assert Tool(cell_2d, swap).path(*RIGHT[name]) == []


@pytest.mark.mpi(where=lambda name, **_: name == "slide")
@pytest.mark.parametrize("name", ["pressed", "lift", "slide"])
def test_so_in_3d(cell_3d, name):
    assert Tool(cell_3d).path(*RIGHT[name]) == []


# Bodies that nothing holds


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.1, 5.0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_body_that_nothing_holds_is_named(cell_2d, gap, solver):
    """A block above another, loaded, and free but for what contact would hold."""
    scene = two_blocks(COMM, 2, cell_2d, gap=gap, upper_size=0.5)
    case = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom")], loaded=["top"], load=-1.0
    )
    found = []
    with warnings.catch_warnings(record=True) as caught:
        keep_warnings()
        try:
            solver(case.problem).solve()
        except ConvergenceError as failure:
            found.append(str(failure))
    found += [str(w.message) for w in caught]
    place = f"the body around (0.5, {1.25 + gap:.3g}) is held by nothing along x, y"
    assert any(place in text for text in found), found
