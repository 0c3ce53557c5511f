"""A fault on one rank is raised on all ranks: none is left waiting for the others.

Each test ends, one way or the other, within `PATIENCE`: a rank that waits for ever is
what is tested for. On one rank the faults are only faults.
"""

import faulthandler

import numpy as np
import pytest
import ufl
from dolfinx import fem
from load_paths import top_moves
from problems import COMM, SOLVERS, build, residual
from squeezing import squeezed

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    Friction,
    Penalty,
    Search,
)
from raymortar.core import compat
from raymortar.core.errors import ConvergenceError, require_agreement, together

pytestmark = pytest.mark.mpi
PATIENCE = 100.0  # seconds
ODD = COMM.rank == COMM.size - 1  # the rank at fault
PAIR = [(3, 4)]


@pytest.fixture(autouse=True)
def watch():
    """End the process, and with it the run, if a test hangs."""
    faulthandler.dump_traceback_later(PATIENCE, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture
def scene():
    return two_blocks(COMM, 2, "triangle", 4, 4)


def contact(scene, pairs=PAIR, tags=None, **options):
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    tags = scene.facet_tags if tags is None else tags
    return raymortar.Contact(u, tags, pairs, **options)


def refused_by_all(pattern, action):
    """Every rank raises the same."""
    with pytest.raises(ContactError, match=pattern) as info:
        action()
    assert len(set(COMM.allgather(str(info.value)))) == 1


# Arguments that differ


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
@pytest.mark.parametrize(
    "name, here, there",
    [
        ("method", Penalty(1.0), Penalty(2.0)),
        ("method", Penalty(1.0), AugmentedLagrangian(1.0)),
        ("friction", None, Coulomb(0.3)),
        ("friction", Coulomb(0.2), Coulomb(0.3)),
        ("measure", "current", "reference"),
        ("quadrature_degree", 3, None),
        ("search", Search(reach=1.0), None),
        ("pairs", [(3, 4)], [(3, 4), (3, 2)]),
    ],
)
def test_arguments_must_agree(scene, name, here, there):
    options = {name: here if ODD else there}
    refused_by_all(f"{name} differs between ranks", lambda: contact(scene, **options))


def test_functions_agree_whatever_their_numbers(scene):
    """UFL counts on each rank for itself."""
    V = compat.scalar_space(scene.mesh, 1)
    fields = [fem.Function(V)]
    if ODD:
        ufl.Coefficient(V)
    fields.append(fem.Function(V))
    law = Friction(lambda p, v, fields: sum(fields) * p, fields=fields)
    assert contact(scene, friction=law).friction is law


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
def test_gamma_must_agree(scene):
    c = contact(scene, method=Penalty(1.0))
    refused_by_all(
        "gamma differs between ranks", lambda: c.set_gamma(2.0 if ODD else 3.0)
    )


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
def test_number_of_conditions_must_agree(scene):
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    c = raymortar.Contact(u, scene.facet_tags, PAIR)
    bcs = squeezed(u.function_space, scene)
    bcs = bcs[:-1] if ODD else bcs
    F = residual(scene, u)[0]
    refused_by_all(
        "number_of_conditions differs",
        lambda: raymortar.NonlinearProblem(F, c, bcs),
    )


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
@pytest.mark.parametrize(
    "name, here, there",
    [
        ("steps", 3, 4),
        ("max_halvings", 2, 6),
        ("largest", 2, 1),
        ("easy", 3, 5),
        ("extrapolate", True, False),
        ("path", (0.0, 0.5), (0.0, 1.0)),
    ],
)
def test_paths_must_agree(name, here, there):
    refused_by_all(
        f"{name} differs between ranks",
        lambda: top_moves("triangle", **{name: here if ODD else there}),
    )


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", ["tolerances", "max_it"])
def test_tolerances_must_agree(scene, solver, name):
    """A rank that ends sooner, or goes on, would leave the others waiting."""
    problem = build(scene, bcs=squeezed)
    problem.solver = solver(problem.problem)
    if not ODD:
        pass
    elif name == "tolerances":
        problem.solver.tolerances = 1e-3, 1e-3
    elif solver is raymortar.SNESSolver:
        problem.solver.snes.setTolerances(max_it=3)
    else:
        problem.solver.max_it = 3
    refused_by_all(f"{name} differs between ranks", problem.solve)
    path = raymortar.LoadSteps(problem.solver, lambda t: None, 2, progress=False)
    with pytest.raises(ContactError, match=f"{name} differs between ranks"):
        path.run()


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
def test_solvers_and_their_options_must_agree(scene):
    problem = build(scene, bcs=squeezed).problem
    options = {"snes_max_it": 3 if ODD else 4}
    refused_by_all(
        "options differs between ranks",
        lambda: raymortar.SNESSolver(problem, options),
    )
    if len(SOLVERS) > 1:
        refused_by_all(
            "solver differs between ranks", lambda: SOLVERS[int(ODD)](problem)
        )


def test_numbers_of_numpy_agree_with_those_of_python():
    require_agreement(COMM, a=np.float64(2.5) if ODD else 2.5, b=np.int64(3))


def test_functions_agree_whatever_their_values(scene):
    gamma = fem.Function(compat.space(scene.mesh, "DG", 0))
    gamma.x.array[:] = 1.0 + COMM.rank
    c = contact(scene, method=Penalty(gamma))
    c.update()
    assert c.statistics.hits > 0


# Faults of one rank


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"method": "penalty"}, "method must be AugmentedLagrangian or Penalty"),
        ({"friction": 0.3}, "friction must be Coulomb"),
        ({"quadrature_degree": 99}, "quadrature_degree = 99"),
        ({"pairs": [(3, 3)]}, "tag 3 is slave and master"),
        ({"pairs": []}, "pairs is empty"),
    ],
)
def test_bad_option_on_one_rank(scene, options, pattern):
    refused_by_all(pattern, lambda: contact(scene, **(options if ODD else {})))


@pytest.mark.parametrize(
    "options, pattern",
    [
        (lambda: {"search": Search(reach=-1.0)}, "search reach = -1.0 must not be"),
        (lambda: {"search": Search("octree")}, "search strategy 'octree'"),
        (lambda: {"method": Penalty(-2.0)}, "gamma = -2.0 must be positive"),
        (lambda: {"method": Penalty(2.0, "creep")}, "not 'creep'"),
        (lambda: {"method": AugmentedLagrangian(degree=3)}, "degree 3 is not 1 or 2"),
        (lambda: {"friction": Coulomb(-0.1)}, "mu = -0.1 must not be negative"),
    ],
)
def test_bad_value_of_an_option_on_one_rank(scene, options, pattern):
    refused_by_all(pattern, lambda: contact(scene, **(options() if ODD else {})))


def test_bad_number_of_steps_on_one_rank():
    refused_by_all(
        "steps = 0 must be positive",
        lambda: top_moves("triangle", steps=0 if ODD else 4),
    )


def test_tags_of_another_mesh_on_one_rank(scene):
    other = two_blocks(COMM, 2, "triangle", 4, 4)
    tags = (other if ODD else scene).facet_tags
    refused_by_all("facet_tags are of another mesh", lambda: contact(scene, tags=tags))


def test_tags_that_are_missing_on_one_rank_are_other_ranks_business(scene):
    """A rank without tagged facets is fine as long as some rank has them."""
    found = scene.facet_tags
    keep = found.values != 3 if ODD and COMM.size > 1 else found.values > 0
    tags = compat.meshtags(scene.mesh, 1, found.indices[keep], found.values[keep])
    left = COMM.allreduce(int(np.count_nonzero(tags.values == 3)))
    if left:
        contact(scene, tags=tags, method=Penalty(1.0)).update()
    else:
        refused_by_all(
            "no facet has the slave tag 3", lambda: contact(scene, tags=tags)
        )


def test_gamma_on_another_mesh(scene):
    other = two_blocks(COMM, 2, "triangle", 4, 4)
    gamma = fem.Function(compat.space(other.mesh, "DG", 0))
    gamma.x.array[:] = 1.0
    refused_by_all(
        "gamma is a Function on another mesh",
        lambda: contact(scene, method=Penalty(gamma)),
    )


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, "stiff"])
def test_bad_gamma_on_one_rank(scene, value):
    c = contact(scene, method=Penalty(1.0))
    refused_by_all("gamma", lambda: c.set_gamma(value if ODD else 1.0))
    c.update()
    assert c.gamma == 1.0


@pytest.mark.parametrize("name", ["u", "multiplier"])
def test_value_that_is_not_finite_on_one_rank(scene, name):
    c = contact(scene, method=AugmentedLagrangian(1.0))
    values = getattr(c, name).x.array
    if ODD:
        values[0] = np.nan
    refused_by_all("has 1 entries that are not finite", c.update)
    values[:] = 0.0
    c.update()


@pytest.mark.parametrize("solver", SOLVERS)
def test_solve_from_a_value_that_is_not_finite_on_one_rank(scene, solver):
    problem = build(scene, bcs=squeezed)
    problem.solver = solver(problem.problem)
    # A dof of its own: the others' would be overwritten by their owners
    if ODD:
        problem.u.x.array[0] = np.inf
    refused_by_all("not finite", problem.solve)


def test_state_of_another_size_on_one_rank(scene):
    c = contact(scene, method=Penalty(1.0))
    state = c.state()
    if ODD:
        state["unknown 0"] = state["unknown 0"][:-1]
    with pytest.raises(ValueError):
        c.restore(state)


def test_unknown_part_on_one_rank(scene):
    c = contact(scene, method=Penalty(1.0))
    c.update()
    refused_by_all("part must be", lambda: c.traction("best" if ODD else "total"))


# The means


def test_blocks_raise_together():
    for kind in (ContactError, ConvergenceError, ValueError, IndexError):
        with pytest.raises(kind, match="made up"), together(COMM):
            if ODD:
                raise kind("made up")
    with together(COMM):
        pass


@pytest.mark.skipif(COMM.size == 1, reason="one rank keeps its own")
def test_other_exceptions_become_runtime_errors():
    with pytest.raises(RuntimeError, match=r"made up.*\(rank \d\)"), together(COMM):
        if ODD:
            raise ZeroDivisionError("made up")


def test_agreement_names_the_argument():
    require_agreement(COMM, a=1, b=Coulomb(0.3), c=Penalty(1.0), d=None)


@pytest.mark.parametrize("value", [0.5, -1.0, np.nan, "soon"])
def test_times_of_a_step(scene, value):
    found = contact(scene, friction=Coulomb(0.3))

    def set_dt():
        found.dt = value if ODD else 0.25

    if COMM.size == 1 and value == 0.5:
        return set_dt()
    pattern = "dt differs between ranks" if value == 0.5 else "dt = .* must be a pos"
    refused_by_all(pattern, set_dt)
    assert found.dt == 1.0


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_laws_of_friction(scene, scale):
    """One that differs from some pressure on."""

    def law(most):
        return Friction(lambda p, v, x: np.minimum(0.3 * p, most))

    contact(scene, friction=law(scale))
    if COMM.size > 1:
        refused_by_all(
            "Friction.bound differs between ranks",
            lambda: contact(scene, friction=law(scale * (2.0 if ODD else 1.0))),
        )
