"""The installed C++ library serves a program that knows neither Python nor DOLFINx."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import raymortar

EXAMPLE = Path(__file__).parents[2] / "examples" / "cpp"
PREFIX = Path(raymortar.__file__).parents[2]

needs_library = pytest.mark.skipif(
    not (PREFIX / "include" / "raymortar").is_dir(),
    reason="raymortar was installed as a wheel, which has no C++ headers",
)


def run(*command):
    """Run a command outside of this process's own MPI; its output."""
    launcher = ("OMPI_COMM_", "OMPI_MCA_ess", "PMIX_", "PMI_", "PRTE_MCA_")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(launcher)}
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The example, built against the installed package."""
    build = tmp_path_factory.mktemp("cpp")
    options = ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={PREFIX}"]
    if shutil.which("ccache"):
        options.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
    run("cmake", "-G", "Ninja", "-S", EXAMPLE, "-B", build, *options)
    run("cmake", "--build", build)
    return build / "two_blocks"


@needs_library
@pytest.mark.quick
@pytest.mark.parametrize("ranks", [1, 3])
def test_pressure_passes_between_ranks_undiminished(program, ranks):
    output = run("mpirun", "--map-by", ":OVERSUBSCRIBE", "-n", ranks, program)
    assert float(output.split()[-1]) < 1e-10
