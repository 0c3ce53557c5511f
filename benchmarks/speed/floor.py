"""What assembly cannot do without: the C++ module `_floor`, built when it is wanted."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import raymortar


def load():
    """The module, from the build directory that raymortar was installed from.

    Raises
    ------
    RuntimeError
        If raymortar is not that of a build directory, as `scripts/python` has it, or
        the module does not build.
    """
    # build/.../prefix/python/raymortar/__init__.py
    build = Path(raymortar.__file__).resolve().parents[3]
    if not (build / "CMakeCache.txt").is_file():
        raise RuntimeError(
            f"raymortar at {Path(raymortar.__file__).parent} is not of a build "
            "directory: run the benchmark with scripts/python"
        )
    command = ["cmake", "--build", str(build), "--target", "_floor"]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{made.stdout}{made.stderr}")
    folder = str(build / "benchmarks" / "speed")
    if folder not in sys.path:
        sys.path.append(folder)
    return importlib.import_module("_floor")
