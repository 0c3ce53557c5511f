"""What a scene does not need is not done: counters of `Contact.statistics`."""

import gathered
import numpy as np
import pytest
from problems import COMM, build, stack
from squeezing import squeezed

import raymortar
from raymortar import AugmentedLagrangian, Coulomb, Penalty
from raymortar.core import compat
from raymortar.core.system import assembly

FAR = {"gaps": [0.0, 0.5]}  # out of reach of each other


def lift(case, by):
    """Move the upper block by a vector."""
    upper = case.scene.cell_tags.find(case.scene.bodies["1"])
    by = np.asarray(by, dtype=np.float64)[:, None]
    case.u.interpolate(lambda x: by + np.zeros((case.dim, x.shape[1])), upper)
    case.u.x.scatter_forward()


def assemble(case, A=None):
    """Residual and tangent at the present state."""
    contact, problem = case.contact, case.problem
    A = problem.create_matrix() if A is None else A
    contact.update()
    contact.assemble_vector(problem.create_vector())
    contact.assemble_matrix(A)
    A.assemble()
    return A


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_far_facets_are_culled_before_clipping(cell):
    # Boxes meet, as skin and depth make them large, but no facet is within reach
    search = raymortar.Search(reach=0.1, depth=1.0, skin=1.0)
    case = build(stack(cell, (3, 4), **FAR), search=search)
    case.contact.update()
    far = case.contact.statistics
    assert far.candidates > 0
    assert far.culled == far.candidates and far.clipped == 0 == far.segments
    dim = case.dim
    lift(case, [0.0] * (dim - 1) + [-0.45])
    case.contact.update()
    assert case.contact.statistics.clipped > 0


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
def test_open_segments_give_no_tangent(friction):
    case = build(stack("triangle", (3, 4)), method=Penalty(1e3), friction=friction)
    lift(case, (0.0, 1e-3))
    A = assemble(case)
    open_ = case.contact.statistics
    assert open_.hits == open_.points > 0 == open_.active_points
    assert open_.tangent_blocks == 0 < open_.skipped_blocks == open_.pairs
    assert A.norm() == 0.0
    lift(case, (0.0, -1e-3))
    assemble(case, A)
    closed = case.contact.statistics
    assert closed.tangent_blocks == closed.pairs > 0
    assert closed.skipped_blocks == open_.skipped_blocks
    assert A.norm() > 0.0


@pytest.mark.mpi
def test_a_segment_that_is_closed_in_one_point_is_not_skipped():
    """Tilted over the master: tangent blocks are those with an active point."""
    case = build(stack("quadrilateral", (3, 4)), method=Penalty(1e3))
    case.u.interpolate(lambda x: np.vstack([0 * x[0], (x[1] >= 1.0) * (x[0] - 0.47)]))
    lower = case.scene.cell_tags.find(case.scene.bodies["0"])
    case.u.interpolate(lambda x: np.zeros((2, x.shape[1])), lower)
    assemble(case)
    points = case.contact.points()
    active = points["status"] >= 2
    pairs = np.column_stack([points["slave"], points["master"]])
    assert 0 < COMM.allreduce(active.sum()) < COMM.allreduce(len(active))
    count = COMM.allreduce(len(np.unique(pairs[active], axis=0)))
    assert case.contact.statistics.tangent_blocks == count


@pytest.mark.mpi
def test_frictionless_does_no_tangential_work():
    scene = stack("triangle", (3, 4))
    for friction in (None, Coulomb(0.3)):
        case = build(scene, friction=friction)
        assemble(case)
        s = case.contact.statistics
        assert s.slip_points == (s.hits if friction else 0)
        # Tangential unknowns exist with friction only
        components = case.contact.layout.components
        assert components == (2 if friction else 1)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
def test_residuals_build_no_tangent(cell, monkeypatch):
    case = build(stack(cell, (2, 3)), bcs=squeezed)
    problem = case.problem
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    first = case.contact.statistics
    assert first.residual_blocks > 0 == first.tangent_blocks
    # Fulfil the Dirichlet conditions: there is nothing to lift any more
    compat.set_bc(case.u.x.array, problem.bcs)
    monkeypatch.setattr(compat, "apply_lifting", pytest.fail)  # the volume's
    for rounding in (0.0, np.finfo(float).eps):
        case.u.x.array[:] *= 1.0 + rounding
        x = problem.start()
        problem.F(x, b)
        second = case.contact.statistics
        assert second.residual_blocks > first.residual_blocks
        assert second.tangent_blocks == 0
        assert second.lifted_blocks == first.lifted_blocks


@pytest.mark.mpi
@pytest.mark.quick
def test_unchanged_configuration_is_not_paired_again():
    case = build(stack("triangle", (3, 4)))
    contact = case.contact
    contact.update()
    first = contact.statistics
    reference = contact.points()
    for _ in range(3):
        contact.update()
    again = contact.statistics
    assert again.pairings == first.pairings
    assert again.pairings_skipped > first.pairings_skipped
    assert again.candidate_builds == first.candidate_builds
    for name, values in contact.points().items():
        assert np.array_equal(values, reference[name]), name
    # A change of a few bits is seen
    case.u.x.array[:] += 1e-15
    contact.update()
    assert contact.statistics.pairings > again.pairings


@pytest.mark.mpi
def test_kept_points_are_made_anew_once_asked_for():
    """Rays at another displacement leave the points of the old one."""
    case = build(stack("triangle", (3, 4)))
    contact = case.contact
    contact.update()
    start = gathered.points(contact)
    lift(case, (0.07, 0.0))
    contact.update(pair=False)
    kept = gathered.points(contact)
    assert np.array_equal(kept["xi"], start["xi"])
    assert not np.array_equal(kept["eta"], start["eta"])
    contact.update()
    moved = gathered.points(contact)
    lift(case, (0.0, 0.0))
    contact.update()
    assert not np.array_equal(moved["xi"].shape, kept["xi"].shape) or not np.allclose(
        moved["xi"], kept["xi"]
    )
    for name, values in gathered.points(contact).items():
        assert np.array_equal(values, start[name]), name


@pytest.mark.mpi
def test_unchanged_pattern_is_not_allocated_again():
    case = build(stack("triangle", (3, 4)))
    contact, A = case.contact, case.problem.create_matrix()
    assert contact.statistics.preallocations == 1
    assert not contact.make_room(A)
    lift(case, (1e-9, 0.0))
    contact.update()
    assert not contact.make_room(A)
    assert contact.statistics.preallocations == 1
    lift(case, (0.4, 0.0))
    contact.update()
    assert contact.make_room(A)
    assert contact.statistics.preallocations == 2


@pytest.mark.mpi
@pytest.mark.parametrize("method", [AugmentedLagrangian(1e3), Penalty(1e3)])
def test_pairs_out_of_reach_cost_nothing(method):
    search = raymortar.Search(reach=0.1, depth=0.1)
    case = build(stack("triangle", (3, 4), **FAR), method=method, search=search)
    assemble(case)
    s = case.contact.statistics
    assert s.pairs == s.segments == s.hits == 0
    if isinstance(method, Penalty):
        assert case.contact.multiplier is None
        assert case.contact.layout.size_global == gathered.size_u(case.contact)
        assert s.points == s.tangent_blocks == s.residual_blocks == 0
    else:
        # One small block per facet drives the multiplier to zero
        assert s.tangent_blocks == s.residual_blocks == s.slave_facets


@pytest.mark.mpi
def test_what_conditions_mean_is_found_once(monkeypatch):
    """Reactions are sums of forces without conditions, solves have some: nothing is found
    anew where they take turns. Their results do not hang on what was known."""
    asked = []

    def moduli(surfaces, volume, bcs):
        asked.append(len(bcs))
        return found(surfaces, volume, bcs)

    found = assembly.shear_moduli
    monkeypatch.setattr(assembly, "shear_moduli", moduli)
    case = build(stack("triangle", (3, 4)), bcs=squeezed)
    problem, supports = case.problem, {"all": case.problem.bcs}
    solver = raymortar.SNESSolver(problem)
    forces = []
    for _ in range(3):
        solver.solve()
        forces.append(problem.reactions(supports)["all"])
    assert sorted(asked) == [0, len(problem.bcs)]
    assert np.ptp(forces, axis=0) == pytest.approx(0.0, abs=1e-12)
    problem.reactions({})
    other = problem.bcs[:1]
    case.contact.system.constrained(other)
    case.contact.system.constrained(problem.bcs)
    case.contact.system.constrained(other)
    assert sorted(asked) == [0, len(other), len(problem.bcs), len(problem.bcs)]
