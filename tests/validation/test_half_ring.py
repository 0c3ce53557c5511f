"""Half ring on a block (Yastrebov; Poulios and Renard; code_aster SSNP165).

Large sliding with friction, buckling, lift-off. code_aster's figures are of another
law and mesh: they are met roughly, signs and order above all.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from problems import COMM

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import half_ring as demo  # noqa: E402

FULL_STEPS = {"snes_linesearch_type": "basic"}


@pytest.fixture(scope="module")
def rubbing():
    return demo.solve(COMM, 32, steps=20)


@pytest.fixture(scope="module")
def gliding():
    return demo.solve(COMM, 48, steps=50, friction=0.0)


def asymmetry(result):
    """Largest difference between the displacement and its mirror image."""
    V = result.u.function_space
    n = V.dofmap.index_map.size_local
    x = V.tabulate_dof_coordinates()[:n, :2]
    u = result.u.x.array.reshape(-1, 2)[:n]
    parts = COMM.gather((x, u), root=0)
    worst = 0.0
    if COMM.rank == 0:
        x, u = (np.concatenate(part) for part in zip(*parts))
        mirror = [-1.0, 1.0]
        order, image = (np.lexsort(np.round(at, 6).T + 0.0) for at in (x, x * mirror))
        np.testing.assert_allclose(x[order], x[image] * mirror, atol=1e-6)
        worst = np.abs(u[order] - u[image] * mirror).max()
    return COMM.bcast(worst, root=0)


@pytest.mark.mpi
def test_both_complete_without_halving(rubbing, gliding):
    for result in (rubbing, gliding):
        assert result.factor[-1] == 1.0
        assert result.halvings == 0


@pytest.mark.mpi
def test_both_stay_symmetric(rubbing, gliding):
    for result in (rubbing, gliding):
        assert asymmetry(result) < 1e-8 * demo.OUTER
        assert (np.abs(result.force[:, 0]) < 1e-8 * result.force[-1, 1]).all()


@pytest.mark.mpi
def test_middle_comes_off_between_half_and_six_tenths(gliding):
    """As in code_aster, where the pressure is 8.09 at t = 0.5 and none at 0.6."""
    assert 0.5 < demo.lift_off(gliding) <= 0.6
    before = np.interp((0.3, 0.4, 0.5), gliding.factor, gliding.pressure)
    np.testing.assert_allclose(before, (18.152, 16.464, 8.090), rtol=0.1)
    assert gliding.gap[-1] > 1.0


@pytest.mark.mpi
def test_friction_holds_the_middle_down_for_longer(rubbing, gliding):
    assert 0.6 < demo.lift_off(rubbing) < 0.75
    assert rubbing.gap[-1] > 1.0


@pytest.mark.mpi
def test_middle_of_the_block_moves_as_in_code_aster(rubbing, gliding, record_property):
    for result, friction, allowed in ((rubbing, 0.5, 0.05), (gliding, 0.0, 0.04)):
        found = np.interp(demo.TIMES, result.factor, result.below[:, 1])
        record_property(f"mu = {friction}", found.tolist())
        reference = np.array(demo.CODE_ASTER[friction])
        # Of the largest displacement: that without friction ends near zero
        off = np.abs(found - reference) / np.abs(reference).max()
        assert off.max() < allowed


def test_line_search_or_a_small_gamma_saves_halvings(record_property):
    """22 steps need neither; the fewer the steps, the more it saves."""
    large, small = 400.0, 40.0  # about the outer layer's modulus over the cells, MPa/mm
    runs = {
        "line search": demo.solve(COMM, 32, 12, gamma=large),
        "full steps": demo.solve(
            COMM, 32, 12, gamma=large, options=FULL_STEPS, strategy="halve"
        ),
        "small gamma": demo.solve(COMM, 32, 12, gamma=small, options=FULL_STEPS),
    }
    for name, run in runs.items():
        record_property(name, (int(run.iterations.sum()), run.halvings))
    assert runs["full steps"].halvings > 0
    assert runs["line search"].halvings == runs["small gamma"].halvings == 0
    ends = np.array([run.below[-1, 1] for run in runs.values()])
    np.testing.assert_allclose(ends, ends[0], rtol=1e-2)


def interrupted(main, monkeypatch, after, arguments):
    """Run a demo's main; Ctrl-C comes in the solve after so many."""
    solve, count = demo.raymortar.SNESSolver.solve, iter(range(after))

    def until(solver):
        if next(count, None) is None:
            raise KeyboardInterrupt
        return solve(solver)

    with monkeypatch.context() as patch:
        patch.setattr(demo.raymortar.SNESSolver, "solve", until)
        return main(arguments)


@pytest.mark.mpi
def test_an_interrupted_run_goes_on_where_it_stopped(folder, monkeypatch):
    pytest.importorskip("matplotlib")
    runs = {}
    monkeypatch.setattr(demo, "draw", lambda result, *_: runs.update(last=result))
    options = ["--size", "16", "--steps", "8", "--every", "2", "--output", str(folder)]
    saved = str(folder / "ring.npz")
    demo.main(options)
    whole, table = runs.pop("last"), (folder / "half_ring.csv").read_text()
    COMM.Barrier()
    begun = [*options, "--checkpoint", saved]
    # The fifth step is after the last checkpoint: it is done again
    assert interrupted(demo.main, monkeypatch, 5, begun) == 130
    assert not runs
    demo.main([*options, "--restart", saved])
    again = runs["last"]
    # On several ranks MUMPS adds in no fixed order, and runs agree to what a solve of
    # Newton's method leaves
    same = 1e-12 if COMM.size == 1 else 1e-9
    np.testing.assert_allclose(again.factor, whole.factor, rtol=1e-14)
    np.testing.assert_array_equal(again.iterations, whole.iterations)
    for name in ("below", "above", "force", "pressure"):
        ours, exact = getattr(again, name), getattr(whole, name)
        np.testing.assert_allclose(ours, exact, atol=same * np.abs(exact).max())
    assert [t for t, _ in again.kept] == [t for t, _ in whole.kept]
    for (_, ours), (_, exact) in zip(again.kept, whole.kept):
        np.testing.assert_allclose(ours, exact, atol=same * np.abs(exact).max())
    if COMM.rank == 0:
        lines = (folder / "half_ring.csv").read_text().splitlines()
        assert len(lines) == len(table.splitlines()) == 9
