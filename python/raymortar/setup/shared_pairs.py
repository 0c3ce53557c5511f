"""Contacts of one problem that have multipliers on the same pair."""

from __future__ import annotations

from typing import Any

from ..core.errors import warn
from ..core.problem import CoupledProblem


def warn_of_shared_pairs(problem: CoupledProblem) -> None:
    """Say where several multipliers stand for the traction of one pair."""
    contacts = problem.contact.contacts
    known: dict[frozenset[Any], int] = {}
    for i, contact in enumerate(contacts):
        if contact.assembly.surfaces.multiplier is None:
            continue
        for pair in contact.pairs:
            sides = frozenset((pair.slave, pair.master))
            if sides in known:
                slave = contact.zones[pair.surface].facets.spoken
                other = pair.master_name or pair.master
                warn(
                    f"contact[{known[sides]}] and contact[{i}] both have multipliers "
                    f"on {slave} and master {other}: only their sum "
                    "is determined. Give the pair to one of them, or one a Penalty",
                )
            known[sides] = i
