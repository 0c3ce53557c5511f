"""What a user gives a contact: displacement, pairs and names, after checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dolfinx.fem import Function

from ..errors import ContactError, require_agreement, together
from ..host.checks import check_space
from ..host.host import Host
from ..host.ranks import keep_communicator
from ..options.contact_options import ContactOptions
from .pairs import PairTable, known_names, numbered, table
from .zone_data import Masters
from .zones import described, group_pairs


@dataclass(frozen=True)
class Given:
    """Arguments of a contact that say where it is.

    Attributes
    ----------
    host
        What is solved for.
    names
        Facet tag by name.
    pairs
        Each pair once.
    groups
        Masters of each slave tag.
    """

    host: Host
    names: dict[str, int]
    pairs: PairTable
    groups: dict[int, Masters]


def check_given(
    u: Function | Sequence[Function],
    pairs: Any,
    names: Mapping[str, Any] | None,
    options: ContactOptions,
) -> Given:
    """Arguments of a contact, after checks of all but its facets. Collective.

    Raises
    ------
    ContactError
        For input that cannot work, or that differs between ranks.
    """
    first = u[0] if isinstance(u, (list, tuple)) and u else u
    if not isinstance(first, Function):
        raise ContactError(f"u must be a Function, not {type(first).__name__}")
    mesh = first.function_space.mesh
    with together(mesh.comm):
        host = Host(u)
    keep_communicator(mesh)
    with together(mesh.comm):
        options.check()
        known = known_names(names, host.u.function_space.mesh.topology.dim - 1)
        tags = numbered(pairs, known)
        groups = group_pairs(tags)
        each = table(tags, known)
    require_agreement(
        mesh.comm,
        **vars(options),
        pairs={slave: described(masters) for slave, masters in groups.items()},
        names=each,
    )
    for part in host.displacements:
        check_space(part.u)
    return Given(host, known, PairTable(each, [known] * len(each)), groups)
