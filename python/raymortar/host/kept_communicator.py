"""PETSc's communicator of a mesh, kept for as long as the mesh lives."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

_NAME = "_raymortar_communicator"


def keep_communicator(mesh: Any) -> None:
    """Hold PETSc's own communicator of a mesh. Collective.

    PETSc makes one with its first object on a mesh, which is collective, and drops it
    with the last. Python destroys objects when its collector comes by, on each rank at
    another time: without this one rank may still have the communicator where another
    makes it anew, and both wait for ever.
    """
    if not hasattr(mesh, _NAME):
        vector = PETSc.Vec().createMPI((0, None), comm=mesh.comm)
        setattr(mesh, _NAME, vector)
