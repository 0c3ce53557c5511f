"""DOLFINx meshes out of arrays, in every version of DOLFINx."""

from raymortar.versions import create_mesh

__all__ = ["create_mesh"]
