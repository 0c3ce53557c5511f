"""Shallow ironing on a coarse mesh: the demo's problem, with gates that are physics.

References for the forces come from the same problem on a mesh twice as fine (demo,
``--fine``), which agrees with code_aster and GetFEM to 0.2 %.
"""

import importlib
import sys
from functools import partial
from pathlib import Path

import gathered
import numpy as np
import pytest
from problems import COMM

import raymortar
from meshes import ironing
from raymortar.io.partitions import strips

MODELS = str(Path(__file__).resolve().parents[2] / "benchmarks")
PRESS, SLIDE, END = 20, 100, 1.2
V_PRESSED, V_SLID, H_SLID = 330.5, 416.6, 127.2


@pytest.fixture(scope="module")
def demo():
    """The model as a module."""
    sys.path.insert(0, MODELS)
    yield importlib.import_module("models.shallow_ironing")
    sys.path.remove(MODELS)


@pytest.fixture(scope="module")
def run(demo):
    """Rows of a path, computed once for each set of options."""
    done = {}

    def solve(until=END, press=PRESS, **options):
        key = (until, press, *sorted(options.items()))
        if key not in done:
            model = demo.Ironing(COMM, 60, **options)
            done[key] = list(model.path(0.0, press, SLIDE, until))
        return done[key]

    return solve


def column(rows, name):
    return np.array([getattr(row, name) for row in rows])


def mean_iterations(rows):
    return column(rows, "iterations").mean()


@pytest.mark.mpi
def test_contact_carries_the_reaction(demo, run):
    """The force that the integration points add up to is the stress' at the top."""
    assert demo.references.imbalance(run()) < 1e-8


@pytest.mark.mpi
def test_forces_are_those_of_the_fine_mesh(demo, run):
    rows = run()
    assert demo.references.at(rows, 1.0).V == pytest.approx(V_PRESSED, rel=0.01)
    assert rows[-1].V == pytest.approx(V_SLID, rel=0.02)
    assert rows[-1].H == pytest.approx(H_SLID, rel=0.04)


@pytest.mark.mpi
def test_nothing_is_felt_before_contact_and_more_and_more_after(demo, run):
    rows = [row for row in run() if row.t <= 1.0]
    gap = [row for row in rows if row.t < 0.2 - 1e-9]
    pressed = [row for row in rows if row.t > 0.2 + 1e-9]
    assert len(gap) == 3
    assert max(abs(row.V) for row in gap) < 1e-6
    # The reaction grows, and ever faster: the contact widens
    assert np.all(np.diff(column(pressed, "V"), 2) > 0.0)
    assert np.all(np.diff(column(pressed, "V")) > 0.0)


@pytest.mark.mpi
def test_slip_begins_once_and_friction_stays_at_its_limit(run):
    """H rises to a plateau little above mu V: the indenter climbs its own trough."""
    rows = [row for row in run() if row.t >= 1.0]
    ratio = column(rows, "H") / column(rows, "V")
    assert ratio[0] < 0.25
    assert np.all(np.diff(ratio[:4]) > 0.0)
    assert np.all((0.28 < ratio[5:]) & (ratio[5:] < 0.36))


@pytest.mark.mpi
def test_the_cone_is_reached_in_sliding_and_not_exceeded(demo):
    """The multiplier is on Coulomb's cone in the mean, and against the motion."""
    model = demo.Ironing(COMM, 60)
    list(model.path(0.0, 10, SLIDE, 1.1))
    points = gathered.points(model.contact)
    inside = points["status"] >= 2
    lam, n, w = (points[name][inside] for name in ("traction", "normal", "weight"))
    normal = np.einsum("qi,qi->q", lam, n)
    tangential = np.linalg.norm(lam - normal[:, None] * n, axis=1)
    assert w @ tangential == pytest.approx(-demo.FRICTION * (w @ normal), rel=0.01)
    # Friction on the indenter points back along its path; at the ends of the contact
    # the multiplier's hat functions reach out of it, and hold it in the mean only
    well = normal < 0.1 * normal.min()
    assert well.sum() > 20
    assert np.all((lam - normal[:, None] * n)[well, 0] < 0.0)


@pytest.mark.mpi
def test_without_friction_nothing_resists_the_slide(demo, run):
    rows = run(friction=0.0)
    pressed, slid = demo.references.at(rows, 1.0), rows[-1]
    # Near the free edge of the foundation even a frictionless indenter is pushed
    assert pressed.H > 0.05 * pressed.V
    assert abs(slid.H) < 0.02 * slid.V


def test_the_coefficient_does_not_matter_over_two_decades(run):
    """Where it times the slip of a step (0.1 mm) is a quarter of the friction or more."""
    soft, middle, hard = (run(until=1.1, gamma=g) for g in (300.0, 3000.0, 30000.0))
    for rows in (soft, hard):
        assert rows[-1].halvings == 0
        for name in "VH":
            a, b = column(rows, name)[-1], column(middle, name)[-1]
            assert a == pytest.approx(b, rel=0.01)


@pytest.mark.mpi
def test_no_step_is_cut_and_newton_takes_few_iterations(run):
    rows = run()
    assert rows[-1].halvings == 0
    assert mean_iterations(rows) < 7.5


def test_steps_of_half_a_facet_repeat_the_one_before_the_last(run):
    """Every other step is like the one before it: the change that fits better leads."""
    rows = run()[-10:]
    assert np.isclose(10.0 / SLIDE, 0.5 * 12.0 / 60)  # slip of a step, facet
    assert mean_iterations(rows) <= 5.5  # 6.4 from where the last step alone leads


def test_extrapolation_saves_iterations_and_changes_nothing(run):
    plain, extrapolated = run(until=1.1, extrapolate=False), run(until=1.1)
    for name in "VH":
        np.testing.assert_allclose(
            column(plain, name), column(extrapolated, name), atol=1e-5
        )
    assert mean_iterations(extrapolated) < mean_iterations(plain) - 0.5


def test_a_failure_of_the_extrapolated_start_cuts_no_step(demo, run):
    """The step is then solved from the accepted state, which a failure must not touch."""
    model = demo.Ironing(COMM, 60)
    contact, solve = model.contact, model.solver.solve
    failures = []

    def failing():
        if not np.array_equal(contact.u.x.array, contact.states.u_old):
            failures.append(model.motion.value.copy())
            contact.u.x.array[:] = 1e3
            contact.multiplier.x.array[:] = 1e3
            raise raymortar.ConvergenceError("made up")
        return solve()

    model.solver.solve = failing
    rows = list(model.path(0.0, PRESS, SLIDE, 1.05))
    plain = [row for row in run(until=1.1, extrapolate=False) if row.t < 1.05 + 1e-9]
    # Not the first step of each of the two directions
    assert len(failures) == len(rows) - 2
    assert rows[-1].halvings == 0
    np.testing.assert_array_equal(column(rows, "V"), column(plain, "V"))


@pytest.mark.mpi
def test_a_checkpoint_goes_on_where_the_path_stopped(demo, run, folder):
    first = demo.Ironing(COMM, 60)
    rows = list(first.path(0.0, PRESS, SLIDE, 1.03))
    demo.long_runs.save(folder / "ironing.npz", first.contact, rows)

    second = demo.Ironing(COMM, 60)
    rows, _ = demo.long_runs.load(folder / "ironing.npz", second.contact, demo.Row)
    rows += second.path(rows[-1].t, PRESS, SLIDE, 1.06)
    expected = [row for row in run() if row.t < 1.06 + 1e-9]
    assert [row.t for row in rows] == pytest.approx([row.t for row in expected])
    for name in "VH":
        np.testing.assert_allclose(
            column(rows, name), column(expected, name), atol=1e-5
        )


@pytest.mark.mpi
@pytest.mark.skipif(COMM.size == 1, reason="one rank has all the cells")
def test_checkpoints_of_another_partition_are_refused(demo, folder, monkeypatch):
    """Also where each rank has as many cells as before."""
    path, build = folder / "ironing.npz", ironing.assemble_blocks
    demo.long_runs.save(path, demo.Ironing(COMM, 60).contact, [])
    turned = partial(build, partition=lambda x, ranks: ranks - 1 - strips(x, ranks))
    monkeypatch.setattr(ironing, "assemble_blocks", turned)
    with pytest.raises(SystemExit, match="is of another mesh, partition or number"):
        demo.long_runs.load(path, demo.Ironing(COMM, 60).contact, demo.Row)


@pytest.mark.mpi
def test_checkpoints_of_another_number_of_ranks_are_refused(demo, folder):
    """They are other files: not a word of what is missing."""
    path, other = folder / "ironing.npz", 1 if COMM.size > 1 else 2
    model = demo.Ironing(COMM, 60)
    demo.long_runs.save(path, model.contact, [])
    own = demo.long_runs.rank_file(path, COMM)
    with np.load(own) as data:
        arrays = {name: data[name] for name in data.files} | {"ranks": other}
    COMM.barrier()
    own.unlink()
    if COMM.rank == 0:
        np.savez(path if other == 1 else path.with_suffix(".0.npz"), **arrays)
    COMM.barrier()
    with pytest.raises(SystemExit, match=f"written by {other} .*run has {COMM.size}"):
        demo.long_runs.load(path, model.contact, demo.Row)


@pytest.mark.parametrize("damage", ["missing", "empty", "cut", "changed", "other"])
def test_damaged_checkpoints_are_refused(demo, tmp_path, damage):
    path = tmp_path / "ironing.npz"
    model = demo.Ironing(COMM, 60)
    demo.long_runs.save(path, model.contact, [])
    whole = path.read_bytes()
    middle = len(whole) // 2
    if damage == "other":
        np.savez(path, u=np.zeros(3))
    else:
        changed = whole[:middle] + b"\xff" * 64 + whole[middle + 64 :]
        path.write_bytes({"cut": whole[:middle], "changed": changed}.get(damage, b""))
    if damage == "missing":
        path.unlink()
    with pytest.raises(SystemExit, match="not a whole checkpoint"):
        demo.long_runs.load(path, model.contact, demo.Row)
