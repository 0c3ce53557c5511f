"""Every demo runs in its smallest size, agrees with its closed form and leaves files."""

import sys
from pathlib import Path

from mpi4py import MPI

import pytest

pytest.importorskip("matplotlib")
sys.path.insert(0, str(Path(__file__).parents[2] / "demos"))

import blocks_3d  # noqa: E402
import hertz_cylinder  # noqa: E402
import hertz_sphere  # noqa: E402

COMM = MPI.COMM_WORLD


def run(demo, tmp_path, *arguments):
    """Run a demo on all ranks and look at what it leaves."""
    output = Path(COMM.bcast(str(tmp_path), root=0))
    assert demo.main(["--output", str(output), *arguments]) == 0
    COMM.Barrier()
    for suffix in (".png", ".xdmf", ".h5"):
        assert (output / f"{demo.__name__}{suffix}").stat().st_size > 0


@pytest.mark.quick
@pytest.mark.mpi
def test_cylinder_agrees_with_hertz(tmp_path):
    run(hertz_cylinder, tmp_path, "--size", "10")


def test_quadratic_cylinder_agrees_with_hertz(tmp_path):
    run(hertz_cylinder, tmp_path, "--size", "10", "--degree", "2")


@pytest.mark.mpi
def test_blocks_are_uniform_and_in_equilibrium(tmp_path):
    run(blocks_3d, tmp_path, "--size", "2")


def test_quadratic_blocks_are_uniform_and_in_equilibrium(tmp_path):
    run(blocks_3d, tmp_path, "--size", "1", "--degree", "2")


def test_spheres_agree_with_hertz_and_tatara(tmp_path):
    run(hertz_sphere, tmp_path)


def test_a_demo_that_is_off_fails():
    report = hertz_cylinder.common.Report(COMM)
    report.add("peak", 1.05, 1.0, 0.03)
    assert report.finish() == 1
