"""DOLFINx meshes out of arrays, in every version of DOLFINx."""

from raymortar.core.compat.gmsh import create_mesh

__all__ = ["create_mesh"]
