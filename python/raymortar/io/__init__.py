"""Files: meshes and tags from Gmsh, fields for ParaView.

`read_gmsh` gives what DOLFINx's ``model_to_mesh`` gives, the same in every version.
`write_xdmf` writes values at the mesh's own nodes, `write_vtk` at nodes of degree 2 too.
"""

from ..core.compat.files import of_one_degree, write_vtk, write_xdmf
from ..core.compat.gmsh import GmshMesh, read_gmsh

__all__ = ["of_one_degree", "read_gmsh", "write_vtk", "write_xdmf"]
