"""Attributes of a contact that have moved to one of its parts."""

from __future__ import annotations

import warnings
from typing import Any

# Names that have moved, with the attribute that has them now
_OWNERS = {
    name: owner
    for owner, names in {
        "system": "add_tangent assemble_residual axisymmetric bodies constrained cpp "
        "extend_room free_bodies preallocations prepare require_mesh revision "
        "set_groups solve_for stiffness_diagonal take updates use_volume",
        "states": "changing extrapolate go_back owners quantities u_of u_old values_of",
        "results": "accumulated_slip coverage meetings of_pair parts_of_all resultant_on "
        "resultants to_nodes write_segments",
        "surfaces": "interfaces slave_u",
        "assembly": "gamma_scale",
        "offsets": "excess",
    }.items()
    for name in names.split()
}


def find(contact: Any, name: str) -> Any:
    """Find an attribute of a contact that has moved, with a DeprecationWarning at the
    line that asks for it."""
    owner = _OWNERS.get(name)
    if owner is None:
        kind = type(contact).__name__
        raise AttributeError(f"{kind!r} object has no attribute {name!r}")
    # This function, the hook that calls it, and the contact's own
    warnings.warn(
        f"contact.{name} has moved: use contact.{owner}.{name}",
        DeprecationWarning,
        stacklevel=4,
    )
    return getattr(getattr(contact, owner), name)
