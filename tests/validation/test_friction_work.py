"""Work of the loads, energy that is stored, work of friction: they balance."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import ufl
from materials import lame, neo_hookean_energy
from problems import DIMENSION
from rigid_scenes import NU, E, press
from sheared_blocks import METHODS, WIDTH, Blocks, limit_of, pressure

from raymortar import Coulomb, History, LoadSteps, Penalty, SNESSolver, rigid

MU = 0.3


# Edge of the block, and factor on its modulus: unit-free, and steel in metres
UNITS = {"unit-free": (1.0, 1.0), "SI": (1e-3, 2e11 / E)}


def plate(dim, unit=1.0, **options):
    """A rigid plate that just touches the block."""
    if dim == 2:
        shape = rigid.Line((0.5 * unit, unit), (0.0, -1.0))
    else:
        shape = rigid.Plane((0.5 * unit, 0.5 * unit, unit), (0.0, 0.0, -1.0))
    return rigid.Body(shape, name="plate", **options)


def recorded(cell, way, n=4, units="unit-free", **options):
    """A block below a plate that goes a way, (steps, 2) along and down in edges of the
    block; a `History`."""
    dim, (unit, stiffer) = DIMENSION[cell], UNITS[units]
    scene = press(cell, plate(dim, unit), n, unit=unit, stiffer=stiffer, **options)
    metadata = {"quadrature_degree": 2}
    F = ufl.Identity(dim) + ufl.grad(scene.u)
    energy = neo_hookean_energy(F, *lame(stiffer * E, NU)) * ufl.dx(metadata=metadata)
    history = History(scene.problem, energy=energy)
    solver = SNESSolver(scene.problem)
    history.record(0.0)
    for time, (along, down) in enumerate(way, 1):
        shift = np.zeros(dim)
        shift[0], shift[-1] = along, -down
        scene.body.move(unit * shift)
        solver.solve()
        history.record(float(time))
        scene.contact.advance()
    return history


def pressed_and_cycled(n, along, down=0.02):
    """A press in n steps, a loading branch, and a whole cycle of 4 n steps."""
    up = np.linspace(0.0, 1.0, n + 1)[1:]
    back = np.linspace(1.0, -1.0, 2 * n + 1)[1:]
    drag = along * np.concatenate([0.0 * up, up, back, -back])
    press = np.concatenate([up, np.ones(5 * n)])
    return np.column_stack([drag, down * press])


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
@pytest.mark.parametrize("steps", [1, 7])
def test_a_slider_works_by_the_bound_times_its_way(cell, steps):
    """A block that slides as a rigid body would, at the bound: W = mu N s."""
    blocks = Blocks(cell, METHODS["augmented"](), Coulomb(MU))
    blocks.press()
    k, work = limit_of(Coulomb(MU), blocks.dim), 0.0
    for slide in np.linspace(0.0, 0.2, steps + 1)[1:]:
        blocks.step(k, slide)
        work += blocks.contact.friction_work()
        blocks.contact.advance()
    bound = MU * -pressure(blocks.dim) * WIDTH ** (blocks.dim - 1)
    assert work == pytest.approx(bound * 0.2, rel=1e-9)


@pytest.mark.mpi(where=lambda cell, steps, units: steps == 3)
@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
@pytest.mark.parametrize("steps", [1, 3, 10])
def test_a_plate_that_slides_works_by_its_load_times_its_way(cell, steps, units):
    """On a block that sticks at its bottom; once all slips, W = mu N s exactly."""
    dim, (unit, stiffer) = DIMENSION[cell], UNITS[units]
    load = 0.02 * stiffer * E * unit ** (dim - 1)
    down = (0.0,) * (dim - 1) + (-load,)
    free = ("xyz"[dim - 1],)
    scene = press(
        cell,
        plate(dim, unit, free=free, force=down),
        unit=unit,
        stiffer=stiffer,
        material="linear",
        friction=Coulomb(MU),
    )
    solver, body = SNESSolver(scene.problem), scene.body
    LoadSteps(solver, lambda t: setattr(body, "force", t * np.array(down)), 2).run()

    def to(way):
        body.move(np.eye(dim)[0] * way * unit)

    # Slip spreads over the whole block first
    LoadSteps(solver, lambda t: to(0.05 * t), 5).run()

    def slide(way):
        to(way)
        for _ in range(2):  # to rounding
            solver.solve()
        work = scene.contact.friction_work()
        scene.contact.advance()
        return work

    # In space slip turns into the plate's direction, by a factor in each of these steps
    for far in range(1, 9):
        slide(float(far))
    way = far + 0.3 * np.linspace(0.0, 1.0, steps + 1)[1:]
    total = sum(map(slide, way))
    assert total == pytest.approx(MU * load * 0.3 * unit, rel=1e-12)


@pytest.mark.mpi
def test_balances_are_the_same_in_any_units():
    """Forces, energies and works of a cycle in partial slip, over those of the units."""
    way = pressed_and_cycled(3, 0.004)
    found = []
    for units, (unit, stiffer) in UNITS.items():
        history = recorded("quadrilateral", way, 4, units, friction=Coulomb(MU))
        force, work = stiffer * unit, stiffer * unit**2
        columns = {"push_plate_x": force, "push_plate_y": force, "energy": work}
        columns |= {"work_plate": work, "friction_work": work}
        found.append({name: history[name] / one for name, one in columns.items()})
    for name, values in found[0].items():
        size = np.abs(values).max()
        np.testing.assert_allclose(found[1][name], values, rtol=0.0, atol=1e-9 * size)


@pytest.mark.mpi(where=lambda cell, units: units == "unit-free")
@pytest.mark.parametrize(
    "cell, units",
    [("quadrilateral", "unit-free"), ("quadrilateral", "SI")]
    + [("hexahedron", "unit-free")],
)
def test_work_of_a_cycle_in_partial_slip_is_the_area_of_its_loop(
    cell, units, record_property
):
    """Points slip at the rim only. With tractions at the ends of steps the error is of
    first order: what is left of twice as many steps twice is 1 % at most."""
    errors = []
    for n in (5, 10) if cell == "hexahedron" else (10, 20):
        n_cells = 3 if cell == "hexahedron" else 8
        way = pressed_and_cycled(n, 0.004)
        history = recorded(cell, way, n_cells, units, friction=Coulomb(MU))
        cycle = slice(2 * n, None)

        def change(column):
            return np.diff(history[column][cycle][[0, -1]])[0]

        loop = change("work_plate") - change("energy")
        errors.append(change("friction_work") / loop - 1.0)
    record_property("errors", errors)
    assert abs(errors[1]) <= 0.6 * abs(errors[0]) <= 0.04
    assert abs(2.0 * errors[1] - errors[0]) <= 0.01


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_a_penalty_stores_what_the_bodies_do_not(cell, record_property):
    """Without friction. At the block's edges its normals are not the plate's: a little
    of the defect stays, of the other part the square of the step."""
    found = []
    for n in (4, 8):
        way = np.column_stack([np.zeros(n), np.linspace(0.0, 0.05, n + 1)[1:]])
        history = recorded(cell, way, 2, method=Penalty(5.0 * E))
        work, stored = history["work_plate"][-1], history["stored_normal"][-1]
        assert stored > 0.03 * work
        found.append((work - history["energy"][-1] - stored) / work)
    record_property("defects", found)
    assert "stored_tangential" not in history.columns
    assert abs(found[1]) <= 0.4 * abs(found[0]) <= 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("tangential", ["elastic", "rate"])
def test_a_penalty_with_friction_balances(tangential, record_property):
    """What penetration and springs store is no error; what springs store is no work of
    friction (4.39)."""
    method = Penalty(20.0 * E, tangential=tangential)
    way = pressed_and_cycled(10, 0.05)[:20]
    history = recorded("quadrilateral", way, 4, method=method, friction=Coulomb(MU))
    last = history.rows[-1]
    work = last.work_plate
    stored = last.energy + last.stored_normal + last.stored_tangential
    defect = (work - stored - last.friction_work) / work
    record_property("defect", defect)
    assert abs(defect) <= 0.01
    assert last.friction_work > 0.3 * work and last.stored_normal > 0.03 * work
    held = last.stored_tangential / last.friction_work
    assert 0.005 < held < 0.1 if tangential == "elastic" else held == 0.0
    contact = history.problem.contact
    parts = [contact.stored_energy(part) for part in ("total", "normal", "tangential")]
    assert parts[0] == pytest.approx(parts[1] + parts[2], rel=1e-12)


@pytest.mark.parametrize("turn", [0.1, 0.5, 1.2])
def test_work_around_a_wheel_is_torque_times_angle(turn):
    """The slip below a wheel that turns is as long as its arc, for as far as the series of
    the arc goes (2.17)."""
    radius, depth = 1.0, 1e-3
    circle = rigid.Circle((0.5, 1.0 + radius - depth), radius)
    wheel = rigid.Body(circle, name="wheel")
    scene = press("quadrilateral", wheel, 16, friction=Coulomb(0.05))
    solver = SNESSolver(scene.problem)

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for k in range(1, 4):  # in the first it does not slip throughout

            def apply(t):
                wheel.move(rotation=turn * (k - 1 + t))

            for _ in LoadSteps(solver, apply, steps=1):
                work = scene.contact.friction_work()
                moment = scene.contact.results.resultant_on(wheel).moment
    assert any("wheel turns by" in str(one.message) for one in told) == (turn > 1.0)
    short = 0.14 if turn > 1.0 else 0.0
    expected = (1.0 - short) * turn * abs(float(np.ravel(moment)[-1]))
    assert work == pytest.approx(expected, rel=0.01)
