"""Points of a state are found once for all who look at it."""

import numpy as np
import pytest
from load_paths import top_moves

from raymortar import History
from raymortar.core.interface.zone_data import ZoneData
from raymortar.results import looking
from raymortar.results.tractions import seen_points


@pytest.fixture
def found(monkeypatch):
    """Counts how often points are found."""
    calls, find = [], ZoneData._find_points

    def counted(zone):
        calls.append(zone)
        return find(zone)

    monkeypatch.setattr(ZoneData, "_find_points", counted)
    return calls


@pytest.mark.mpi
def test_a_step_with_a_history_finds_points_twice(found):
    """Checks, findings, history and statistics look at one accepted state, the next step
    at its start."""
    problem, steps = top_moves("triangle", steps=3)
    steps.history = History(problem.problem)
    at = []
    for step in steps:
        at.append(len(found))
    assert np.diff(at).max() <= 2


@pytest.mark.mpi
def test_points_that_are_kept_are_those_of_the_state_and_nobody_changes_them(found):
    problem, steps = top_moves("triangle", steps=2)
    steps.run()
    (zone,) = problem.contact.zones
    right = zone.points()
    found.clear()
    with looking.at([zone]):
        zone.points()["pressure"][:] = np.nan
        with looking.at([zone]):
            again = zone.points()
        last = seen_points(zone)
    assert len(found) == 1 and zone.kept_points is None
    for name, values in right.items():
        np.testing.assert_array_equal(again[name], values)
        np.testing.assert_array_equal(last[name], values)
