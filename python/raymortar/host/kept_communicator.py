"""PETSc's communicator of a mesh, kept for as long as the mesh lives."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

_NAME = "_raymortar_communicator"


def keep_communicator(mesh: Any) -> None:
    """Hold PETSc's own communicator of a mesh. Collective.

    PETSc makes a communicator with its first object on a mesh, collectively, and frees
    it with the last one. Python's collector destroys objects on each rank at another
    time. So one rank might still have the communicator while another one makes a new
    one, and both would wait for ever.
    """
    if not hasattr(mesh, _NAME):
        vector = PETSc.Vec().createMPI((0, None), comm=mesh.comm)
        setattr(mesh, _NAME, vector)
