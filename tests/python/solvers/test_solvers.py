"""Iterative solvers: the direct solver's answer, and iterations that stay few."""

import numpy as np
import pytest
from interacting import Stack
from problems import COMM, SOLVERS, build, fix, stack, tolerate, worst

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, SNESSolver, solvers
from raymortar.core import compat
from raymortar.solvers import automatic
from raymortar.solvers.levels import near_nullspace

METHODS = {"augmented": AugmentedLagrangian, "penalty": lambda: Penalty(200.0)}
FRICTIONS = {"frictionless": None, "friction": Coulomb(0.3)}


def blocks(method, friction, n=2, gamma=None):
    """A block pressed on another, and sheared where there is friction."""
    scene = two_blocks(
        COMM,
        3,
        "hexahedron",
        lower_divisions=(4 * n, 4 * n, 2 * n),
        upper_divisions=(3 * n, 3 * n, 2 * n),
        lower_size=(1.0, 1.0, 0.5),
        upper_size=(0.8, 0.8, 0.5),
    )
    push = (0.004 if friction else 0.0, 0.0, -0.02)

    def held(V, scene):
        top = fix(V, scene, "top", value=lambda x: np.tile(push, (len(x), 1)))
        return [fix(V, scene, "bottom"), top]

    method = METHODS[method]() if gamma is None else AugmentedLagrangian(gamma)
    return build(scene, 1, "neo-hookean", method, E=10.0, bcs=held, friction=friction)


def solution(problem, options, solver=SNESSolver):
    """Displacement and multiplier at the solution, and the Krylov iterations."""
    problem.solver = solver(problem.problem, options)
    krylov, steps = problem.solver.krylov_solver, []
    krylov.setMonitor(lambda ksp, i, norm: steps.append(i))
    problem.solve(rtol=1e-12)
    ends = [a for a, b in zip(steps, [*steps[1:], 0]) if b == 0]
    return problem.problem.start().array.copy(), max(ends)


@pytest.mark.mpi
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("multigrid", automatic.MULTIGRIDS)
def test_answer_is_that_of_the_direct_solver(multigrid, method, friction):
    case = method, FRICTIONS[friction]
    # On one mesh: another of the same scene may be cut differently between ranks
    problem = blocks(*case)
    start = problem.contact.state()
    direct, _ = solution(problem, None)
    problem.contact.restore(start)
    iterative, iterations = solution(problem, solvers.iterative(multigrid))
    assert worst(iterative - direct) <= 1e-8 * worst(direct)
    assert 2 < iterations < 40


# A scalar multiplier beside a vector one; with a penalty between them, which has none
INTERACTIONS = {
    "two multipliers": [{"friction": Coulomb(0.3)}, {}],
    "a penalty too": [
        {"friction": Coulomb(0.3)},
        {"method": Penalty(100.0), "friction": Coulomb(0.3)},
        {},
    ],
}


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", INTERACTIONS)
def test_several_multipliers_are_eliminated_together(kind, solver):
    several = INTERACTIONS[kind]
    heights, n = len(several) + 1, (3, 4, 2, 3)
    scene = stack("hexahedron", n[:heights], widths=(1.4, 1.0, 1.2, 1.0)[:heights])
    blocks = Stack(scene, ["bottom_0"], [f"top_{heights - 1}"])
    pairs = [(f"bottom_{i + 1}", f"top_{i}") for i in range(heights - 1)]
    contacts = [blocks.contact(p, **options) for p, options in zip(pairs, several)]
    problem = blocks.problem(contacts)
    start, found, counts = problem.contact.state(), [], []
    blocks.move(1.0)
    for options in (None, solvers.iterative(ksp_rtol=1e-10)):
        problem.contact.restore(start)
        one, steps = solver(problem, options), []
        one.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
        tolerate(one, rtol=1e-12)
        one.solve()
        found.append(problem.start().array.copy())
        counts.append(max(steps, default=0))
    assert worst(found[1] - found[0]) <= 1e-8 * worst(found[0])
    assert 2 < counts[1] < 70
    assert all(contact.resultant().force[-1] > 0.0 for contact in contacts)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_either_solver_takes_the_options(solver):
    problem = blocks("augmented", None)  # of n=1 all is near contact
    _, iterations = solution(problem, solvers.iterative(), solver)
    assert 2 < iterations < 40
    context = problem.solver.krylov_solver.getPC().getPythonContext()
    assert context.contact is problem.contact


@pytest.mark.mpi
def test_iterations_hardly_depend_on_gamma():
    gamma = blocks("augmented", None).contact.gamma
    counts = [
        solution(blocks("augmented", None, gamma=f * gamma), solvers.iterative())[1]
        for f in (0.01, 1.0, 100.0)
    ]
    assert max(counts) <= 1.5 * min(counts)


@pytest.mark.parametrize("friction", FRICTIONS)
def test_iterations_hardly_grow_with_refinement(friction):
    # Of n=1 all, of n=2 half is near contact and solved exactly
    counts = [
        solution(blocks("augmented", FRICTIONS[friction], n), solvers.iterative())[1]
        for n in (3, 4, 5)
    ]
    assert max(counts) <= 1.3 * counts[0]


@pytest.mark.mpi
def test_options_are_those_of_the_prefix():
    problem = blocks("augmented", None, n=1)
    options = solvers.iterative(
        ksp_type="fgmres",
        displacement_ksp_type="gmres",
        displacement_ksp_max_it=7,
        displacement_pc_type="sor",
    )
    solution(problem, options)
    krylov = problem.solver.krylov_solver
    inner = krylov.getPC().getPythonContext().solver
    assert krylov.getType() == "fgmres"
    assert inner.getType() == "gmres" and inner.getPC().getType() == "sor"
    assert inner.getTolerances()[3] == 7


def test_internals_have_other_places():
    with pytest.warns(
        DeprecationWarning, match="is raymortar.solvers.levels.near_null"
    ):
        assert solvers.near_nullspace is near_nullspace
    with pytest.raises(AttributeError, match="no attribute 'lagged'"):
        solvers.lagged


def test_unknown_multigrid_is_refused():
    with pytest.raises(ValueError, match="multigrid must be one of .* not 'ml'"):
        solvers.iterative("ml")


@pytest.mark.mpi
def test_rigid_motions_cost_no_energy():
    """The motions of multigrid's coarse levels are those of the volume's kernel."""
    problem = blocks("penalty", None, n=1)
    K = problem.problem.create_matrix()
    problem.contact.u.x.array[:] = 0.0
    compat.assemble_jacobian(K, problem.problem.a, [])
    K.assemble()
    near = near_nullspace(problem.contact).getVecs()
    assert len(near) == 6
    for i, v in enumerate(near):
        assert [abs(v.dot(w)) for w in near] == pytest.approx(np.eye(6)[i], abs=1e-12)
        assert (K * v).norm() <= 1e-12 * K.norm()
