"""The lines of load steps, on a terminal and in a log."""

from __future__ import annotations

import io
import re

import pytest
from load_paths import sticking, top_moves
from problems import COMM, tolerate

from raymortar import ContactError, ConvergenceError, LoadSteps
from raymortar.paths import speaker

STEPS = 3


class Terminal(io.StringIO):
    """A stream that calls itself a terminal."""

    def isatty(self):
        return True

    def screen(self):
        """The lines that one sees on it: carriage returns carried out."""
        lines = []
        for text in self.getvalue().split("\n"):
            cells = []
            for piece in text.split("\r"):
                cells[: len(piece)] = piece
            lines.append("".join(cells).rstrip())
        return [line for line in lines if line]


def path(stream, **options):
    """Problem and load steps that show their progress in a stream."""
    options = {"steps": STEPS, **options}
    return top_moves("quadrilateral", progress=stream, **options)


def numbers(line):
    """The numbers of a line by the word before them."""
    found = re.findall(r"([A-Za-z]+) +(-?[\d.]+(?:e[+-]\d+)?)", line)
    return {name: float(value) for name, value in found}


@pytest.mark.mpi
@pytest.mark.quick
def test_log_has_a_line_for_each_step_from_rank_0():
    log = io.StringIO()
    problem, steps = path(log)
    found = [(step, problem.contact.statistics) for step in steps]
    lines = log.getvalue().splitlines()
    assert "\r" not in log.getvalue()
    assert len(lines) == (STEPS if COMM.rank == 0 else 0)
    for k, (line, (step, counts)) in enumerate(zip(lines, found), 1):
        said = numbers(line)
        assert said["step"] == k and said["halvings"] == step.halvings
        assert said["load"] == pytest.approx(step.factor, rel=1e-5)
        assert said["Newton"] == step.iterations
        assert said["active"] == counts.active_points > 0
        assert said["gap"] == pytest.approx(counts.min_gap, rel=0.1)
        assert said["pressure"] == pytest.approx(counts.max_pressure, rel=0.01)


@pytest.mark.mpi
def test_terminal_keeps_the_last_line_and_leaves_the_caller_room():
    screen = Terminal()
    for step in path(screen)[1]:
        screen.write(f"mine: {step.factor:.3f}\n")
    mine, last = screen.screen()[:STEPS], screen.screen()[STEPS:]
    assert mine == ["mine: 0.333", "mine: 0.667", "mine: 1.000"]
    assert len(last) == (1 if COMM.rank == 0 else 0)
    for line in last:
        assert numbers(line)["step"] == STEPS and numbers(line)["load"] == 1.0


def test_line_is_rewritten_within_a_narrow_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    screen = Terminal()
    path(screen)[1].run()
    drawn = re.split("[\r\n]", screen.getvalue())[:-2]  # the last stays, in full
    assert len([text for text in drawn if text.strip()]) == STEPS
    assert max(map(len, drawn)) == 39


@pytest.mark.parametrize("progress, lines", [(None, 0), (False, 0), (True, STEPS)])
def test_standard_error_is_used_on_request_where_it_is_no_terminal(
    progress, lines, capsys
):
    path(progress)[1].run()
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == lines


@pytest.mark.parametrize("progress, lines", [(None, 1), (False, 0), (True, 1)])
def test_a_terminal_shows_it_unless_told_otherwise(progress, lines, monkeypatch):
    screen = Terminal()
    monkeypatch.setattr("sys.stderr", screen)
    path(progress)[1].run()
    assert len(screen.screen()) == lines


def test_halvings_are_said_and_a_failure_clears_the_terminal():
    log, screen = io.StringIO(), Terminal()
    problem, steps = path(log, steps=1)
    tolerate(problem.solver, max_it=3)
    steps.run()
    said = [numbers(line) for line in log.getvalue().splitlines()]
    assert said[-1]["halvings"] == steps.halvings > 0
    again = LoadSteps(problem.solver, steps.apply, max_halvings=0, progress=screen)
    tolerate(problem.solver, max_it=1)
    with pytest.raises(ConvergenceError):
        again.run()
    assert "load 0.1" in screen.getvalue() and screen.screen() == []


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.mpi
def test_log_has_a_line_for_each_other_way_from_rank_0():
    log = io.StringIO()
    _, steps = sticking("quadrilateral", progress=log)
    done = steps.run()
    assert any(step.strategy != "full" for step in done)
    lines = log.getvalue().splitlines()
    accepted = [line for line in lines if "Newton" in line]
    tried = [line for line in lines if "trying" in line]
    if COMM.rank != 0:
        assert not lines
        return
    assert len(accepted) == len(done) and len(tried) == len(lines) - len(accepted) > 0
    for k, (line, step) in enumerate(zip(accepted, done), 1):
        before = [t for t in lines[: lines.index(line)] if numbers(t)["step"] == k]
        assert [t.rpartition("trying ")[2] for t in before if "trying" in t][-1:] == (
            [step.strategy] if step.strategy not in ("full",) else []
        )


@pytest.mark.usefixtures("not_ahead")
def test_a_terminal_shows_what_is_tried_and_takes_it_away():
    screen = Terminal()
    _, steps = sticking("quadrilateral", progress=screen)
    done = steps.run()
    assert "trying small gamma" in screen.getvalue()
    (last,) = screen.screen()
    assert numbers(last)["step"] == len(done)


@pytest.mark.mpi
def test_bodies_out_of_reach_have_no_gap():
    """Pulled away from each other, beyond the search distances."""
    log = io.StringIO()
    path(log, steps=1, share=-2.0)[1].run()
    assert all("out of reach" in line for line in log.getvalue().splitlines())
    assert COMM.bcast(log.getvalue(), root=0) != ""


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.mpi
@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_a_step_that_takes_long_says_how_far_it_is(kind, monkeypatch):
    """With no time between two lines every iterate has one."""
    monkeypatch.setattr(speaker, "EVERY", -1.0)
    monkeypatch.setenv("COLUMNS", "200")
    log = kind()
    problem, steps = sticking("quadrilateral", progress=log)
    done = steps.run()
    text = log.getvalue().replace("\r", "\n")
    lines = [line for line in text.splitlines() if "residual" in line]
    if COMM.rank != 0:
        assert not lines
        return
    ways = {re.search(r"load [\d.]+ +(.*): tangents", line)[1] for line in lines}
    assert ways >= {"full", *(step.strategy for step in done)} and len(ways) > 1
    said = [numbers(line) for line in lines]
    first = [one["iteration"] for one in said if one["step"] == 1.0]
    assert first[:3] == [0.0, 1.0, 2.0] and first.count(0.0) == done[0].solves
    assert [one["tangents"] for one in said if one["step"] == 1.0][-1] == (
        done[0].tangents
    )
    assert all(one["residual"] > 0.0 for one in said)
    moved = [line for line in lines if "has moved by" in line]
    assert moved and all("the body around (" in line for line in moved)


def test_steps_that_are_quick_say_nothing_more():
    log = io.StringIO()
    path(log)[1].run()
    assert "residual" not in log.getvalue() and speaker.EVERY == 10.0


def test_what_is_neither_is_refused():
    with pytest.raises(ContactError, match="progress must be True, False, None or a"):
        top_moves("triangle", progress=3)


def test_steps_count_on_over_the_paths_of_a_problem():
    log = io.StringIO()
    problem, first = path(log, steps=2)
    second = LoadSteps(first.solver, first.apply, 2, path=(1.0, 1.1), progress=log)
    found = [*first, *second]
    assert [step.number for step in found] == [1, 2, 3, 4]
    assert [numbers(line)["step"] for line in log.getvalue().splitlines()] == [
        1.0, 2.0, 3.0, 4.0,
    ]  # fmt: skip
    assert problem.problem.steps_accepted == 4
