"""Paths that stop and go on from a file equal those that did not stop, in each column."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import restarts
from load_paths import resting
from problems import COMM
from snapping import on_bed

from raymortar import (
    Checkpoint,
    ContactError,
    Coulomb,
    History,
    LoadSteps,
    Penalty,
    SNESSolver,
)
from raymortar.fluxes import Archard, Wear
from raymortar.io.partitions import strips
from raymortar.paths import ArcLength, DisplacementControl
from raymortar.paths.soft_start import lend_tenths

pytestmark = pytest.mark.mpi

# Over the largest of a column, or of all for one of rounding errors
SAME, ROUNDING = 1e-12, 1e-14


@dataclass
class Case:
    """A problem with its history, and what its path takes, given how much is done."""

    problem: Any
    history: Any
    apply: Any
    more: list[Any] = field(default_factory=list)
    options: Any = lambda begin: {}
    end: float = 1.0

    def checkpoint(self, path):
        return Checkpoint(self.problem, path, more=self.more, history=self.history)

    def follow(self, steps, begin=0.0, **options):
        return LoadSteps(
            SNESSolver(self.problem), self.apply, steps, path=(begin, self.end),
            history=self.history, **self.options(begin), **options,
        )  # fmt: skip


def restarted(name):
    model = restarts.model(name, COMM)
    return Case(model.problem, model.history, model.apply, model.more)


def worn(implicit, **options):
    model = restarts.blocks(COMM, strips, friction=Coulomb(0.3), **options)
    wear = Wear(model.problem.contact, Archard(0.02), implicit=implicit)
    model.history.include({"worn": wear.volume})

    def given(_):
        return {"on_accept": wear.accept}

    return Case(model.problem, model.history, model.apply, [wear.depth], given)


def sunk(control):
    """A path over limit points, led by the top or by its length."""
    found = on_bed("quadrilateral")

    def given(_):
        done = found.problem.contact.u.x.array[2 * found.top + 1]
        # The part of the displacement that is left
        done = COMM.allreduce(float(done.sum())) / COMM.allreduce(len(done))
        if control is ArcLength:
            return {"control": ArcLength(0.7)}
        return {"control": DisplacementControl(found.top, 1, by=-6.0 - done)}

    history = History(found.problem)
    return Case(found.problem, history, found.apply, [], given, 10.0)


def landing():
    problem, steps, _ = resting("quadrilateral", 0.1, Coulomb(0.3), stabilize=True)
    history = History(problem)
    return Case(problem, history, steps.apply, options=lambda _: {"stabilize": True})


CASES = {
    **{
        name: (lambda name=name: restarted(name))
        for name in ("springs", "triangles of degree 2", "wheel", "two contacts")
    },
    "worn": lambda: worn(False),
    "worn with springs": lambda: worn(False, method=Penalty(1e5)),
    "worn by implicit steps": lambda: worn(True),
    "stabilize": landing,
}


def off(one, other):
    """Largest difference of each column that differs, over what is allowed."""
    assert one.columns == other.columns
    a, b = (np.array(history.rows) for history in (one, other))
    assert a.shape == b.shape
    size = np.nanmax(np.abs(a), axis=0, initial=0.0)
    allowed = SAME * size + ROUNDING * size.max()
    worst = np.nanmax(np.abs(a - b), axis=0) / allowed
    return {name: x for name, x in zip(one.columns, worst) if x > 1.0}


def written_at(case, steps, cut, path):
    """Follow a path as far as a step, and write a file there; its load factor."""
    checkpoint = case.checkpoint(path)
    for k, step in enumerate(case.follow(steps), 1):
        if k == cut:
            checkpoint.write(step.factor)
            return step.factor
    raise AssertionError


@pytest.mark.parametrize("cut", [1, 3])
@pytest.mark.parametrize("name", CASES)
def test_each_column_goes_on(name, cut, folder):
    path, steps = folder / "path.chk", 5
    through, begun, rest = (CASES[name]() for _ in range(3))
    through.follow(steps).run()
    factor = written_at(begun, steps, cut, path)
    assert rest.checkpoint(path).read() == factor
    rest.follow(steps - cut, factor).run()
    assert off(through.history, rest.history) == {}


@pytest.mark.parametrize("control", [DisplacementControl, ArcLength])
def test_led_paths_go_on(control, folder):
    """Beyond the first limit point; the rest of an arc may take any number of steps."""
    path, steps, cut = folder / "led.chk", 12, 5
    through, begun, rest = (sunk(control) for _ in range(3))
    through.follow(steps).run()
    factor = written_at(begun, steps, cut, path)
    assert rest.checkpoint(path).read() == factor
    rest.follow(steps - cut, factor).run()
    assert off(through.history, rest.history) == {}


def test_columns_that_nothing_gives_any_more_are_named(folder):
    case, path = sunk(DisplacementControl), folder / "led.chk"
    factor = written_at(case, 12, 2, path)
    other = sunk(DisplacementControl)
    assert other.checkpoint(path).read() == factor
    assert other.history.columns == case.history.columns
    other.options = lambda _: {}
    with pytest.raises(
        ContactError, match=r"have \['controlled', 'load_factor'\], whi"
    ):
        other.follow(10, factor).run()


def small_gamma_from_the_first_step(case, steps, begin=0.0):
    """Steps of which the first leaves a tenth of gamma to the others, unless it has been
    left already."""
    path = case.follow(steps, begin)
    for k, step in enumerate(path):
        if k == 0 and begin == 0.0:
            ways = path._memory._of[2]
            ways._small_gamma.given.append(lend_tenths(case.problem))
        yield step


def test_a_file_has_the_own_coefficient_and_the_path_the_tenth(folder):
    through, begun, rest = (restarted("triangles of degree 2") for _ in range(3))
    path, contact = folder / "tenth.chk", begun.problem.contact
    own = contact.gamma
    list(small_gamma_from_the_first_step(through, 5))
    checkpoint = begun.checkpoint(path)
    for step in small_gamma_from_the_first_step(begun, 5):
        if step.factor > 0.3:
            assert contact.gamma == pytest.approx(0.1 * own, rel=1e-14)
            checkpoint.write(step.factor)
            break
    factor = rest.checkpoint(path).read()
    assert rest.problem.contact.gamma == own
    gammas = [rest.problem.contact.gamma for _ in rest.follow(3, factor)]
    assert gammas == pytest.approx([0.1 * own] * 3, rel=1e-14)
    assert rest.problem.contact.gamma == own
    assert off(through.history, rest.history) == {}
