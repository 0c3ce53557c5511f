"""Pytest plugin of scripts/test: tests side by side, by pytest-xdist.

The first process starts MPI before it starts the others, and MPI leaves its
settings in the environment. There they would tell the others, and every mpirun
of a test, that they belong to that first process. RAYMORTAR_SETTINGS names the
settings that were there before.
"""

import os

OF_MPI = ("OMPI_", "ORTE_", "PMIX_", "PMI_", "PRTE_", "MPI")


def _forget_the_first_process():
    before = os.environ.get("RAYMORTAR_SETTINGS", "").split()
    for name in list(os.environ):
        if name.startswith(OF_MPI) and name not in before:
            del os.environ[name]


if "PYTEST_XDIST_WORKER" in os.environ:
    _forget_the_first_process()
