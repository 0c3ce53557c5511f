"""Every demo runs in its smallest size, agrees with its closed form, leaves files, and
warns of nothing."""

import sys
from pathlib import Path

from mpi4py import MPI

import pytest

pytest.importorskip("matplotlib")
sys.path.insert(0, str(Path(__file__).parents[2] / "demos"))

import assembly  # noqa: E402
import blocks_3d  # noqa: E402
import bolt  # noqa: E402
import bouncing_ball  # noqa: E402
import brake  # noqa: E402
import buckling_tube  # noqa: E402
import c_box  # noqa: E402
import calibration  # noqa: E402
import cattaneo_mindlin  # noqa: E402
import crushed_ring  # noqa: E402
import forming  # noqa: E402
import half_ring  # noqa: E402
import hardening  # noqa: E402
import heap  # noqa: E402
import hertz_cylinder  # noqa: E402
import hertz_sphere  # noqa: E402
import indentation  # noqa: E402
import ironing_3d  # noqa: E402
import newton_of_dolfinx  # noqa: E402
import own_assembly  # noqa: E402
import peeling  # noqa: E402
import pin  # noqa: E402
import plug  # noqa: E402
import press_fit  # noqa: E402
import press_fit_lame  # noqa: E402
import return_mapping  # noqa: E402
import rolling  # noqa: E402
import seal_lip  # noqa: E402
import shallow_ironing  # noqa: E402
import shells  # noqa: E402
import slabs  # noqa: E402
import snap_through  # noqa: E402
import spinning_ring  # noqa: E402
import tied_cantilever  # noqa: E402
import two_bars  # noqa: E402
import wheel  # noqa: E402

from raymortar import ContactWarning  # noqa: E402

COMM = MPI.COMM_WORLD
# A warning of a right program is a false alarm
pytestmark = pytest.mark.filterwarnings("error::raymortar.ContactWarning")


def run(demo, output, *arguments):
    """Run a demo on all ranks and look at what it leaves."""
    assert demo.main(["--output", str(output), *arguments]) == 0
    COMM.Barrier()
    for suffix in (".png", ".xdmf", ".h5"):
        assert (output / f"{demo.__name__}{suffix}").stat().st_size > 0


@pytest.mark.quick
@pytest.mark.mpi
def test_cylinder_agrees_with_hertz(folder):
    run(hertz_cylinder, folder, "--size", "10")


def test_quadratic_cylinder_agrees_with_hertz(folder):
    run(hertz_cylinder, folder, "--size", "10", "--degree", "2")


@pytest.mark.mpi
def test_blocks_are_uniform_and_in_equilibrium(folder):
    run(blocks_3d, folder, "--size", "2")


@pytest.mark.mpi
def test_heat_of_a_brake_is_the_work_of_friction(folder):
    run(brake, folder, "--size", "6", "--steps", "6")


@pytest.mark.mpi
def test_heat_of_slabs_is_that_of_a_series(folder):
    run(slabs, folder, "--size", "4", "--steps", "4")


def test_a_pin_wears_as_archard_says(folder):
    run(pin, folder, "--size", "20", "--steps", "8")


def test_quadratic_blocks_are_uniform_and_in_equilibrium(folder):
    run(blocks_3d, folder, "--size", "1", "--degree", "2")


def test_spheres_agree_with_hertz_and_tatara(folder):
    run(hertz_sphere, folder)


def test_partial_slip_agrees_with_mindlin(folder):
    run(cattaneo_mindlin, folder)


def test_a_half_ring_buckles_as_in_code_aster(folder):
    run(half_ring, folder)


def test_an_indenter_ploughs_as_friction_says(folder):
    run(shallow_ironing, folder, "--size", "24", "--until", "1.2")


@pytest.mark.mpi
def test_a_return_mapping_agrees_with_its_closed_form(folder):
    run(return_mapping, folder, "--size", "6")


@pytest.mark.mpi
def test_plastic_strains_of_halved_steps_are_taken_back(monkeypatch):
    """A path that has to halve its step, and one of the same steps at once."""

    def press():
        shape = return_mapping.rigid.Circle((1.0, 0.5), 0.5)
        return return_mapping.Press(COMM, 8, shape, False)

    halved, direct = press(), press()
    halved.move(0.0, 0.03, 1)
    assert halved.material.rejected == halved.halvings > 0
    monkeypatch.setattr(hardening, "MOST", 1.0)
    begin = 0.0
    for depth in -halved.history["translation_tool_y"]:
        direct.move(begin, depth, 1)
        begin = depth
    assert direct.halvings == 0
    forces = [model.history["push_tool_y"] for model in (halved, direct)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


@pytest.mark.mpi
def test_rigid_tools_agree_with_sneddon(folder):
    run(indentation, folder, "--size", "4")


@pytest.mark.parametrize("name", indentation.TOOLS)
def test_rigid_tools_sink_by_sneddons_depth_under_their_force(name):
    """Free along their axis, without contact at the start but for a point."""
    found = indentation.solve(COMM, name, 6, by_force=True)
    assert found.force == pytest.approx(found.tool.force, rel=1e-8)
    assert found.depth == pytest.approx(found.tool.depth, rel=0.01)


def test_a_wheel_rolls_two_turns(folder):
    run(rolling, folder, "--fine")


def test_a_wheel_rolls_without_slip(folder):
    run(rolling, folder)


def test_a_bolt_carries_its_pretension_and_then_the_load(folder):
    run(bolt, folder)


def test_a_tape_peels_as_the_elastica_says(folder):
    run(peeling, folder)


def test_a_tyre_rolls_and_is_braked_as_its_hub_says(folder):
    run(wheel, folder)


def test_a_sheet_is_bent_and_springs_back(folder):
    run(forming, folder, "--steps", "10")


def test_a_ring_meets_itself_as_its_quarter_meets_a_line(folder):
    run(crushed_ring, folder, "--steps", "12")


def test_a_tube_folds_as_half_of_it_does_on_a_mirror(folder):
    run(buckling_tube, folder)


def test_the_arms_of_a_c_meet_as_two_named_sides(folder):
    run(c_box, folder)


def test_a_heap_is_in_balance(folder):
    run(heap, folder, "--size", "3")


@pytest.mark.mpi
def test_press_fit_is_balanced_and_slides_at_the_limit(folder):
    # Coarser than the demo as it stands, which is told; so is the tilt of its facets
    with pytest.warns(ContactWarning) as told:
        run(press_fit, folder, "--size", "4", "--steps", "40")
    assert any("straight facets lie" in str(one.message) for one in told)


@pytest.mark.mpi
def test_stopper_is_that_of_a_slice_in_space(folder):
    run(plug, folder, "--size", "3", "--steps", "4")


@pytest.mark.quick
@pytest.mark.mpi
def test_press_fits_agree_with_lame(folder):
    run(press_fit_lame, folder)


@pytest.mark.quick
@pytest.mark.mpi
def test_pin_jaw_and_base_are_in_equilibrium(folder):
    pytest.importorskip("gmsh")
    run(assembly, folder, "--size", "4", "--steps", "4")


@pytest.mark.quick
@pytest.mark.mpi
def test_newton_solver_of_dolfinx_is_in_equilibrium(folder):
    run(newton_of_dolfinx, folder)


@pytest.mark.quick
@pytest.mark.mpi
def test_own_assembly_is_in_balance(folder):
    run(own_assembly, folder)
    lines = Path(own_assembly.__file__).read_text().splitlines()
    assert len(lines) <= 60


@pytest.mark.parametrize("friction", ["0", "0.3"])
def test_die_is_in_equilibrium_and_slides_at_the_limit(folder, friction):
    run(ironing_3d, folder, "--size", "2", "--steps", "8", "--friction", friction)


def test_shells_store_what_the_plates_do(folder):
    # Coarser than the demo as it stands, which is told
    with pytest.warns(ContactWarning, match="facets carry the contact"):
        run(shells, folder, "--size", "2", "--steps", "5", "--closing", "2.5")


@pytest.mark.mpi
def test_a_led_punch_has_the_force_of_a_prescribed_one(folder):
    run(snap_through, folder, "--size", "10", "--steps", "24")


@pytest.mark.quick
@pytest.mark.mpi
def test_tied_halves_bend_as_one_beam(folder):
    run(tied_cantilever, folder, "--size", "2")


def test_a_demo_that_is_off_fails():
    report = hertz_cylinder.common.Report(COMM)
    report.add("peak", 1.05, 1.0, 0.03)
    assert report.finish() == 1


def moves(demo, folder, *arguments):
    """Run a demo of motion, which leaves an animation too."""
    run(demo, folder, *arguments)
    assert (folder / f"{demo.__name__}.gif").stat().st_size > 0


@pytest.mark.mpi
def test_two_bars_exchange_their_velocities(folder):
    moves(two_bars, folder, "--size", "16")


def test_a_ball_keeps_its_energy(folder):
    moves(bouncing_ball, folder, "--size", "6", "--end", "0.4")


def test_a_ring_loses_its_spin_to_friction(folder):
    moves(spinning_ring, folder, "--size", "6", "--end", "0.06")


def test_parameters_of_an_ironing_test_are_found(folder):
    run(calibration, folder)


@pytest.mark.mpi
def test_a_seal_lip_presses_evenly(folder):
    run(seal_lip, folder)
