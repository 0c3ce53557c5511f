"""Arguments, values and derivatives of users' laws."""

from __future__ import annotations

import numpy as np
import pytest

from raymortar import ContactError
from raymortar.user_laws.arguments import (
    beyond_differences,
    check_functions,
    chosen,
    further_arguments,
    offered,
    real_values,
    samples,
)


def bound(p, v, dt, slip=0.0, *, other=1):
    return p


def test_arguments_after_the_first_ones_are_known_by_name():
    assert [one.name for one in further_arguments(bound, 2)] == ["dt", "slip", "other"]
    assert offered(bound, 2) == {"dt", "slip"}
    assert offered(np.minimum, 2) == set()


@pytest.mark.parametrize(
    "function, text",
    [
        (3.0, "Law.f must be a law of p and v, not 3.0"),
        (lambda p: p, "is a function of p: it must take 2 arguments, p and v"),
        (lambda: 0.0, "is a function of nothing"),
        (lambda p, v, speed: p, "has the argument 'speed'"),
    ],
)
def test_functions_of_other_arguments_are_refused(function, text):
    with pytest.raises(ContactError, match=text):
        check_functions("Law", {"f": function}, ("p", "v"), kind="law")


@pytest.mark.parametrize(
    "function",
    [bound, np.minimum, lambda *of: of[0], lambda p, v, speed=1.0: p],
    ids=["named", "built in", "any number", "default"],
)
def test_functions_of_these_arguments_are_taken(function):
    check_functions("Law", {"f": function}, ("p", "v"))


@pytest.mark.parametrize("values", [np.ones(3), 1.0, np.ones(4) * 1j, np.ones((4, 1))])
def test_values_of_another_shape_or_kind_are_refused(values):
    with pytest.raises(ContactError, match=r"they must be real, of shape \(4,\)"):
        real_values("Law.f", values, 4)


def test_values_become_doubles():
    found = real_values("Law.f", [1, 2, 3], 3)
    assert found.dtype == np.float64 and list(found) == [1.0, 2.0, 3.0]


def beyond(slopes, f, z, h=1e-4):
    """What `beyond_differences` finds for slopes of a function at z."""
    places = [z - h, z, z + h]
    return beyond_differences(slopes, places, [f(at) for at in places], 1e-12)


def test_right_slopes_are_within_the_differences():
    z = np.array([0.5, 1.0, 2.0])
    assert beyond(3.0 * z**2, lambda at: at**3, z) is None


def test_the_slope_that_is_farthest_off_is_found():
    z = np.array([0.5, 1.0, 2.0])
    slopes = 3.0 * z**2 + np.array([0.1, 0.3, 0.0])
    number, difference = beyond(slopes, lambda at: at**3, z)
    assert number == 1 and difference == pytest.approx(3.0, rel=1e-3)


@pytest.mark.parametrize("slope, is_right", [(-1.0, True), (0.2, True), (1.1, False)])
def test_at_a_kink_any_slope_between_both_is_right(slope, is_right):
    found = beyond(np.array([slope]), np.abs, np.array([0.0]))
    assert (found is None) is is_right


def test_further_arguments_are_those_of_the_points():
    given = {"x": np.arange(12.0).reshape(3, 4), "slip": np.arange(4.0), "dt": 0.1,
             "fields": [np.ones(4)]}  # fmt: skip
    found = chosen(given, [1, 3])
    assert np.array_equal(found["x"], given["x"][:, [1, 3]])
    assert np.array_equal(found["slip"], [1.0, 3.0])
    assert found["dt"] == 0.1 and len(found["fields"][0]) == 2
    assert chosen({**given, "slip": None}, [0])["slip"] is None


@pytest.mark.parametrize("count, expected", [(1, 1), (5, 5), (1000, 8)])
def test_samples_are_some_of_the_points(count, expected):
    found = samples(count)
    assert len(found) == expected and found[0] == 0 and found[-1] == count - 1
