"""Friction laws of users: what they are given, and how they are differentiated."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from problems import COMM, worst
from sheared_blocks import METHODS, SHEAR, Blocks, pressure
from slave_functions import function_of

from meshes.scenes import two_blocks
from raymortar import ContactError, ContactWarning, Coulomb, Friction

CELLS = ("quadrilateral", "tetrahedron")


def coefficient(x):
    return 0.4 + 0.1 * x[0]


def dragged(cell, law, method="augmented", slide=0.02):
    """Displacement, iterations and contact of a pressed block that is dragged."""
    blocks = Blocks(cell, METHODS[method](), law)
    blocks.press()
    blocks.drive(0.4 * -pressure(blocks.dim) / SHEAR, slide)
    iterations = blocks.problem.solve()
    return blocks.problem.u.x.array.copy(), iterations, blocks


# Arguments


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_a_law_of_the_place_is_coulombs_with_a_field(cell):
    exact, wanted, _ = dragged(cell, Coulomb(coefficient))
    found, iterations, _ = dragged(cell, Friction(lambda p, v, x: coefficient(x) * p))
    assert worst(found - exact) <= 1e-10
    assert iterations == wanted


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_a_law_may_write_to_its_arguments(cell):
    """They are copies: Newton's method is as fast."""

    def careful(p, v, x):
        return coefficient(x) * p * (1.0 - 0.2 * np.tanh(v))

    def careless(p, v, x):
        v[:] = np.tanh(v)
        p *= coefficient(x) * (1.0 - 0.2 * v)
        x[:] = 0.0
        return p

    wanted, found = (dragged(cell, Friction(law)) for law in (careful, careless))
    assert worst(found[0] - wanted[0]) <= 1e-12
    assert found[1] == wanted[1]


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_a_law_of_a_field_takes_its_present_values(cell):
    fields = []
    law = Friction(lambda p, v, fields: fields[0] * p, fields=fields)
    blocks = Blocks(cell, METHODS["augmented"](), law)
    mu = function_of(blocks.scene.mesh, lambda x: 0.0 * x[0], 1)
    fields.append(mu)
    blocks.press()
    for slide, value in ((0.05, 0.1), (0.1, 0.3)):
        mu.x.array[:] = value
        k = value * -pressure(blocks.dim) / SHEAR
        assert blocks.step(k, slide) <= 1e-8
        blocks.contact.advance()


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_a_law_of_the_accumulated_slip_and_of_time(cell):
    """The bound of a step is that of the slip before it."""

    def bound(p, v, slip, dt):
        return (0.2 + 0.5 * slip) * p * dt

    blocks = Blocks(cell, METHODS["augmented"](), Friction(bound))
    blocks.contact.dt = 0.5
    blocks.press()
    for slide, before in ((0.1, 0.0), (0.2, 0.1), (0.3, 0.2)):
        k = 0.5 * (0.2 + 0.5 * before) * -pressure(blocks.dim) / SHEAR
        assert blocks.step(k, slide) <= 1e-7
        blocks.contact.advance()


@pytest.mark.parametrize(
    "make, pattern",
    [
        (
            lambda: Friction(lambda p, v, T: T * p),
            "Friction.bound has the argument 'T': after p and v a law may have any of",
        ),
        (
            lambda: Friction(np.maximum, lambda p, v, w: (p, v)),
            "Friction.derivatives has the argument 'w'",
        ),
        (lambda: Friction(np.maximum, fields=[0.3]), "Friction.fields has 0.3, which"),
    ],
)
def test_impossible_arguments_are_refused(make, pattern):
    with pytest.raises(ContactError, match=pattern):
        make().check()


@pytest.mark.mpi
def test_a_law_of_fields_needs_fields():
    law = Friction(lambda p, v, fields: fields[0] * p)
    blocks = Blocks("quadrilateral", METHODS["elastic"](), law)
    with pytest.raises(ContactError, match="has the argument fields, and there are no"):
        blocks.press()


@pytest.mark.mpi
def test_fields_of_another_mesh_are_refused():
    mesh = two_blocks(COMM, 2, "quadrilateral").mesh
    law = Friction(np.maximum, fields=[function_of(mesh, coefficient, 1)])
    with pytest.raises(ContactError, match="a field of Friction is a Function on ano"):
        Blocks("quadrilateral", METHODS["elastic"](), law)


# Derivatives


def share(v):
    return 0.3 + 0.1 * np.exp(-v / 0.05)


def by_pv(p, v):
    return share(v), -2.0 * np.exp(-v / 0.05) * p


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_derivatives_that_are_left_out_are_found(cell):
    """By complex steps, or by differences where `abs` loses imaginary parts."""
    exact, wanted, _ = dragged(cell, Friction(lambda p, v: share(v) * p, by_pv))
    for bound in (
        lambda p, v: share(v) * p,
        lambda p, v: share(np.abs(v)) * p,
        lambda p, v: np.interp(v, [0.0, 1e6], [1.0, 1.0]) * share(v) * p,
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found, iterations, _ = dragged(cell, Friction(bound))
        assert worst(found - exact) <= 1e-9
        assert iterations == wanted


@pytest.mark.mpi
@pytest.mark.parametrize(
    "derivatives, pattern",
    [
        (lambda p, v: (0.0 * p, by_pv(p, v)[1]), "derivatives: ds/dp is 0 at p = "),
        (lambda p, v: (by_pv(p, v)[0], 0.0 * v), "derivatives: ds/dv is 0 at p = "),
        (lambda p, v: (share(v), -by_pv(p, v)[1]), "derivatives: ds/dv is .*differen"),
    ],
)
def test_wrong_derivatives_are_told_once(derivatives, pattern):
    law = Friction(lambda p, v: share(v) * p, derivatives)
    blocks = Blocks("quadrilateral", METHODS["augmented"](), law)
    with pytest.warns(ContactWarning, match=pattern):
        blocks.contact.update()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        blocks.contact.update()


@pytest.mark.parametrize("unit", [1.0, 1e11])
def test_right_derivatives_are_silent_at_kinks(unit):
    def bound(p, v):
        return np.minimum(0.3 * p, 0.01 * unit) * np.where(v < 0.1, 1.0, 0.9 + v)

    def derivatives(p, v):
        low = 0.3 * p < 0.01 * unit
        slow = v < 0.1
        share = np.where(slow, 1.0, 0.9 + v)
        return 0.3 * low * share, np.minimum(0.3 * p, 0.01 * unit) * ~slow

    scene = Blocks("quadrilateral", METHODS["elastic"](), Friction(bound, derivatives))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.contact.set_gamma(unit)
        scene.contact.update()
