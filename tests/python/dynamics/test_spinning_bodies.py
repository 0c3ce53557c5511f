"""Rotation of rigid bodies about all axes: closed forms, order, conservation."""

import numpy as np
import pytest
import tumbling
from problems import worst

from raymortar import ContactError, rigid
from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark
from raymortar.rigid.turning import rotation_matrix

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
KEEPING = SCHEMES[:2]
TOP = 1.0, 1.0, 1.6  # principal moments


def order(errors):
    """Order of errors of steps that are halved."""
    return np.log2(np.array(errors)[:-1] / np.array(errors)[1:])


def precessing(scheme, count, end=2.0):
    """A symmetric top, its axis tilted in space, about its own axes at the end."""
    R = rotation_matrix(np.array([0.3, -0.7, 0.4]))
    top = tumbling.body(np.diag(TOP), R @ [0.8, 0.0, 2.5], turned=(0.3, -0.7, 0.4))
    return tumbling.turn(top, scheme, end / count, count)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_symmetric_top_precesses(scheme):
    """In the body at (J3 - J1) / J1 w3, in space about its moment of momentum."""
    end, errors = 2.0, []
    rate = (TOP[2] - TOP[0]) / TOP[0] * 2.5
    expected = [0.8 * np.cos(rate * end), 0.8 * np.sin(rate * end), 2.5]
    for count in (40, 80, 160):
        found = precessing(scheme, count, end)
        errors.append(worst(found.in_body[-1] - expected))
    assert np.all(np.abs(order(errors) - 2.0) <= 0.1)
    # The axis of the top moves on a cone at |L| / J1
    L = found.momentum[0]
    size = np.linalg.norm(L)
    axis = found.turns[:, :, 2]
    cone = rotation_matrix(L / size * (size / TOP[0] * end)) @ axis[0]
    assert worst(axis[-1] - cone) <= 5e-3
    assert worst(found.momentum - L) <= 1e-11 * size


@pytest.mark.parametrize("scheme", KEEPING, ids=str)
def test_a_turn_without_moments_keeps_its_energy(scheme):
    """At any size of steps, a third of a turn here."""
    J = rotation_matrix(np.array([0.2, 0.5, -0.3])) @ np.diag([1.0, 2.0, 2.5])
    J = J @ rotation_matrix(-np.array([0.2, 0.5, -0.3]))
    found = tumbling.turn(tumbling.body(J, (1.0, -2.0, 0.5)), scheme, 0.8, 200)
    assert worst(found.kinetic / found.kinetic[0] - 1.0) <= 1e-11
    assert worst(found.momentum - found.momentum[0]) <= 1e-10


def flipping(scheme, count, end=15.0):
    """A body that is turned about its middle axis, and flips."""
    J, start = np.array([1.0, 2.0, 3.0]), np.array([0.02, 2.0, 0.03])
    found = tumbling.turn(tumbling.body(J, start), scheme, end / count, count)
    energy, momentum = 0.5 * J @ start**2, np.linalg.norm(J * start)
    # The closed form begins where the middle velocity is 0: find the start on it
    t = np.linspace(0.0, 6.0, 120001)
    way = tumbling.flipping(J, energy, momentum, t)
    at = np.argmin(np.abs(way - start).sum(axis=1))
    assert worst(way[at] - start) <= 1e-3
    times = t[at] + np.linspace(0.0, end, count + 1)
    found.exact = tumbling.flipping(J, energy, momentum, times)
    return found


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_body_that_turns_about_its_middle_axis_flips(scheme):
    found = flipping(scheme, 1000)
    middle = found.in_body[:, 1]
    assert middle.min() <= -1.99 and middle[-1] >= 1.8  # there and back
    assert worst(found.in_body - found.exact) <= 0.02
    assert worst(found.momentum - found.momentum[0]) <= 1e-10
    if scheme in KEEPING:
        assert worst(found.kinetic / found.kinetic[0] - 1.0) <= 1e-11


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_the_order_under_moments_is_2(scheme):
    """A spring, a damper and a moment turn a body of three unlike moments."""

    def end(count):
        body = tumbling.body(
            (1.0, 2.0, 2.5), (1.0, -0.5, 0.7), (0.3, -0.2, 0.4),
            stiffness={"ry": 2.0}, damping={"rz": 0.3},
        )  # fmt: skip
        return tumbling.turn(body, scheme, 1.0 / count, count)

    exact = end(400)
    for of in ("velocity", "turns"):
        errors = [
            worst(getattr(end(n), of)[-1] - getattr(exact, of)[-1]) for n in (20, 40)
        ]
        assert np.all(np.abs(order(errors) - 2.0) <= 0.15), errors


def test_work_of_a_moment_is_the_energy_that_a_body_gains():
    moment = np.array([0.4, -0.3, 0.2])
    for scheme in KEEPING:
        body = tumbling.body((1.0, 2.0, 2.5), (1.0, -0.5, 0.7), moment)
        found = tumbling.turn(body, scheme, 0.1, 30)
        gained = np.diff(found.kinetic)
        assert worst(gained - found.works[1:]) <= 1e-12
        assert worst(gained) >= 1e-3


@pytest.mark.parametrize(
    "inertia, text",
    [
        (-1.0, "principal moments"),
        ((1.0, 1.0, 2.5), "none above the sum"),
        ((1.0, 2.0), "three moments or a tensor"),
        ("heavy", "three moments or a tensor"),
        (np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "symmetric"),
    ],
)
def test_inertia_of_no_body_is_refused(inertia, text):
    with pytest.raises(ContactError, match=text):
        tumbling.body(inertia, (0.0, 0.0, 0.0))


def test_two_free_rotations_have_no_inertia():
    ball = rigid.Sphere((0.0, 0.0, 0.0), 0.5)
    with pytest.raises(ContactError, match="or about all three"):
        rigid.Body(ball, free=("rx", "ry"), inertia=1.0)
