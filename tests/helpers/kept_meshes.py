"""Meshes that live until the end of the test that makes them.

mpi4py 4 locks objects of a communicator that it frees. If that is while an exception is on
its way, as where a mesh is an argument of a call that fails, it never unlocks, and the
next test waits for ever. DOLFINx frees the communicator with the mesh.
"""

import contextlib

from dolfinx.mesh import Mesh


@contextlib.contextmanager
def kept_meshes():
    """Keep all meshes that are made within."""
    made, start = [], Mesh.__init__

    def start_and_keep(self, cpp, domain):
        start(self, cpp, domain)
        made.append(cpp)

    Mesh.__init__ = start_and_keep
    try:
        yield
    finally:
        Mesh.__init__ = start
