"""Recipes run as they are typed in, after the start of their page."""

from __future__ import annotations

import numpy as np
import pytest
from problems import COMM
from programs import ROOT, blocks_of

START, WETTED, FLAT, HALF, CORNER = blocks_of("docs/recipes.md", "python")
CRACK, CARRIED, PERIODIC = blocks_of("docs/recipes_joints.md", "python")
PRESS, LANDING, MATERIAL, NEWTON, DIFFERENCES = blocks_of(
    "docs/recipes_solving.md", "python"
)
# Few facets carry the contact of small programs
pytestmark = pytest.mark.filterwarnings("error::raymortar.ContactWarning")


@pytest.fixture
def run(folder, monkeypatch):
    """Runs blocks as one program in its own folder; gives its names."""
    if COMM.rank == 0:
        (folder / "meshes").symlink_to(ROOT / "meshes")
    COMM.Barrier()
    monkeypatch.chdir(folder)

    def run(*blocks):
        names = {"__name__": "__main__"}
        exec(compile("\n".join(blocks), "recipe", "exec"), names)
        return names

    return run


def test_faces_of_a_crack_slide_under_friction(run):
    """They press, slide at the limit of friction, and balance each other."""
    names = run(START, CRACK)
    force = names["contact"].resultant().force
    assert force[1] > 0.03
    assert abs(force[0]) == pytest.approx(0.2 * force[1], rel=0.01)
    held = names["problem"].reactions({"foot": names["bcs"][0], "lid": names["bcs"][1]})
    np.testing.assert_allclose(held["foot"], -held["lid"], atol=1e-10)


def test_a_table_carries_a_crate_that_friction_holds(run):
    """It sticks to the table, whose force is its weight, and steps are cheap."""
    names = run(START, CARRIED)
    found, turn = names["contact"].resultant(), np.radians(24.0)
    np.testing.assert_allclose(found.force, (0.0, 0.1), atol=1e-9)
    assert np.linalg.norm(found.tangential) == pytest.approx(0.1 * np.sin(turn), 1e-7)
    assert names["step"].tangents <= 8


def test_a_fluid_presses_on_the_open_part_alone(run):
    """Its force, that of contact and those of the supports are in balance."""
    names = run(START, WETTED)
    fem, ds = names["fem"], names["ds"]
    wet, fluid, normal = names["wet"], names["fluid"], names["normal"]
    pressed = [
        -fem.assemble_scalar(fem.form(fluid * wet * normal[i] * ds)) for i in (0, 1)
    ]
    contact, problem = names["contact"], names["problem"]
    held = problem.reactions({"bottom": names["bcs"][:1]})["bottom"]
    balance = np.array(pressed) + contact.resultant().force + held
    np.testing.assert_allclose(balance, 0.0, atol=1e-9 * abs(pressed[1]))
    # On the left of the lip, up to its contact
    space, points = wet.function_space, contact.points()
    facets = names["bodies"].find("lower_top")
    slave = fem.locate_dofs_topological(space, 1, facets)
    x, is_wet = space.tabulate_dof_coordinates()[slave, 0], wet.x.array[slave] > 0.5
    closed = points["X"][points["status"] > 1, 0]
    assert 0.3 < closed.min() - 0.1 < x[is_wet].max() < closed.min()
    assert pressed[1] < -0.05


def test_a_periodic_cell_slides_as_a_whole(run):
    """What contact takes from the foot comes from the lid, and slides at mu."""
    pytest.importorskip("dolfinx_mpc")
    names = run(START, PERIODIC)
    force = names["contact"].resultant().force
    held = names["problem"].reactions({"lid": names["bcs"]})["lid"]
    np.testing.assert_allclose(held + force, 0.0, atol=1e-9 * force[1])
    u, V = names["u"].x.array.reshape(-1, 2), names["V"]
    x = V.tabulate_dof_coordinates()
    left, right = (np.flatnonzero(np.isclose(x[:, 0], side)) for side in (0.0, 1.0))
    left, right = (at[np.argsort(x[at, 1])] for at in (left, right))
    np.testing.assert_allclose(u[left], u[right], atol=1e-12)
    assert force[1] > 0.0 and abs(force[0]) <= 0.3 * force[1] * (1 + 1e-9)


@pytest.mark.mpi
def test_a_face_stays_flat_under_a_force(run):
    names = run(START, FLAT)
    fem, V, top = names["fem"], names["V"], names["top"]
    dofs = fem.locate_dofs_topological(V, 1, top)
    ways = names["u"].x.array.reshape(-1, 2)[dofs, 1]
    plate = names["plate"].translation[1]
    assert plate < -0.1
    np.testing.assert_allclose(ways, plate, rtol=1e-8)
    for force in (names["face"].resultant(), names["contact"].resultant()):
        assert abs(force.force[1]) == pytest.approx(1.5, rel=1e-9)


def test_half_of_a_model_has_half_of_the_force(run):
    half = run(START, HALF)["history"]
    program = HALF
    for old, new in (
        ("[0.0, -1.0]", "[-1.0, -1.0]"),
        ("[16, 16]", "[32, 16]"),
        ("    tools.prescribe(V, side(0, 0.0), component=0),", ""),
        ("symmetry=2", "symmetry=1"),
    ):
        assert old in program
        program = program.replace(old, new)
    whole = run(START, program)["history"]
    assert whole["force_0_y"][-1] < -0.05
    for column in (
        "force_0_y",
        "area_0",
        "max_pressure_0",
        "push_Circle_y",
        "work_Circle",
    ):
        np.testing.assert_allclose(half[column], whole[column], rtol=1e-8)


@pytest.mark.mpi
def test_both_faces_of_a_block_in_a_corner_bear_their_force(run):
    """The wall and the slope below it bear the push; nothing is found to be doubtful."""
    names = run(START, CORNER)
    below, beside = (names[name].resultant().force for name in ("below", "beside"))
    assert below[0] + beside[0] == pytest.approx(-0.3, rel=1e-8)
    assert beside[0] == pytest.approx(-0.302, abs=5e-4) and abs(beside[1]) < 1e-12
    held = names["problem"].reactions({"lid": names["bcs"][1]})["lid"]
    assert below[1] == pytest.approx(-held[1], rel=1e-8) and below[1] > 0.1
    assert not names["problem"].check()


@pytest.mark.mpi
def test_parts_that_a_force_pushes_land(run):
    """They rest on the floor and bear the force, at a few tangents a step."""
    names = run(START, PRESS, LANDING)
    np.testing.assert_allclose(names["forces"], 0.3, rtol=1e-8)
    foot = names["fem"].locate_dofs_topological(names["V"], 1, names["bottom"])
    down = names["u"].x.array.reshape(-1, 2)[foot, 1]
    np.testing.assert_allclose(down, -0.2, atol=1e-3)
    step = names["step"]
    assert step.tangents <= 5 and step.strategy == "full" and not step.findings


def test_a_material_in_numpy_stays_within_its_yield_surface(run):
    names = run(START, PRESS, MATERIAL)
    stress = names["stress"].x.array.reshape(-1, 4) @ names["DEVIATOR"]
    plastic = names["accepted"].reshape(-1, 4)
    limit = np.sqrt(2 / 3) * names["YIELD"]
    size = np.linalg.norm(stress - 2 / 3 * names["HARDENING"] * plastic, axis=1)
    flows = np.linalg.norm(plastic, axis=1) > 0.0
    assert 0.1 < flows.mean() and size.max() == pytest.approx(limit, rel=1e-6)
    # Its tangent is exact
    last = [r for r in names["problem"].history if r > 1e-13]
    assert last[-1] < 100.0 * (last[-2] / last[0]) ** 1.5 * last[0]


@pytest.mark.mpi
def test_a_loop_of_ones_own_converges_and_its_tangent_is_exact(run, capsys):
    names = run(START, PRESS, NEWTON, DIFFERENCES)
    norms = names["norms"]
    assert len(norms) <= 8 and norms[-1] < 1e-10
    lines = capsys.readouterr().out.splitlines()[-3:]
    errors = [float(line.split()[-1]) for line in lines]
    slopes = np.log10(errors[:-1]) - np.log10(errors[1:])
    np.testing.assert_allclose(slopes, 2.0, atol=0.1)
