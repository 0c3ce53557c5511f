"""Files: meshes and tags from Gmsh, fields for ParaView.

`read_gmsh` gives what DOLFINx's ``model_to_mesh`` gives, the same in every version.
`write_xdmf` writes values at the mesh's own nodes, `write_vtk` at nodes of degree 2 too.
"""

from .gmsh import GmshMesh, read_gmsh
from .writers import of_one_degree, write_vtk, write_xdmf

__all__ = ["of_one_degree", "read_gmsh", "write_vtk", "write_xdmf"]
