"""Friction springs keep their traction at rest (O4): on facets that are covered or
closed in part, and where they slip; with a multiplier a held body does not creep."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import rigid_scenes
import states
from dolfinx import fem
from friction_states import NONE, OPEN, SLIP, STICK, FrictionCase, tangential
from problems import COMM, build, fix, worst

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, SNESSolver, Stick, rigid

STEPS = 50
SHEAR = 0.01  # slide that stretches the springs


class Slider:
    """A rigid block, tilted into another so that some points close, and pushed."""

    def __init__(self, cell, degree, friction, kind="overhang"):
        self.case = FrictionCase(cell, degree, degree, "elastic")
        self.scene = self.case.scene(kind, flat=True)
        self.contact = self.case.contact(self.scene, friction)
        self.X = states.dof_positions(self.contact.u.function_space)
        upper = states.upper_dofs(self.scene, self.contact.u.function_space)
        self.upper, lateral = upper, self.X[upper, :-1]
        every = gathered.concatenated(lateral)
        middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
        # Closed to one side of a line across facets
        self.tilt = (
            0.04 * (lateral - middle + 0.1) @ np.array([1.0, 0.7][: self.case.dim - 1])
        )

    def move(self, slide, sink=0.0):
        u = np.zeros_like(self.X)
        u[self.upper, -1] = self.tilt - sink
        u[self.upper, 0] = slide
        self.contact.u.x.array[:] = u.ravel()
        self.contact.update()

    def shear(self):
        """Tangential traction of all points, of the last update."""
        p = gathered.points(self.contact)
        return tangential(p, p["traction"])

    def rest(self, steps=STEPS):
        """Largest change of traction over steps at rest."""
        first = self.shear()
        for _ in range(steps):
            self.contact.advance()
            self.contact.update()
        return worst(self.shear() - first) / worst(first)


def ratio(cell, degree, kind):
    """Shear of the slide over pressure at the closed points."""
    slider = Slider(cell, degree, Stick(), kind)
    slider.move(0.0)
    pressure = gathered.points(slider.contact)["pressure"]
    return states.GAMMA * SHEAR / pressure[pressure > 0.0]


@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("kind", ["overhang", "many"])
@pytest.mark.parametrize("regime", [STICK, SLIP])
def test_rigid_slider_at_rest_keeps_its_traction(cell, degree, kind, regime):
    """Closed in part; covered in part with the overhang."""
    law = Stick() if regime == STICK else Coulomb(0.5 * ratio(cell, degree, kind).min())
    slider = Slider(cell, degree, law, kind)
    slider.move(0.0)
    slider.contact.advance()
    slider.move(SHEAR)
    status = gathered.points(slider.contact)["status"]
    assert {OPEN, regime} <= set(status) <= {NONE, OPEN, regime}
    assert slider.rest() <= 1e-10


@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
def test_partial_slip_at_rest_keeps_its_traction(cell, degree):
    """No polynomial holds both stick and slip: what it lacks is held at the points."""
    mu = np.median(ratio(cell, degree, "many"))
    slider = Slider(cell, degree, Coulomb(mu), "many")
    slider.move(0.0)
    slider.contact.advance()
    slider.move(SHEAR)
    assert {STICK, SLIP, OPEN} <= set(gathered.points(slider.contact)["status"])
    assert slider.rest() <= 1e-10


@pytest.mark.mpi
def test_slip_leaves_no_stretch_beyond_the_bound(cell):
    """Pressed less, then more: what slipped away meanwhile does not come back, and a
    reversal starts at the bound."""
    slider = Slider(cell, 1, Coulomb(0.3), "many")
    slider.move(0.0)
    slider.contact.advance()
    slider.move(SHEAR, sink=0.02)
    slider.contact.advance()
    slider.move(SHEAR, sink=0.01)  # the bound falls
    slider.contact.advance()
    fallen = slider.shear()
    slider.move(SHEAR, sink=0.02)
    status = gathered.points(slider.contact)["status"]
    held = status == STICK
    assert held.any()
    change = np.linalg.norm(slider.shear(), axis=1) - np.linalg.norm(fallen, axis=1)
    assert change[held].max() <= 0.2 * worst(fallen)


@pytest.mark.mpi
def test_reopened_facets_forget():
    """No closed point, no traction to come back with."""
    slider = Slider("quadrilateral", 1, Stick(), "many")
    slider.move(0.0)
    slider.contact.advance()
    slider.move(SHEAR)
    slider.contact.advance()
    slider.move(SHEAR, sink=-1.0)
    assert set(gathered.points(slider.contact)["status"]) <= {NONE, OPEN}
    slider.contact.advance()
    assert all(worst(zone.traction_old) == 0.0 for zone in slider.contact.zones)


def over_a_rim(cell, method):
    """Half of its last facets have nothing below; pressed, sheared and solved."""
    scene = two_blocks(
        COMM,
        2,
        cell,
        lower_divisions=2,
        upper_divisions=(4, 2),
        lower_size=(1.0, 0.5),
        upper_size=(1.0, 0.5),
        overhang=0.125,
    )
    top = fem.Constant(scene.mesh, np.zeros(2))
    problem = build(
        scene,
        1,
        "neo-hookean",
        method,
        E=10.0,
        nu=0.3,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=top)],
        friction=Coulomb(0.5),
    )
    for down, along in [(0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.03, 0.02)]:
        top.value[-1], top.value[0] = -down, along
        problem.solve()
        problem.contact.advance()
    return problem


def change_at_rest(problem):
    """Largest change of traction over steps at rest, relative."""
    problem.solve()
    p = gathered.points(problem.contact)
    first = p["traction"]
    assert {STICK} <= set(p["status"])
    for _ in range(STEPS):
        problem.contact.advance()
        problem.solve()
    last = gathered.points(problem.contact)["traction"]
    return worst(last - first) / worst(first)


@pytest.mark.mpi
def test_block_over_a_rim_rests_in_balance(cell_2d):
    problem = over_a_rim(cell_2d, Penalty(100.0))
    assert change_at_rest(problem) <= 1e-10


@pytest.mark.mpi
def test_block_held_by_a_multiplier_does_not_creep(cell_2d):
    """Its surfaces are not flat: without (4.14) each step slips to balance the gap."""
    problem = over_a_rim(cell_2d, AugmentedLagrangian())
    assert change_at_rest(problem) <= 1e-9


@pytest.mark.parametrize("frame", ("slave", "master"))
@pytest.mark.parametrize("condition", ("points", "nodes"))
@pytest.mark.parametrize(
    "cell, name", (("quadrilateral", "circle"), ("tetrahedron", "sphere"))
)
def test_block_below_a_round_tool_rests(cell, name, condition, frame):
    """Whatever its law and frame: no solve, and no work of friction."""
    body = rigid.Body(rigid_scenes.shape_of(cell, name, 0.0))
    method = AugmentedLagrangian(condition=condition)
    scene = rigid_scenes.press(
        cell, body, n=5, method=method, frame=frame, friction=Coulomb(0.3)
    )
    solver, down = SNESSolver(scene.problem), np.zeros(body.shape.gdim)
    for depth in (0.02, 0.04):
        down[-1] = -depth
        body.move(down)
        solver.solve()
        scene.contact.advance()
    before = scene.u.x.array.copy()
    for _ in range(3):
        solver.solve()
        assert abs(scene.contact.friction_work()) < 1e-12
        scene.contact.advance()
    assert worst(scene.u.x.array - before) < 1e-9 * worst(before)
