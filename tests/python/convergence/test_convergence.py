"""When a solve may end: in any unit, at any ratio of stiffnesses, on any ranks."""

from petsc4py import PETSc

import numpy as np
import pytest
from dolfinx import fem
from load_paths import blocks, top_moves
from problems import COMM, DIMENSION, SOLVERS, build, fix, stack, worst

from meshes.scenes import two_blocks
from raymortar import ConvergenceError, Coulomb, NewtonSolver, Penalty, SNESSolver

# Lengths 1e-9 to 1e6, moduli 1e-6 to 1e12
UNITS = [(1.0, 2e11), (1e-3, 1e6), (1e-9, 1e12), (1e-9, 1e-6), (1e6, 1e-6), (1e6, 1e12)]
GAP = 0.01
# Of the upper block, in its sizes: across the gap in two steps, then into the lower one
PATH = (0.004, 0.008, 0.02, 0.03)
FULL, SEARCH = {"snes_linesearch_type": "basic"}, {"snes_linesearch_type": "bt"}
WAYS = [(SNESSolver, FULL), (SNESSolver, SEARCH)]
WAYS += [(NewtonSolver, None)] if NewtonSolver in SOLVERS else []
LAWS = {
    "frictionless": lambda: {},
    "coulomb": lambda: {"friction": Coulomb(0.3)},
    "penalty": lambda: {"method": Penalty()},
    "springs": lambda: {"method": Penalty(), "friction": Coulomb(0.3)},
}


class Tool:
    """A narrow block above a wide one, across a gap: held at all dofs, or at its top."""

    def __init__(self, cell, law="frictionless", L=1.0, E=1.0, rigid=True, tool_E=1.0):
        dim = DIMENSION[cell]
        n, m = (5, 4) if dim == 2 else (3, 2)
        sizes = {"upper_size": (0.6 * L,) * dim, "lower_size": (L,) * dim}
        self.scene = two_blocks(COMM, dim, cell, n, m, gap=GAP * L, **sizes)
        self.top = fem.Constant(self.scene.mesh, np.zeros(dim, PETSc.ScalarType))
        self.L, self.E, self.dim, self.side = L, E, dim, 0.0
        self.friction = "friction" in LAWS[law]()
        # The tool is the master: no multiplier is held
        self.problem = build(
            self.scene,
            E={"lower": E, "upper": tool_E * E},
            bcs=lambda V, scene: self.conditions(V, scene, rigid),
            swap=True,
            **LAWS[law](),
        )

    def conditions(self, V, scene, rigid):
        lower = fix(V, scene, "bottom")
        if not rigid:
            return [lower, fix(V, scene, "top", None, self.top)]
        self.held = np.flatnonzero(self.upper(V)).astype(np.int32)
        return [lower, fem.dirichletbc(self.top, self.held, V)]

    def upper(self, V):
        return V.tabulate_dof_coordinates()[:, self.dim - 1] > self.L * (1 + GAP / 2)

    def move(self, share):
        self.top.value[-1] = -share * self.L
        self.top.value[0] = 0.2 * share * self.L if self.friction else 0.0

    def follow(self, solver, options=None, path=PATH):
        """Iterations of each step, or what the failure said."""
        problem = self.problem
        problem.solver = solver(problem.problem, options)
        found = []
        for share in path:
            self.move(share)
            try:
                found.append(problem.solve())
            except ConvergenceError as failure:
                return found + [str(failure)]
            problem.contact.advance()
        return found

    def off(self):
        """How far the upper block's held dofs are from where they should be, relative."""
        u = self.problem.u.x.array.reshape(-1, self.dim)[self.held]
        return worst(u - self.top.value) / worst(self.top.value)

    def force(self):
        """Of the lower support, in stresses times areas."""
        supports = {"lower": self.problem.problem.bcs[0]}
        force = self.problem.problem.reactions(supports)["lower"]
        return force / (self.E * self.L ** (self.dim - 1))


# A prescribed body


@pytest.mark.mpi(
    where=lambda cell, L, **_: (cell, L) in (("triangle", 1.0), ("hexahedron", 1e6))
)
@pytest.mark.quick
@pytest.mark.parametrize("solver, options", WAYS)
@pytest.mark.parametrize("L, E", UNITS)
def test_a_prescribed_body_moves_across_a_gap(cell, L, E, solver, options):
    tool = Tool(cell, L=L, E=E)
    # The second step is far below the rounding error of all forces
    assert tool.follow(solver, options, PATH[:1]) == [1]
    assert tool.off() <= 1e-15
    assert tool.follow(solver, options, [PATH[0] * (1 + 1e-13)]) == [1]
    assert tool.off() <= 1e-15
    assert tool.follow(solver, options, [PATH[0] * (1 + 1e-13)]) == [0]


@pytest.mark.mpi(
    where=lambda cell, law, solver, options: law == "springs"
    and (cell, options) in (("triangle", FULL), ("tetrahedron", SEARCH))
)
@pytest.mark.parametrize("solver, options", WAYS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
def test_units_change_no_iteration(cell, law, solver, options):
    first = Tool(cell, law)
    iterations, force = first.follow(solver, options), first.force()
    print(iterations)
    if options == SEARCH or law in ("frictionless", "penalty"):
        assert iterations[:2] == [1, 1] and len(iterations) == len(PATH)
    for L, E in UNITS:
        other = Tool(cell, law, L, E)
        found = other.follow(solver, options)
        # Full steps with springs cycle in every unit (docs/measured/solving.md)
        assert len(found) == len(iterations)
        if isinstance(iterations[-1], str):
            assert isinstance(found[-1], str) and "reason -9" not in found[-1]
            continue
        assert found == iterations
        assert other.off() <= 1e-15
        assert worst(other.force() - force) <= 1e-9 * worst(force)


@pytest.mark.mpi
@pytest.mark.parametrize("solver, options", WAYS)
def test_line_search_sees_a_soft_tool_in_any_unit(solver, options):
    iterations = Tool("quadrilateral", "springs", rigid=False).follow(solver, options)
    for L, E in UNITS:
        other = Tool("quadrilateral", "springs", L, E, rigid=False)
        found = other.follow(solver, options)
        assert len(found) == len(iterations)
        if not isinstance(iterations[-1], str):
            assert found == iterations


@pytest.mark.mpi
def test_stiffness_of_a_prescribed_body_counts_for_nothing():
    found = [
        Tool("triangle", "springs", tool_E=stiffness).follow(SNESSolver, SEARCH)
        for stiffness in (1.0, 1e-9, 1e9)
    ]
    assert found[1:] == found[:1] * 2 and not isinstance(found[0][-1], str)


# Stiffness ratios


RATIOS = [10.0**k for k in (0, 4, 6, 7, 8, 9, 10, 11, 12)]


def pressed(cell, ratio, soft, swap, material="linear"):
    """Soft and stiff block, pressed by 5 % in one step."""
    dim = DIMENSION[cell]
    down = -0.05 * np.eye(dim)[-1]
    stiff = {"lower": "upper", "upper": "lower"}[soft]
    return build(
        blocks(cell, upper_size=(0.6,) * dim),
        material=material,
        E={soft: 1.0, stiff: ratio},
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", value=lambda x: x[:, -1:] * down),
        ],
        swap=swap,
    )


def forces(problem, soft):
    """Contact's force, and that of the soft body's support."""
    names = {"lower": problem.problem.bcs[0], "upper": problem.problem.bcs[1]}
    support = problem.problem.reactions(names)[soft]
    return abs(problem.contact.resultant().force[-1]), abs(support[-1])


@pytest.mark.mpi(
    where=lambda cell, soft, swap, solver: solver is SOLVERS[0]
    and soft == "lower"
    and swap is (cell == "triangle")
)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("soft", ["lower", "upper"])
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_a_soft_body_is_solved_beside_a_stiff_one(cell, soft, swap, solver):
    found, counts = [], []
    for ratio in RATIOS:
        problem = pressed(cell, ratio, soft, swap)
        counts.append(problem.solve(solver))
        contact, support = forces(problem, soft)
        assert abs(contact - support) <= 1e-9 * support
        found.append(contact)
    print(counts, found)
    # What is left of the stiff body's strain is one over the ratio
    rigid = found[-1]
    for ratio, force in zip(RATIOS[1:], found[1:]):
        assert abs(force - rigid) <= (10.0 / ratio + 1e-9) * rigid
    assert max(counts) <= 6


@pytest.mark.mpi
@pytest.mark.parametrize("ratio", [1e3, 1e9])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_soft_body_that_deforms_much_is_solved_too(solver, ratio):
    problem = pressed("triangle", ratio, "lower", False, "neo-hookean")
    problem.solve(solver)
    contact, support = forces(problem, "lower")
    assert abs(contact - support) <= 1e-9 * support


# Tolerances of the user


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_an_absolute_tolerance_ends_at_once(solver):
    first = pressed("triangle", 1.0, "lower", False, "neo-hookean")
    first.solve(solver)
    atol = 1.5 * first.history[2]
    problem = pressed("triangle", 1.0, "lower", False, "neo-hookean")
    problem.solver = solver(problem.problem)
    problem.solver.tolerances = problem.solver.tolerances[0], atol
    assert problem.solve() == 2
    # But not before a prescribed displacement is there
    tool = Tool("triangle")
    tool.problem.solver = solver(tool.problem.problem)
    tool.problem.solver.tolerances = 1e-10, 1e300
    tool.move(PATH[0])
    assert tool.problem.solve() == 1 and tool.off() <= 1e-15
    assert tool.problem.solver.tolerances == (1e-10, 1e300)


@pytest.mark.mpi
@pytest.mark.parametrize("L, E", [(1.0, 1.0), *UNITS])
@pytest.mark.skipif(NewtonSolver not in SOLVERS, reason="DOLFINx has none")
def test_increments_are_compared_with_increments(L, E):
    tool = Tool("triangle", L=L, E=E, rigid=False)
    tool.problem.solver = NewtonSolver(tool.problem.problem)
    tool.problem.solver.convergence_criterion = "incremental"
    # From 0.018 on rounding decides which points of the flat block are closed first
    tool.move(0.015)
    assert tool.problem.solve() == 5
    force = tool.force()[-1]
    tool.problem.solver.convergence_criterion = "residual"
    tool.problem.solve(rtol=1e-13)
    assert abs(tool.force()[-1] - force) <= 1e-9 * abs(force)


@pytest.mark.mpi
@pytest.mark.skipif(NewtonSolver not in SOLVERS, reason="DOLFINx has none")
def test_shortened_steps_end_where_the_tolerance_says():
    tool = Tool("triangle")
    tool.problem.solver = NewtonSolver(tool.problem.problem)
    tool.problem.solver.relaxation_parameter = 0.5
    tool.move(PATH[0])
    assert tool.problem.solve(rtol=1e-6) == 20
    assert 1e-7 <= tool.off() <= 1e-6


@pytest.mark.mpi
def test_divergence_is_of_forces_where_it_is_asked_for():
    def solve(options, path=PATH, rigid=True):
        tool = Tool("triangle", "springs", rigid=rigid)
        return str(tool.follow(SNESSolver, {**FULL, **options}, path)[-1])

    # Nothing is in contact at first, so that the first residual has no force
    assert "reason -9" not in solve({})
    assert "reason -9" not in solve({"snes_divergence_tolerance": 1e4})
    # A long step: the springs' forces are ten times those of the bodies before it
    assert "reason -9" in solve({"snes_divergence_tolerance": 2.0}, (0.3,), False)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_extrapolated_steps_need_no_tolerance_of_their_own(solver):
    # Their first residual is rounding error already, or next to it
    problem, steps = top_moves("quadrilateral", solver, 8, 0.02, extrapolate=True)
    problem.solve(rtol=1e-10)
    counts = [step.iterations for step in steps]
    print(counts)
    assert steps.halvings == 0 and max(counts) <= 4


# Bodies


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_bodies_and_surfaces_are_counted_on_any_ranks(cell):
    pairs = [("bottom_1", "top_0"), ("bottom_2", "top_1")]
    problem = build(stack(cell, (3, 4, 2, 3)), pairs=pairs, bcs=lambda V, s: [])
    groups = problem.problem.convergence.groups
    assert (groups.bodies, groups.count) == (4, 6)
    n = [nodes**problem.dim * problem.dim for nodes in (4, 5, 3, 4)]
    n += [nodes ** (problem.dim - 1) for nodes in (5, 3)]
    sizes = groups.sum(np.ones(problem.contact.layout.size))
    assert sorted(sizes[:4]) == sorted(n[:4]) and sorted(sizes[4:]) == sorted(n[4:])
    area = groups.sum(
        np.concatenate([np.zeros(problem.contact.layout.n_u), groups.mass])
    )
    np.testing.assert_allclose(area[4:], 1.0, rtol=1e-13)
    assert len(set(groups.names())) == 6


@pytest.mark.mpi
@pytest.mark.parametrize("solver, options", WAYS)
def test_failures_name_what_is_out_of_balance(solver, options):
    tool = Tool("triangle", rigid=False)
    tool.problem.solver = solver(tool.problem.problem, options)
    if solver is SNESSolver:
        tool.problem.solver.snes.setTolerances(max_it=1)
    else:
        tool.problem.solver.max_it = 1
    tool.move(0.05)
    with pytest.raises(
        ConvergenceError, match=r"out of balance: the (body|contact) around \(0\.5, "
    ):
        tool.problem.solve()


def test_tractions_that_vanish_are_no_reason_to_go_on():
    """A patch that opens has only its residual for a force, which falls by itself."""
    convergence = Tool("triangle").problem.problem.convergence
    of_patch = convergence.groups.bodies
    body, zero = np.ones(convergence.groups.count), np.zeros(1)
    body[of_patch] = 0.0
    found = []
    convergence.start()
    for residual, traction in ((1.0, 0.0), (1e-3, 1.0), (1e-13, 1e-17), (1e-13, 1e-33)):
        forces = residual * body
        forces[of_patch] = traction
        convergence.measure((forces, forces, zero, zero))
        convergence.accept()
        found.append(convergence.reached(1e-9, None))
    assert found[:2] == [False, False] and found[-1]


def test_the_iteration_is_the_last_one_where_its_square_ends_the_solve():
    """Each residual falls by the square of what the one before fell by."""
    convergence = Tool("triangle").problem.problem.convergence
    one = np.ones(convergence.groups.count)
    found = []
    for residual in (1.0, 1e-2, 5e-5, 1e-9):
        none = np.zeros_like(one)
        convergence.measure((residual * one, one, none, one))
        convergence.accept()
        found.append((convergence.reached(1e-8, None), convergence.is_last))
    assert found == [(False, False)] * 2 + [(False, True), (True, True)]
    convergence.start()
    assert not convergence.is_last
