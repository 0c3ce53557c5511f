"""What Dirichlet conditions prescribe."""

from raymortar.core import compat


def dirichlet_dofs(bcs, V):
    """Ghosted arrays of a space: 1 where it is constrained, and the value there."""
    return compat.prescribed_values(bcs, V.dofmap.index_map, V.dofmap.index_map_bs)
